//! The checked robot: plain data, SI units, parents before children.

use crate::mesh::Mesh;
use nalgebra::{Isometry3, Matrix3, Unit, Vector3};
use std::sync::Arc;

/// A tree of bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Name in the file.
    pub name: String,
    /// Connection of the root to the world.
    pub base: Base,
    /// Bodies, each after its parent.
    pub bodies: Vec<Body>,
    /// Joints in the order of their child bodies.
    pub joints: Vec<Joint>,
    /// Further bodies that move freely, with the pose of their frame in the frame of the file.
    pub others: Vec<(usize, Isometry3<f64>)>,
    /// Shapes that stand still, in the frame of the file.
    pub world_shapes: Vec<Shape>,
    /// Planes that stand still.
    pub planes: Vec<Plane>,
    /// Pairs of bodies that never touch.
    pub excluded: Vec<[usize; 2]>,
    /// Joints that follow others.
    pub couplings: Vec<Coupling>,
    /// Connections beyond the tree, closed in the pose of the file.
    pub loops: Vec<Loop>,
    /// Content of the file that has no effect, with its place.
    pub warnings: Vec<String>,
    /// Choices that were made in reading the file, with their place.
    pub notices: Vec<String>,
}

/// Coordinate of the follower = ratio · coordinate of the leader + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupling {
    /// Name, unique among couplings and loops.
    pub name: String,
    /// Index of the joint that follows.
    pub follower: usize,
    /// Index of the joint that leads.
    pub leader: usize,
    /// See above.
    pub ratio: f64,
    /// rad or m.
    pub offset: f64,
}

/// Two bodies held together beyond the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// Name, unique among couplings and loops.
    pub name: String,
    /// The bodies; none: the world. Different.
    pub bodies: [Option<usize>; 2],
    /// Where, in the frame of the first body (of the file, where it is the world), m.
    pub origin: Vector3<f64>,
    /// Whether they also keep their orientation.
    pub rigid: bool,
}

/// A half-space that stands still, in the frame of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Out of the ground.
    pub normal: Unit<Vector3<f64>>,
    /// normal·p of the points p of the surface, m.
    pub offset: f64,
    /// Coulomb friction; none: the scenario's.
    pub friction: Option<f64>,
}

/// Root of the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Base {
    /// Body 0 moves freely; pose of its frame in the frame of the file's root link.
    Free(Isometry3<f64>),
    /// The root link is the world: joints without a parent hang from it.
    World,
}

/// One rigid body; its frame is that of its link.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name of the link.
    pub name: String,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass in the axes of the body frame, kg m².
    pub inertia: Matrix3<f64>,
    /// Shapes that can be seen or hit.
    pub shapes: Vec<Shape>,
}

/// A shape fixed to a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Name in the file, or of the link.
    pub name: String,
    /// Geometry.
    pub geometry: ShapeGeometry,
    /// Pose in the body frame.
    pub body_from_shape: Isometry3<f64>,
    /// Whether it can be hit; otherwise it is only seen.
    pub collides: bool,
    /// Coulomb friction; none: the scenario's. Of two shapes the larger one counts.
    pub friction: Option<f64>,
    /// Collision group and mask, as bits: two shapes meet if one's group is in the other's mask.
    pub group: u32,
    /// See `group`.
    pub mask: u32,
}

impl Shape {
    /// Whether the bits let two shapes meet.
    pub fn meets(&self, other: &Self) -> bool {
        self.group & other.mask != 0 || other.group & self.mask != 0
    }
}

/// Geometry in the shape's frame, centre at the origin, m.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeGeometry {
    /// Sphere.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Box.
    Box {
        /// Half lengths.
        half_extents: [f64; 3],
    },
    /// Axis along z.
    Cylinder {
        /// Half length along z.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// Segment along z, swollen.
    Capsule {
        /// Half length of the segment.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// Inside of all faces of a convex mesh.
    Hull(Arc<Mesh>),
    /// A mesh that is not convex and moves.
    Concave {
        /// As it is, for contact with soil.
        mesh: Arc<Mesh>,
        /// Its convex hull, for contact with bodies and rigid ground.
        hull: Arc<Mesh>,
    },
    /// Triangles as they are; of shapes that stand still only.
    Triangles(Arc<Mesh>),
    /// Ground over a grid; of shapes that stand still only.
    Heights(Arc<Heights>),
}

/// Heights over a rectangular grid around the origin, z up; every cell is two triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// Number of nodes along x and y, at least 2.
    pub nodes: [usize; 2],
    /// Lengths of the whole grid along x and y, m.
    pub lengths: [f64; 2],
    /// Of all nodes, x fastest, m.
    pub heights: Vec<f64>,
}

/// A joint between a body and its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name.
    pub name: String,
    /// Kind.
    pub kind: JointKind,
    /// Index of the parent body; none: the world.
    pub parent: Option<usize>,
    /// Index of the child body.
    pub child: usize,
    /// Joint frame in the parent body (in the frame of the root link where the parent is the world).
    pub parent_from_joint: Isometry3<f64>,
    /// Joint frame in the child body; moves along or about `axis` against the one on the parent.
    pub child_from_joint: Isometry3<f64>,
    /// Axis in the joint frame.
    pub axis: Unit<Vector3<f64>>,
    /// Smallest and largest coordinate, rad or m; none: unlimited.
    pub limits: Option<[f64; 2]>,
    /// Forces along it unless the scenario sets others.
    pub data: AxisData,
}

/// Forces and limits along the axis of a joint; units of a joint that turns.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct AxisData {
    /// Viscous friction, N m s/rad.
    pub damping: f64,
    /// Coulomb friction, N m.
    pub friction: f64,
    /// Inertia of the drive at the joint, kg m².
    pub armature: f64,
    /// Spring, N m/rad, and the coordinate where it rests, rad.
    pub stiffness: f64,
    /// See `stiffness`.
    pub reference: f64,
    /// Largest torque that the file allows at the joint (`effort` of URDF), N m; none: not given.
    pub effort: Option<f64>,
    /// The motor; none: the file has none.
    pub drive: Option<Drive>,
}

/// A motor as the file describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Kind of its drive.
    pub kind: DriveKind,
    /// Of a position motor, N m/rad.
    pub stiffness: f64,
    /// Of a position motor, N m s/rad.
    pub damping: f64,
    /// Largest torque, N m; none: the scenario's.
    pub max_torque: Option<f64>,
}

/// Kind of drive of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveKind {
    /// To a coordinate, by stiffness and damping.
    Position,
    /// At a rate.
    Velocity,
    /// By a torque.
    Torque,
}

/// Freedoms of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis.
    Revolute,
    /// Slides along its axis.
    Prismatic,
    /// Nothing.
    Fixed,
    /// Turns freely.
    Spherical,
    /// Slides across its axis and turns about it.
    Planar,
}
