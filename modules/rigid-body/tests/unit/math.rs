//! Rotations and angles.

use super::*;

#[test]
fn euler_angles_come_back() {
    let q = Q::from_euler_angles(0.3, -0.7, 2.0);
    for (a, b) in euler(&q).iter().zip([0.3, -0.7, 2.0]) {
        assert!((a - b).abs() < 1e-14);
    }
}

#[test]
fn a_frame_along_any_axis_is_right_handed() {
    for axis in [V3::x(), -V3::x(), V3::y(), -V3::z(), V3::new(0.6, -0.48, 0.64)] {
        assert!((frame_along(&axis) * V3::x() - axis).norm() < 1e-15);
    }
}

#[test]
fn the_rotation_vector_of_a_cayley_transform_is_its_own_logarithm() {
    for r in [V3::new(1e-6, 2e-6, 0.0), V3::new(0.2, -0.1, 0.4)] {
        assert!((cayley(&r).scaled_axis() - cayley_vector(&r)).norm() < 1e-15);
    }
}

#[test]
fn angles_continue_over_full_turns() {
    assert!((unwrap_angle(-3.0, 3.2) - (std::f64::consts::TAU - 3.0)).abs() < 1e-15);
}
