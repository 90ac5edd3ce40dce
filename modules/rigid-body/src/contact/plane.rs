//! Rigid ground: a half-space, and the points of a shape that can touch it.

use crate::math::V3;
use nalgebra::{Isometry3, Point3};
use terraglue_robot_import::ShapeGeometry;

/// A rigid half-space with its friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    /// Unit vector out of the ground, world axes.
    pub normal: V3,
    /// Points p of the surface have normal·p = offset, m.
    pub offset: f64,
    /// Coulomb friction; none: the scenario's.
    pub friction: Option<f64>,
}

/// Calls `each` with the points of a shape, m in the world, of which at least one is the deepest in the half-space
/// and which together support the shape on it.
pub(crate) fn support_points(g: &ShapeGeometry, pose: &Isometry3<f64>, n: &V3, mut each: impl FnMut(V3)) {
    let centre = pose.translation.vector;
    let mut at = |x: f64, y: f64, z: f64| each((pose * Point3::new(x, y, z)).coords);
    match *g {
        ShapeGeometry::Sphere { radius } => each(centre - radius * n),
        ShapeGeometry::Capsule { half_length, radius } => {
            let axis = pose.rotation * V3::new(0.0, 0.0, half_length);
            each(centre + axis - radius * n);
            each(centre - axis - radius * n);
        }
        ShapeGeometry::Box { half_extents: [x, y, z] } => {
            for k in 0..8 {
                let sign = |bit: i32| if k & bit == 0 { 1.0 } else { -1.0 };
                at(sign(1) * x, sign(2) * y, sign(4) * z);
            }
        }
        ShapeGeometry::Hull(ref mesh) | ShapeGeometry::Concave { hull: ref mesh, .. } => {
            mesh.points.iter().for_each(|p| at(p[0], p[1], p[2]))
        }
        // Ground has no ground below it.
        ShapeGeometry::Triangles(_) | ShapeGeometry::Heights(_) => {}
        ShapeGeometry::Cylinder { half_length, radius } => {
            // On each rim the lowest point, the opposite one and those between; any four where the disc lies flat.
            let down = -pose.rotation.inverse_transform_vector(n);
            let flat = (down.x * down.x + down.y * down.y).sqrt();
            let (c, s) = if flat > 1e-9 { (down.x / flat, down.y / flat) } else { (1.0, 0.0) };
            for z in [half_length, -half_length] {
                for (x, y) in [(c, s), (-c, -s), (-s, c), (s, -c)] {
                    at(radius * x, radius * y, z);
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/plane.rs"]
mod tests;
