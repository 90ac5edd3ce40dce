//! Reactions of joints, against closed forms of statics.

use crate::common;
use common::{Fixture, STAND};
use terraglue_numerics::extremes::larger;

const G: f64 = 9.81;
const CHAIN: &str = "tests/reference/multibody/chain8_planar.urdf";
const SCHEMES: [&str; 3] = ["symplectic-euler", "generalized-alpha", "energy-momentum"];

fn reaction(fixture: &Fixture, joint: &str) -> [f64; 6] {
    ["x", "y", "z", "mx", "my", "mz"].map(|c| fixture.get(&format!("{joint}.reaction_{c}")))
}

fn near(found: [f64; 6], expected: [f64; 6], within: f64, what: &str) {
    let off = found.iter().zip(expected).fold(0.0_f64, |m, (a, b)| larger(m, (a - b).abs()));
    assert!(off <= within, "{what}: {found:?} is not {expected:?}");
}

#[test]
fn a_hanging_chain_carries_the_weight_below_each_joint() {
    for scheme in SCHEMES {
        let down = -std::f64::consts::FRAC_PI_2;
        let text = format!(
            r#"{{"model": "{CHAIN}", "motor": "off", "integrator": "{scheme}", "joints": {{"j1": {down}}}}}"#
        );
        let mut fixture = Fixture::new(&text, G, 1e-3);
        (0..20).for_each(|_| fixture.free_step());
        for k in 1..=8 {
            let weight = f64::from(9 - k) * G;
            near(reaction(&fixture, &format!("j{k}")), [0.0, 0.0, weight, 0.0, 0.0, 0.0], 1e-6, scheme);
        }
    }
}

#[test]
fn a_beam_of_held_joints_carries_moments() {
    for scheme in SCHEMES {
        let text = format!(
            r#"{{"model": "{CHAIN}", "motor": "velocity", "max_torque": 1e6, "integrator": "{scheme}"}}"#
        );
        let mut fixture = Fixture::new(&text, G, 1e-3);
        (0..20).for_each(|_| fixture.free_step());
        for k in 1..=8 {
            // Links of 1 kg and 0.25 m stick out along x beyond joint k.
            let links = f64::from(9 - k);
            let moment = links * G * 0.125 * links;
            let joint = format!("j{k}");
            near(reaction(&fixture, &joint), [0.0, 0.0, links * G, 0.0, -moment, 0.0], 1e-6, scheme);
            assert!((fixture.get(&format!("{joint}.torque")) - moment).abs() < 1e-6, "{scheme} {joint}");
        }
    }
}

#[test]
fn legs_of_a_standing_hexapod_carry_the_trunk_and_a_broken_joint_nothing() {
    let text = format!(
        r#"{{"model": "models/hexapod.urdf", "position_m": [0, 0, 0.33], {STAND}, "ground": "half-space"}}"#
    );
    let mut fixture = Fixture::new(&text, G, 1e-3);
    (0..3000).for_each(|_| fixture.free_step());
    let trunk = fixture.scene.bodies.iter().find(|b| b.name == "body").unwrap().mass * G;
    let legs = ["LF", "LM", "LR", "RF", "RM", "RR"];
    let carried: f64 = legs.iter().map(|leg| fixture.get(&format!("{leg}_j1.reaction_z"))).sum();
    assert!((carried + trunk).abs() < 1e-4 * trunk, "{carried} {trunk}");
    let normal: f64 = legs.iter().map(|leg| fixture.get(&format!("{leg}4.contact_normal"))).sum();
    assert!((normal - fixture.mass() * G).abs() < 1e-4 * trunk, "{normal}");
    fixture.robot.act("LF_j1.break", "{}").unwrap();
    fixture.free_step();
    assert_eq!(reaction(&fixture, "LF_j1"), [0.0; 6]);
}
