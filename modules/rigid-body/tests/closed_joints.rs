//! Joints of trees are closed at the end of every step of first order, whether the last correction was measured or, being
//! small, known to suffice.
#![allow(clippy::unwrap_used, missing_docs)]

mod common;
use common::Rig;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Largest gap of the joints of a chain of eight links of 0.25 m over so many steps, m.
fn largest(file: &str, joints: &str, h: f64, steps: usize) -> f64 {
    let parameters = format!(
        r#"{{"model": "tests/reference/multibody/{file}.urdf", "motor": "off", "joints": {joints}}}"#
    );
    let mut rig = Rig::new(&parameters, 9.81, h);
    let mut worst = 0.0_f64;
    for _ in 0..steps {
        rig.free_step();
        let mut end = Vector3::zeros();
        for state in rig.states() {
            let [w, x, y, z] = state.world_from_body.orientation;
            let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            let p = Vector3::from(state.world_from_body.position);
            worst = worst.max((p - end).norm());
            end = p + q * Vector3::new(0.25, 0.0, 0.0);
        }
    }
    worst
}

#[test]
fn slow_and_fast_chains_stay_closed() {
    let slow = r#"{"j1": 1.5607963267948966}"#;
    let fast = r#"{"j2": 0.2, "j4": 0.2, "j6": 0.2, "j8": 0.2}"#;
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
