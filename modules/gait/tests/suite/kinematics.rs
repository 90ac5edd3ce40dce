//! Inverse kinematics against forward kinematics over the workspace, and behaviour at its edge.

use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use terraglue_gait::geometry::Leg;

fn leg(left: bool) -> Leg {
    let side = if left { 1.0 } else { -1.0 };
    Leg { hip: [0.35, side * 0.2, 0.0], yaw: side * FRAC_PI_2, links: [0.06, 0.10, 0.20, 0.30] }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

proptest! {
    #[test]
    fn forward_undoes_inverse_wherever_the_leg_reaches(
        left: bool, direction in -1.3..1.3_f64, bow in -1.2..1.2_f64, share in 0.0..1.0_f64,
    ) {
        let leg = leg(left);
        let [least, largest] = leg.reach();
        let d = least + share * (largest - least);
        let radius = leg.links[0] + d * bow.cos();
        let at = leg.yaw + direction;
        let foot = [leg.hip[0] + radius * at.cos(), leg.hip[1] + radius * at.sin(), d * bow.sin() - leg.links[3]];
        let solution = leg.inverse(foot);
        prop_assert!(distance(leg.forward(&solution.angles), foot) < 1e-12);
        prop_assert!((solution.angles[0] - direction).abs() < 1e-12);
        let [_, a2, a3, a4] = solution.angles;
        prop_assert!((a2 + a3 + a4 + FRAC_PI_2).abs() < 1e-12, "the last link is not vertical");
        prop_assert!(a3 <= 0.0, "the knee points down");
    }

    #[test]
    fn a_foot_out_of_reach_is_pulled_to_the_edge(x in -2.0..2.0_f64, y in 0.3..2.0_f64, z in -2.0..1.0_f64) {
        let leg = leg(true);
        let solution = leg.inverse([x, y, z]);
        prop_assert!(solution.angles.iter().all(|a| a.is_finite() && a.abs() <= 2.0 * PI));
        let back = distance(leg.forward(&solution.angles), [x, y, z]);
        prop_assert_eq!(solution.clipped, back > 1e-9);
    }
}

#[test]
fn the_hexapod_stands_at_its_known_angles() {
    let solution = leg(true).inverse([0.35, 0.5, -0.3]);
    for (angle, known) in solution.angles.iter().zip([0.0, 0.958192179, -1.379634180, -1.149354325]) {
        assert!((angle - known).abs() < 1e-9, "{angle} {known}");
    }
}

#[test]
fn the_edge_of_the_stride_is_the_edge_of_reach() {
    let leg = leg(true);
    let x = leg.stride_reach(0.3, 0.3).expect("the foot stands");
    assert!(!leg.inverse([leg.hip[0] + x - 1e-9, 0.5, -0.3]).clipped);
    assert!(leg.inverse([leg.hip[0] + x + 1e-6, 0.5, -0.3]).clipped);
    assert_eq!(leg.stride_reach(0.3, 1.0), None);
}
