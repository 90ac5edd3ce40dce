//! The free rotation of a body.

use super::*;

#[test]
fn energy_and_momentum_of_a_free_body_stay_over_a_step() {
    let inertia = M3::from_diagonal(&V3::new(0.1, 0.2, 0.3));
    let rate = V3::new(0.01, 10.0, 0.3);
    let (_, end) = free_rotation(&inertia, &rate, 1e-2);
    let energy = |w: &V3| 0.5 * w.dot(&(inertia * w));
    assert!((energy(&end) / energy(&rate) - 1.0).abs() < 1e-14);
    assert!(((inertia * end).norm() / (inertia * rate).norm() - 1.0).abs() < 1e-14);
    assert!((end - rate).norm() > 1e-4);
}
