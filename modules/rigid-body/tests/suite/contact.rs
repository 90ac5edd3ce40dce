//! The rigid estimate and steps under it: resting, six feet, independence of order, friction.

use crate::common;
use common::{Fixture, MOON, ball};
use terraglue_numerics::extremes::larger;

#[test]
fn a_resting_ball_carries_its_weight_and_stays() {
    let parameters = format!(r#"{{"model": "{}", "position_m": [0, 0, 0.03]}}"#, ball("resting"));
    let mut fixture = Fixture::new(&parameters, MOON, 1e-3);
    for _ in 0..1000 {
        let t = fixture.ground_step();
        assert!((t[0] / (5.0 * MOON) - 1.0).abs() < 1e-8, "{t:?}");
    }
    assert!((fixture.get("ball.z") - 0.03).abs() < 1e-9);
    assert!((fixture.get("ball.contact_normal") / (5.0 * MOON) - 1.0).abs() < 1e-8);
}

#[test]
fn the_estimate_ends_a_fall_in_one_step() {
    let parameters = format!(r#"{{"model": "{}", "position_m": [0, 0, 0.0301]}}"#, ball("fall"));
    let mut fixture = Fixture::new(&parameters, 9.81, 1e-3);
    for _ in 0..100 {
        fixture.ground_step();
        assert!(fixture.get("ball.z") > 0.03 - 1e-12);
    }
    assert!((fixture.get("ball.z") - 0.03).abs() < 1e-12);
}

#[test]
fn six_feet_carry_the_hexapod() {
    let mut fixture = Fixture::hexapod(0.33, 9.81, 1e-3);
    for _ in 0..300 {
        fixture.ground_step();
    }
    let t = fixture.ground_step();
    let sum: f64 = t.iter().step_by(3).sum();
    assert_eq!(t.len(), 18);
    assert!((sum / (fixture.mass() * 9.81) - 1.0).abs() < 1e-5, "{sum} {}", fixture.mass() * 9.81);
    assert!(fixture.get("body.roll").abs() < 1e-3 && fixture.get("body.pitch").abs() < 2e-2);
}

#[test]
fn the_estimate_does_not_depend_on_the_order_of_the_feet() {
    let (mut a, mut b) = (Fixture::hexapod(0.33, 9.81, 1e-3), Fixture::hexapod(0.33, 9.81, 1e-3));
    b.reversed = true;
    for _ in 0..20 {
        let (x, mut y) = (a.ground_step(), b.ground_step());
        y.as_mut_slice().chunks_exact_mut(3).for_each(|c| c.reverse());
        y.reverse();
        for (x, y) in x.iter().zip(&y) {
            assert!((x - y).abs() < 1e-6, "{x} {y}");
        }
    }
}

#[test]
fn trials_are_linear_as_the_compliance_says_and_invisible() {
    let mut fixture = Fixture::hexapod(0.33, 9.81, 1e-3);
    (0..5).for_each(|_| drop(fixture.ground_step()));
    let before = fixture.states();
    let ports = fixture.ports();
    let e = fixture.estimate(&ports).unwrap();
    let n = e.t_star.len();
    let free = fixture.advance(&ports, &vec![0.0; n]).unwrap();
    let loaded = fixture.advance(&ports, &e.t_star).unwrap();
    let scale = loaded.iter().zip(&free).fold(0.0_f64, |m, (a, b)| larger(m, (a - b).abs()));
    for r in 0..n {
        let linear: f64 = free[r] + (0..n).map(|c| e.g[c * n + r] * e.t_star[c]).sum::<f64>();
        assert!((linear - loaded[r]).abs() < 1e-3 * scale, "{r}: {linear} {}", loaded[r]);
        (0..n).for_each(|c| assert_eq!(e.g[c * n + r], e.g[r * n + c]));
    }
    assert_eq!(fixture.advance(&ports, &vec![0.0; n]).unwrap(), free);
    assert_eq!(fixture.states(), before);
}
