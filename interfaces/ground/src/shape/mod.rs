//! A shape at a pose: the queries of contact detection, soils and sensors.

mod lower;
mod mesh;
mod planes;
mod slope;
mod support;

pub use slope::STEEPEST_SLOPE;

use crate::math::{Rotation, cross, dot, point};
use mesh::MeshTree;
use planes::Planes;
use terraglue_subsystem::{Geometry, Pose};

/// A plane of a convex mesh: outward unit normal and offset, normal·p ≤ offset inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Face {
    pub normal: [f64; 3],
    pub offset: f64,
}

/// An axis-parallel box in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates, m.
    pub min: [f64; 3],
    /// Largest coordinates, m.
    pub max: [f64; 3],
}

impl Aabb {
    /// Centre, m.
    pub fn centre(&self) -> [f64; 3] {
        std::array::from_fn(|k| 0.5 * (self.min[k] + self.max[k]))
    }

    /// Distance from the centre to a corner, m.
    pub fn radius(&self) -> f64 {
        let half: [f64; 3] = std::array::from_fn(|k| 0.5 * (self.max[k] - self.min[k]));
        dot(half, half).sqrt()
    }
}

/// A geometry at a pose. Cheap to make for all but meshes, whose faces are computed once: keep it and
/// [`Placed::move_to`] it.
///
/// A mesh whose triangles are not the faces of a convex body counts by these triangles.
///
/// ```
/// use terraglue_ground::Placed;
/// use terraglue_subsystem::{Geometry, Pose};
///
/// let at = |z: f64| Pose { position: [1.0, 0.0, z], ..Pose::IDENTITY };
/// let mut foot = Placed::new(&Geometry::Sphere { radius: 0.05 }, &at(0.5));
/// foot.move_to(&at(0.2));
/// assert!((foot.aabb().min[2] - 0.15).abs() < 1e-15 && foot.is_convex());
/// ```
#[derive(Clone, Debug)]
pub struct Placed {
    geometry: Geometry,
    world_from_shape: Pose,
    rotation: Rotation,
    /// Of a convex mesh.
    faces: Vec<Face>,
    /// The same at the pose.
    planes: Planes,
    /// Of a mesh that is not convex.
    tree: Option<MeshTree>,
}

impl Placed {
    /// A copy of `geometry` whose frame lies at `world_from_shape`.
    pub fn new(geometry: &Geometry, world_from_shape: &Pose) -> Self {
        let rotation = Rotation::from_quaternion(world_from_shape.orientation);
        let tree = match geometry {
            Geometry::ConvexMesh { points, triangles } if !mesh::is_convex(points, triangles) => {
                Some(MeshTree::new(points, triangles))
            }
            Geometry::Mesh { points, triangles } => Some(MeshTree::new(points, triangles)),
            _ => None,
        };
        let faces = if tree.is_some() { Vec::new() } else { faces_of(geometry) };
        let mut planes = Planes::reserved(&faces);
        planes.turn(&faces, &rotation);
        Self {
            geometry: geometry.clone(),
            world_from_shape: *world_from_shape,
            rotation,
            faces,
            planes,
            tree,
        }
    }

    /// Whether it has no dents: true for all but meshes whose triangles are not the faces of a convex body.
    pub fn is_convex(&self) -> bool {
        self.tree.is_none()
    }

    /// The same shape at another pose; does not allocate.
    pub fn move_to(&mut self, world_from_shape: &Pose) {
        self.world_from_shape = *world_from_shape;
        self.rotation = Rotation::from_quaternion(world_from_shape.orientation);
        self.planes.turn(&self.faces, &self.rotation);
    }

    /// Its geometry.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Its pose.
    pub fn pose(&self) -> &Pose {
        &self.world_from_shape
    }

    /// Its axes.
    pub fn rotation(&self) -> &Rotation {
        &self.rotation
    }

    /// Smallest axis-parallel box around it, world.
    pub fn aabb(&self) -> Aabb {
        let axes = &self.rotation.0;
        let half: [f64; 3] = match &self.geometry {
            Geometry::Sphere { radius } => [*radius; 3],
            Geometry::Box { half_extents: h } => {
                std::array::from_fn(|k| (0..3).map(|c| axes[c][k].abs() * h[c]).sum())
            }
            Geometry::Capsule { half_length, radius } => {
                std::array::from_fn(|k| axes[2][k].abs() * half_length + radius)
            }
            Geometry::Cylinder { half_length, radius } => std::array::from_fn(|k| {
                let a = axes[2][k];
                a.abs() * half_length + radius * (1.0 - a * a).max(0.0).sqrt()
            }),
            Geometry::Ellipsoid { semi_axes: a } => std::array::from_fn(|k| {
                let squares = (0..3).map(|c| axes[c][k] * a[c]).map(|x| x * x);
                squares.sum::<f64>().sqrt()
            }),
            Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
                return self.frustum_box(*half_length, [*radius_bottom, *radius_top]);
            }
            Geometry::ConvexMesh { points, .. } | Geometry::Mesh { points, .. } => {
                return self.mesh_box(points);
            }
        };
        let c = self.world_from_shape.position;
        Aabb { min: std::array::from_fn(|k| c[k] - half[k]), max: std::array::from_fn(|k| c[k] + half[k]) }
    }

    /// Around the discs at both ends.
    fn frustum_box(&self, half_length: f64, radii: [f64; 2]) -> Aabb {
        let (c, axis) = (self.world_from_shape.position, self.rotation.0[2]);
        let end = |k: usize, side: usize, sign: f64| {
            let along = if side == 0 { -half_length } else { half_length };
            c[k] + along * axis[k] + sign * radii[side] * (1.0 - axis[k] * axis[k]).max(0.0).sqrt()
        };
        Aabb {
            min: std::array::from_fn(|k| end(k, 0, -1.0).min(end(k, 1, -1.0))),
            max: std::array::from_fn(|k| end(k, 0, 1.0).max(end(k, 1, 1.0))),
        }
    }

    fn mesh_box(&self, points: &[[f64; 3]]) -> Aabb {
        let mut out = Aabb { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
        for p in points {
            let w = point(&self.world_from_shape, &self.rotation, *p);
            out.min = std::array::from_fn(|k| out.min[k].min(w[k]));
            out.max = std::array::from_fn(|k| out.max[k].max(w[k]));
        }
        out
    }
}

/// World height of the underside of a shape above (x, y), m; `None` where the vertical line misses it.
///
/// For many points of one shape make a [`Placed`] and ask [`Placed::lower`].
pub fn lower_surface(geometry: &Geometry, world_from_shape: &Pose, x: f64, y: f64) -> Option<f64> {
    Placed::new(geometry, world_from_shape).lower(x, y)
}

/// Smallest axis-parallel box around a shape, world.
pub fn aabb(geometry: &Geometry, world_from_shape: &Pose) -> Aabb {
    Placed::new(geometry, world_from_shape).aabb()
}

/// The different planes of a convex mesh's triangles; triangles without area have none.
fn faces_of(geometry: &Geometry) -> Vec<Face> {
    let Geometry::ConvexMesh { points, triangles } = geometry else {
        return Vec::new();
    };
    let mut faces: Vec<Face> = Vec::new();
    for triangle in triangles {
        let Some(face) = face_of(points, triangle) else { continue };
        let same =
            |f: &Face| dot(f.normal, face.normal) > 1.0 - 1e-14 && (f.offset - face.offset).abs() < 1e-12;
        if !faces.iter().any(same) {
            faces.push(face);
        }
    }
    faces
}

/// The plane of a triangle; none where a corner is missing or it has no area.
fn face_of(points: &[[f64; 3]], triangle: &[u32; 3]) -> Option<Face> {
    let corner = |k: usize| points.get(triangle[k] as usize).copied();
    face(corner(0)?, corner(1)?, corner(2)?)
}

fn face(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> Option<Face> {
    let edge = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| p[k] - a[k]) };
    let (u, v) = (edge(b), edge(c));
    let normal = cross(u, v);
    let length = dot(normal, normal).sqrt();
    (length > 1e-14 * (dot(u, u) + dot(v, v))).then(|| {
        let normal = normal.map(|x| x / length);
        Face { normal, offset: dot(normal, a) }
    })
}
