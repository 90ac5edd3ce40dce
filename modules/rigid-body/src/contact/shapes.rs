//! Shapes for parry, whose cylinders and capsules stand along y where ours stand along z.

use crate::math::V3;
use nalgebra::Isometry3;
use parry3d_f64::shape::SharedShape;
use terraglue_robot_import::{Shape, ShapeGeometry};

/// The shape for parry.
pub(crate) fn parry_shape(shape: &Shape) -> SharedShape {
    match shape.geometry {
        ShapeGeometry::Sphere { radius } => SharedShape::ball(radius),
        ShapeGeometry::Box { half_extents: [x, y, z] } => SharedShape::cuboid(x, y, z),
        // parry's axis is y, ours is z: see `parry_local`.
        ShapeGeometry::Cylinder { half_length, radius } => SharedShape::cylinder(half_length, radius),
        ShapeGeometry::Capsule { half_length, radius } => SharedShape::capsule_y(half_length, radius),
    }
}

/// Pose of the parry shape in the body frame: cylinders and capsules turn from z to y.
pub(crate) fn parry_local(shape: &Shape) -> Isometry3<f64> {
    match shape.geometry {
        ShapeGeometry::Cylinder { .. } | ShapeGeometry::Capsule { .. } => {
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&V3::x_axis(), std::f64::consts::FRAC_PI_2);
            shape.body_from_shape * turn
        }
        _ => shape.body_from_shape,
    }
}
