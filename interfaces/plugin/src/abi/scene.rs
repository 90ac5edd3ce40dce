//! Bodies, shapes, fields, energy.
use std::ffi::{c_char, c_void};

/// Position (m) and unit quaternion w, x, y, z.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgPose {
    /// Translation, m.
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z.
    pub orientation: [f64; 4],
}

/// Committed pose and twist of a body's frame.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgBodyState {
    /// Pose of the body frame in the world.
    pub world_from_body: TgPose,
    /// Velocity of the origin of the body frame, world axes, m/s.
    pub linear_velocity: [f64; 3],
    /// Angular velocity, world axes, rad/s.
    pub angular_velocity: [f64; 3],
}

/// Something that moves as a whole.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgBody {
    /// Name, unique in the subsystem.
    pub name: *const c_char,
    /// Total mass, kg (for reports; 0: unknown or fixed).
    pub mass: f64,
}

/// A shape fixed to a body.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgShape {
    /// Stable id, unique in the subsystem.
    pub id: u32,
    /// Index of the body.
    pub body: u32,
    /// TG_SPHERE ... TG_MESH.
    pub geometry: u32,
    /// 1: can be hit; 0: is only seen.
    pub collides: u32,
    /// Name for people.
    pub name: *const c_char,
    /// Measures of the geometry, m.
    pub size: [f64; 3],
    /// Corners of a mesh: x, y, z of each, m.
    pub points: *const f64,
    /// Faces of a mesh: three indices of corners each, counter-clockwise seen from outside.
    pub triangles: *const u32,
    /// Number of corners.
    pub n_points: u32,
    /// Number of faces.
    pub n_triangles: u32,
    /// Pose of the shape in the body.
    pub body_from_shape: TgPose,
}

/// All bodies and shapes; constant over the life of an instance.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgScene {
    /// Bodies in the order of `body_states`.
    pub bodies: *const TgBody,
    /// Shapes in ascending order of id.
    pub shapes: *const TgShape,
    /// Number of bodies.
    pub n_bodies: u32,
    /// Number of shapes.
    pub n_shapes: u32,
}

/// Material of a shape, for sensors. Since 3.1.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgMaterial {
    /// 0 unknown, 1 metal, 2 rock, 3 soil, 4 wood, 5 foliage, 6 glass, 7 water; from 16 on free.
    pub class_id: u32,
    /// Part of the light that comes back, 0 ... 1.
    pub reflectance: f32,
    /// Part of the light that passes through, 0 ... 1; with the reflectance at most 1.
    pub transmittance: f32,
}

/// A joint between two bodies of a scene, or between a body and the world. Since 3.1.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgJoint {
    /// Name, unique in the subsystem.
    pub name: *const c_char,
    /// The action that breaks it; empty or null: none.
    pub break_action: *const c_char,
    /// Index of the body that it hangs on; UINT32_MAX: the world.
    pub parent: u32,
    /// Index of the body that it carries.
    pub child: u32,
    /// TG_REVOLUTE ... TG_UNIVERSAL.
    pub kind: u32,
    /// Id of the variable of its position, rad or m; UINT32_MAX: none, here and below.
    pub position: u32,
    /// Id of that of its velocity, rad/s or m/s.
    pub velocity: u32,
    /// Id of that of the torque or force of its motor, N m or N.
    pub torque: u32,
    /// Id of that of the most that its motor can give, N m or N.
    pub torque_limit: u32,
    /// Id of that of whether it is held fast.
    pub blocked: u32,
    /// Pose of the joint in the parent, where the joint stands at zero.
    pub parent_from_joint: TgPose,
    /// Direction of the axis in the frame of the joint, unit; zero for a kind without an axis.
    pub axis: [f64; 3],
    /// Smallest and largest position, rad or m; -inf, inf: none.
    pub limits: [f64; 2],
}

/// A field over the ground. Nodes (i, j) lie at origin + (i, j) * spacing.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgField {
    /// Name; "height" is the surface that contact detection reads.
    pub name: *const c_char,
    /// Unit of the values.
    pub unit: *const c_char,
    /// World x, y of node (0, 0), m.
    pub origin: [f64; 2],
    /// Distance of neighbouring nodes, m.
    pub spacing: f64,
    /// Number of nodes along x and y.
    pub size: [u32; 2],
    /// Nodes along the edge of a tile.
    pub tile_edge: u32,
    /// 0.
    pub reserved: u32,
}

/// One tile of a field: tile_edge^2 values, x fastest; nodes beyond the field's size are padding. The data
/// stay valid until the next call that may change the committed state.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgFieldTile {
    /// Grows whenever a value in the tile changes.
    pub generation: u64,
    /// TG_TILE_UNIFORM, TG_TILE_F64, TG_TILE_F32 or TG_TILE_FIXED.
    pub format: u32,
    /// 0.
    pub reserved: u32,
    /// The value of a uniform tile, or the value of 1 in a fixed-point tile.
    pub scale: f64,
    /// Values.
    pub data: *const c_void,
    /// Number of values.
    pub count: usize,
}

/// Energies of the committed state and work done since the start, J. NAN: unknown, no book is kept of it; it is shown so, and
/// makes every sum unknown that needs it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgEnergy {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy; of a soil its elastic energy and the gravitational energy of its material.
    pub potential: f64,
    /// Energy turned into heat inside since the start; >= 0, never falls.
    pub dissipated: f64,
    /// Work done on this subsystem through its ports since the start. Of a soil: by the wrench of its own law at the motion
    /// that was committed, not by the wrench passed to `commit`.
    pub port_work: f64,
    /// Mechanical work that its own motors have put in since the start.
    pub actuator_work: f64,
    /// Electrical energy that its motors have drawn since the start.
    pub electrical: f64,
}
