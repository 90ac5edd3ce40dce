//! Mass properties of shapes that are filled evenly.

use crate::inertia::Inertial;
use crate::mesh::Solid;
use crate::model::{Shape, ShapeGeometry};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use std::f64::consts::PI;

/// Encloses nothing.
pub(crate) fn nothing() -> Solid {
    Solid { volume: 0.0, centre: Vector3::zeros(), inertia: Matrix3::zeros() }
}

/// A homogeneous shape.
pub(crate) fn solid(g: &ShapeGeometry) -> Solid {
    let (volume, moments) = match *g {
        ShapeGeometry::Sphere { radius: r } => (4.0 / 3.0 * PI * r * r * r, [0.4 * r * r; 3]),
        ShapeGeometry::Box { half_extents: [x, y, z] } => {
            let i = |a: f64, b: f64| (a * a + b * b) / 3.0;
            (8.0 * x * y * z, [i(y, z), i(x, z), i(x, y)])
        }
        ShapeGeometry::Cylinder { half_length: l, radius: r } => {
            let about = r * r / 4.0 + l * l / 3.0;
            (PI * r * r * 2.0 * l, [about, about, r * r / 2.0])
        }
        ShapeGeometry::Capsule { half_length: l, radius: r } => {
            // A cylinder and two half spheres whose centres lie 3/8·r beyond its ends.
            let total = PI * r * r * (2.0 * l + 4.0 / 3.0 * r);
            let (rod, ball) = (PI * r * r * 2.0 * l / total, PI * 4.0 / 3.0 * r * r * r / total);
            let about = rod * (r * r / 4.0 + l * l / 3.0) + ball * (0.4 * r * r + l * l + 0.75 * l * r);
            (total, [about, about, rod * r * r / 2.0 + 0.4 * ball * r * r])
        }
        ShapeGeometry::Hull(ref hull) | ShapeGeometry::Concave { ref hull, .. } => return hull.solid(),
        ShapeGeometry::Triangles(_) | ShapeGeometry::Heights(_) => return nothing(),
    };
    let inertia = Matrix3::from_diagonal(&Vector3::from(moments));
    Solid { volume, centre: Vector3::zeros(), inertia }
}

/// A mass spread over a solid that stands at `pose`.
pub(crate) fn placed(mass: f64, solid: &Solid, pose: &Isometry3<f64>) -> Inertial {
    let r = pose.rotation.to_rotation_matrix();
    let tensor = mass * (r * solid.inertia * r.transpose());
    Inertial { mass, com: (pose * Point3::from(solid.centre)).coords, tensor }
}

/// A mass spread evenly over shapes; none where they enclose nothing. Overlaps count twice.
pub(crate) fn evenly<'a>(mass: f64, shapes: impl Iterator<Item = &'a Shape>) -> Option<Inertial> {
    let solids: Vec<(Solid, &Isometry3<f64>)> =
        shapes.map(|s| (solid(&s.geometry), &s.body_from_shape)).filter(|(s, _)| s.volume > 0.0).collect();
    let volume: f64 = solids.iter().map(|(s, _)| s.volume).sum();
    solids.iter().map(|(s, pose)| placed(mass * s.volume / volume, s, pose)).reduce(|a, b| a.with(&b))
}
