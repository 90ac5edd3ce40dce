//! Points of a shape that a plane can meet.

use super::*;
use nalgebra::UnitQuaternion;

fn lowest(g: &ShapeGeometry, pose: &Isometry3<f64>) -> f64 {
    let mut lowest = f64::INFINITY;
    support_points(g, pose, &V3::z(), |p| lowest = lowest.min(p.z));
    lowest
}

#[test]
fn the_deepest_point_is_among_them() {
    let tilt = UnitQuaternion::from_axis_angle(&V3::x_axis(), 0.3);
    let pose = Isometry3::from_parts(nalgebra::Translation3::new(0.0, 0.0, 1.0), tilt);
    let (sin, cos) = (0.3_f64.sin(), 0.3_f64.cos());
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    near(lowest(&ShapeGeometry::Sphere { radius: 0.2 }, &pose), 0.8);
    near(lowest(&ShapeGeometry::Box { half_extents: [0.1, 0.2, 0.3] }, &pose), 1.0 - 0.2 * sin - 0.3 * cos);
    near(
        lowest(&ShapeGeometry::Cylinder { half_length: 0.3, radius: 0.1 }, &pose),
        1.0 - 0.1 * sin - 0.3 * cos,
    );
    near(lowest(&ShapeGeometry::Capsule { half_length: 0.3, radius: 0.1 }, &pose), 0.9 - 0.3 * cos);
}
