//! Joints between the bodies of a scene, for viewers that draw them, plot them by name and offer them for selection.

use crate::pose::Pose;

/// A joint between two bodies of a scene, or between a body and the world.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneJoint {
    /// Name, unique in the subsystem.
    pub name: String,
    /// Index of the body that it hangs on; [`SceneJoint::WORLD`]: the world.
    pub parent: u32,
    /// Index of the body that it carries.
    pub child: u32,
    /// Pose of the joint in the parent, where the joint stands at zero.
    pub parent_from_joint: Pose,
    /// Direction of the axis in the frame of the joint, unit; zero for a kind without an axis.
    pub axis: [f64; 3],
    /// Kind of its motion.
    pub kind: JointKind,
    /// Smallest and largest position, rad or m; ±∞: none.
    pub limits: [f64; 2],
    /// Variables that hold its values.
    pub variables: JointVariables,
    /// The action that breaks it; empty: none.
    pub break_action: String,
}

impl SceneJoint {
    /// The parent of a joint that hangs on the world.
    pub const WORLD: u32 = u32::MAX;
}

/// Kind of motion of a joint.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis between limits.
    Revolute = 0,
    /// Turns about its axis without limits.
    Continuous = 1,
    /// Slides along its axis.
    Prismatic = 2,
    /// Turns about a point.
    Spherical = 3,
    /// Slides in the plane across its axis and turns about it.
    Planar = 4,
    /// Does not move.
    Fixed = 5,
    /// Closes a loop of the tree: holds two points, axes or bodies together; child and parent are the two sides.
    Closure = 6,
    /// Slides along its axis and turns about it.
    Cylindrical = 7,
    /// Turns about two axes that stay perpendicular; the axis is the one that the parent holds.
    Universal = 8,
}

impl JointKind {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Self; 9] = [
        Self::Revolute,
        Self::Continuous,
        Self::Prismatic,
        Self::Spherical,
        Self::Planar,
        Self::Fixed,
        Self::Closure,
        Self::Cylindrical,
        Self::Universal,
    ];
}

/// Ids of the variables of a joint; [`JointVariables::NONE`]: there is none.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointVariables {
    /// Position, rad or m.
    pub position: u32,
    /// Velocity, rad/s or m/s.
    pub velocity: u32,
    /// Torque or force of its motor, N m or N.
    pub torque: u32,
    /// The most that its motor can give, N m or N.
    pub torque_limit: u32,
    /// Whether it is held fast.
    pub blocked: u32,
}

impl JointVariables {
    /// No variable.
    pub const NONE: u32 = u32::MAX;
    /// None of them.
    pub const ABSENT: Self = Self {
        position: Self::NONE,
        velocity: Self::NONE,
        torque: Self::NONE,
        torque_limit: Self::NONE,
        blocked: Self::NONE,
    };
}
