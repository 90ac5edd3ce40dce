//! Joints of trees are closed at the end of every step of first order, whether the last correction was measured or, being
//! small, known to suffice.

use crate::common;
use common::Fixture;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use terraglue_numerics::extremes::larger;

const FAST: &str = r#"{"j2": 0.2, "j4": 0.2, "j6": 0.2, "j8": 0.2}"#;

fn chain(file: &str, joints: &str, h: f64) -> Fixture {
    let parameters = format!(
        r#"{{"model": "tests/reference/multibody/{file}.urdf", "motor": "off", "joints": {joints}}}"#
    );
    Fixture::new(&parameters, 9.81, h)
}

/// Largest gap of the joints of a chain of eight links of 0.25 m over so many steps, m.
fn largest(file: &str, joints: &str, h: f64, steps: usize) -> f64 {
    let mut fixture = chain(file, joints, h);
    let mut worst = 0.0_f64;
    for _ in 0..steps {
        fixture.free_step();
        let mut end = Vector3::zeros();
        for state in fixture.states() {
            let [w, x, y, z] = state.world_from_body.orientation;
            let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            let p = Vector3::from(state.world_from_body.position);
            worst = larger(worst, (p - end).norm());
            end = p + q * Vector3::new(0.25, 0.0, 0.0);
        }
    }
    worst
}

#[test]
fn slow_and_fast_chains_stay_closed() {
    let slow = r#"{"j1": 1.5607963267948966}"#;
    let fast = FAST;
    for (file, joints) in [("chain8", slow), ("chain8", fast), ("chain8_m1000", slow), ("chain8_m1000", fast)]
    {
        // 1000 kg on links of 1 kg want short steps; longer ones are refused.
        let longest = if file == "chain8" { 4e-3 } else { 1e-3 };
        for h in [1e-4, 1e-3, longest] {
            let gap = largest(file, joints, h, 500);
            println!("{file} {joints} {h}: {gap:e} m");
            assert!(gap < 2e-11, "{file} {joints} {h}: {gap:e} m");
        }
    }
}

/// 1000 kg that fall at the end of links of 1 kg jerk them with up to 1 MN; plain corrections diverge at 2.8 s.
#[test]
fn corrections_that_diverge_are_brought_back() {
    let gap = largest("chain8_m1000", FAST, 5e-4, 8_000);
    assert!(gap < 1e-8, "{gap:e} m");
}

/// Beyond the limit of stability there is no step; the message gives the link and a step that passes.
#[test]
fn a_step_that_cannot_follow_a_taut_chain_says_which_one_does() {
    let mut fixture = chain("chain8_m1000", FAST, 4e-3);
    let step = |fixture: &mut Fixture| fixture.advance(&[], &[]).map(|_| fixture.commit(&[], &[]).unwrap());
    let refusal = (0..500).find_map(|_| step(&mut fixture).err()).unwrap().to_string();
    println!("{} s: {refusal}", fixture.t);
    let said = refusal.split("take steps below ").nth(1).and_then(|s| s.split(' ').next()).unwrap();
    let shorter: f64 = said.parse().unwrap();
    assert!(refusal.contains("link `") && refusal.contains("energy-momentum"), "{refusal}");
    assert!((2e-4..4e-3).contains(&shorter), "{refusal}");
    fixture.h = shorter;
    let end = fixture.t + 0.04;
    while fixture.t < end {
        step(&mut fixture).unwrap();
    }
}
