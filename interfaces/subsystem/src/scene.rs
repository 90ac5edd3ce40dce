//! Scenes: bodies, the shapes that they carry and the joints between them, described once, and the state of the bodies.

use crate::joint::SceneJoint;
use crate::material::Material;
use crate::pose::Pose;

/// Geometry of a shape in its own frame, m.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Centre at the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Centre at the origin.
    Box {
        /// Half lengths along x, y, z.
        half_extents: [f64; 3],
    },
    /// Segment along z from −half_length to half_length, swollen by radius.
    Capsule {
        /// Half length of the segment.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// Axis along z, centre at the origin.
    Cylinder {
        /// Half length along z.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// A mesh: convex where its triangles are the faces of a convex body. Any other, with dents or open, counts on soil by
    /// its own triangles.
    ConvexMesh {
        /// Corners, m.
        points: Vec<[f64; 3]>,
        /// Three indices of corners each, counter-clockwise seen from outside.
        triangles: Vec<[u32; 3]>,
    },
    /// A cone without its tip: axis along z, flat ends, the centre of the axis at the origin.
    ConeFrustum {
        /// Half length along z.
        half_length: f64,
        /// Radius of the end at z = −half_length; may be 0.
        radius_bottom: f64,
        /// Radius of the end at z = half_length; may be 0.
        radius_top: f64,
    },
    /// Centre at the origin.
    Ellipsoid {
        /// Half lengths along x, y, z.
        semi_axes: [f64; 3],
    },
    /// Triangles, open or closed, seen from both sides. It is seen only: soil does not meet it.
    Mesh {
        /// Corners, m.
        points: Vec<[f64; 3]>,
        /// Three indices of corners each.
        triangles: Vec<[u32; 3]>,
    },
}

impl Geometry {
    /// Lowest and highest corner of a box along the axes of its own frame, m; a mesh without points has none: +∞ and −∞.
    pub fn extent(&self) -> [[f64; 3]; 2] {
        let half = match self {
            Self::Sphere { radius } => [*radius; 3],
            Self::Box { half_extents } => *half_extents,
            Self::Capsule { half_length, radius } => [*radius, *radius, half_length + radius],
            Self::Cylinder { half_length, radius } => [*radius, *radius, *half_length],
            Self::ConeFrustum { half_length, radius_bottom, radius_top } => {
                let radius = radius_bottom.max(*radius_top);
                [radius, radius, *half_length]
            }
            Self::Ellipsoid { semi_axes } => *semi_axes,
            Self::ConvexMesh { points, .. } | Self::Mesh { points, .. } => {
                let empty = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
                return points.iter().fold(empty, |[low, high], p| {
                    [[0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k]))]
                });
            }
        };
        [half.map(|h| -h), half]
    }

    /// Why a shape of this geometry cannot be hit; none where it can.
    pub fn cannot_collide(&self) -> Option<&'static str> {
        matches!(self, Self::Mesh { .. })
            .then_some("a mesh without an inside is seen only; take a convex mesh for what is hit")
    }
}

/// Something that moves as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneBody {
    /// Name, unique in the subsystem.
    pub name: String,
    /// Total mass, kg (for reports; 0: unknown or fixed).
    pub mass: f64,
}

/// A shape fixed to a body.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneShape {
    /// Stable id, unique in the subsystem.
    pub id: u32,
    /// Index into [`Scene::bodies`].
    pub body: u32,
    /// Name for people; the name of the body where it has one shape.
    pub name: String,
    /// Geometry in the shape's frame.
    pub geometry: Geometry,
    /// Pose of the shape in the body.
    pub body_from_shape: Pose,
    /// Whether it can be hit; otherwise it is only seen.
    pub collides: bool,
    /// Its material, for sensors.
    pub material: Material,
}

impl SceneShape {
    /// The fault of a shape that can be neither seen nor hit; none where it is valid.
    pub fn wrong(&self) -> Option<&'static str> {
        self.material.wrong().or_else(|| self.geometry.cannot_collide().filter(|_| self.collides))
    }
}

/// All bodies, shapes and joints of a subsystem; constant over the life of an instance.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Scene {
    /// Bodies in the order of [`crate::Subsystem::body_states`].
    pub bodies: Vec<SceneBody>,
    /// Shapes in ascending order of id.
    pub shapes: Vec<SceneShape>,
    /// Joints, a robot's tree from the root on, closures behind.
    pub joints: Vec<SceneJoint>,
}
