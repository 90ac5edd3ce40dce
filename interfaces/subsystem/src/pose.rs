//! Poses and motions.

/// Position and orientation: `world_from_x` or `body_from_x` by the name of the value.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Translation, m.
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z.
    pub orientation: [f64; 4],
}

impl Pose {
    /// No displacement.
    pub const IDENTITY: Self = Self { position: [0.0; 3], orientation: [1.0, 0.0, 0.0, 0.0] };
}

/// Committed pose and twist of a body's frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// Pose of the body frame in the world.
    pub world_from_body: Pose,
    /// Velocity of the origin of the body frame, world axes, m/s.
    pub linear_velocity: [f64; 3],
    /// Angular velocity, world axes, rad/s.
    pub angular_velocity: [f64; 3],
}

impl BodyState {
    /// At rest at the origin.
    pub const REST: Self =
        Self { world_from_body: Pose::IDENTITY, linear_velocity: [0.0; 3], angular_velocity: [0.0; 3] };
}
