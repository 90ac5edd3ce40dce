//! Proof at compile time that plain types of the subsystem interface and of the C ABI have one layout, so that
//! slices of them cross the border by a cast of the pointer.

use super::{
    TgBodyRef, TgBodyState, TgEnergy, TgLaw, TgMaterial, TgNode, TgPort, TgPose, TgRay, TgRayHit, TgRayMask,
    TgShapeRef,
};
use std::mem::{align_of, offset_of, size_of};
use terraglue_subsystem::{
    BodyRef, BodyState, Energy, Law, Material, Node, Port, Pose, Ray, RayHit, RayMask, ShapeRef,
};

macro_rules! same_layout {
    ($ours:ty, $theirs:ty, $($field:ident),+) => {
        const _: () = {
            assert!(size_of::<$ours>() == size_of::<$theirs>());
            assert!(align_of::<$ours>() == align_of::<$theirs>());
            $(assert!(offset_of!($ours, $field) == offset_of!($theirs, $field));)+
        };
    };
}

same_layout!(Law, TgLaw, t_min, t_max, mu, compliance);
same_layout!(Node, TgNode, i, j, area, lower, slope);
same_layout!(
    Port, TgPort, key, kind, side, mask, first, body, shape, first_node, node_count, origin, frame, extent,
    law
);
same_layout!(Pose, TgPose, position, orientation);
same_layout!(BodyState, TgBodyState, world_from_body, linear_velocity, angular_velocity);
same_layout!(Energy, TgEnergy, kinetic, potential, dissipated, port_work, actuator_work, electrical);
same_layout!(BodyRef, TgBodyRef, subsystem, body);
same_layout!(ShapeRef, TgShapeRef, subsystem, body, shape);
same_layout!(Ray, TgRay, origin, direction, time, range);
same_layout!(RayHit, TgRayHit, distance, normal, subsystem, body, shape, material);
same_layout!(RayMask, TgRayMask, sees, classes, skip);
same_layout!(Material, TgMaterial, reflectance, transmittance);
// `class` is a word of C++
const _: () = assert!(offset_of!(Material, class) == offset_of!(TgMaterial, class_id));
