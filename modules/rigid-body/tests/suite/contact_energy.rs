//! Losses in impacts and friction are booked: mechanical energy and losses add up to the initial energy.

use crate::common;
use common::{Fixture, temporary_urdf};
use terraglue_numerics::extremes::larger;

const SPHERE: &str = r#"<robot name="r"><link name="s"><inertial><mass value="2"/>
    <inertia ixx="0.008" iyy="0.008" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"#;

/// Largest deviation of the sum over a run of a thrown sphere, J, and the energy lost.
fn balance(restitution: f64) -> (f64, f64) {
    let model = temporary_urdf(&format!("energy{restitution}"), SPHERE);
    let parameters = format!(
        r#"{{"model": "{model}", "position_m": [0, 0, 0.3], "ground": "half-space", "friction": 0.3,
        "restitution": {restitution}}}"#
    );
    let mut fixture = Fixture::new(&parameters, 9.81, 1e-3);
    fixture.push("s", [4.0 / fixture.h, 0.0, 0.0]);
    fixture.free_step();
    fixture.push("s", [0.0; 3]);
    let sum = |fixture: &Fixture| {
        let e = fixture.robot.energy();
        e.mechanical() + e.dissipated
    };
    let start = sum(&fixture);
    let mut worst = 0.0_f64;
    for _ in 0..1500 {
        fixture.free_step();
        worst = larger(worst, (sum(&fixture) - start).abs());
    }
    (worst, fixture.get("contact.lost"))
}

#[test]
fn a_thrown_sphere_loses_what_is_booked() {
    // 2 kg at 2 m/s from 0.2 m: 2/7 of ½·m·v² go into sliding, m·g·h into the impact.
    let (worst, lost) = balance(0.0);
    assert!(worst < 1e-9, "{worst:e}");
    let expected = 2.0 * 9.81 * 0.2 + 2.0 / 7.0 * 4.0;
    assert!((lost / expected - 1.0).abs() < 2e-2, "{lost} {expected}");
}

#[test]
fn a_rebounding_sphere_loses_what_is_booked() {
    let (worst, lost) = balance(0.7);
    assert!(worst < 1e-9 && lost > 1.0, "{worst:e} {lost}");
}
