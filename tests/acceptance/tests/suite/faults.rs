//! The paper's three faults: each takes effect in the next step and injects no energy. That it shows against the length of the
//! step is held by `tests/python/test_faults.py`.

use terraglue::Testbed;
use terraglue::scenario::{Scenario, Trigger};
use terraglue_acceptance::{build, read, shipped};

const DURATION: f64 = 5.0;

struct Walk {
    testbed: Testbed,
    /// Angle of LF_j3 after the fault's step, rad.
    knee_rad: f64,
    lowest_body_m: f64,
    /// |ΔE| of the fault's step over the median of the 100 steps before.
    energy_jump: f64,
    /// |torque| of the joints LF_j2 and LF_j3 after the fault's step, N m.
    torques_after: [f64; 2],
}

/// Time of the only event, s.
fn fault_at(scenario: &Scenario) -> f64 {
    match scenario.events.as_slice() {
        [event] => match event.trigger {
            Trigger::At(t) => t,
            _ => panic!("the fault has a time"),
        },
        events => panic!("{} events", events.len()),
    }
}

fn walk(name: &str) -> Walk {
    let scenario = shipped(name, &[]);
    let fault_at = fault_at(&scenario);
    let mut testbed = build(&scenario).unwrap_or_else(|e| panic!("{e}"));
    let (mut before, mut after, mut knee_rad) = (Vec::new(), None, f64::NAN);
    let (mut lowest, mut torques_after) = (f64::INFINITY, [f64::NAN; 2]);
    let mut last = testbed.energy().mechanical();
    while DURATION - testbed.t_s() > 1e-6 {
        testbed.step().unwrap_or_else(|e| panic!("{name}: {e}"));
        let energy = testbed.energy().mechanical();
        let change = (energy - last).abs();
        last = energy;
        let t = testbed.t_s();
        if t > fault_at - 0.1 && t < fault_at + 1e-9 {
            before.push(change);
        } else if t > fault_at && after.is_none() {
            after = Some(change);
            knee_rad = read(&testbed, "robot.LF_j3.angle");
            torques_after = ["LF_j2", "LF_j3"].map(|j| read(&testbed, &format!("robot.{j}.torque")).abs());
        }
        lowest = f64::min(lowest, read(&testbed, "robot.body.z"));
    }
    before.sort_by(f64::total_cmp);
    let energy_jump = after.unwrap_or(f64::NAN) / before[before.len() / 2];
    Walk { testbed, knee_rad, lowest_body_m: lowest, energy_jump, torques_after }
}

#[test]
fn faults_take_effect_in_the_next_step_and_inject_no_energy() {
    let walks = ["torque", "loss", "block"].map(|fault| {
        let walk = walk(&format!("leg_faults_{fault}"));
        println!("{fault}: energy jump {:.2}, lowest body {:.3} m", walk.energy_jump, walk.lowest_body_m);
        assert!(walk.energy_jump <= 3.0, "{fault}: energy jump {}", walk.energy_jump);
        walk
    });
    let [torque, loss, block] = walks;
    assert_eq!(torque.torques_after, [0.0; 2], "a lost torque is exactly zero from the next step on");
    assert!(loss.lowest_body_m > 0.2, "the body stays up: {}", loss.lowest_body_m);
    assert_eq!(loss.testbed.read("robot.LF_j2.broken"), Some(1.0));
    let moved = read(&block.testbed, "robot.LF_j3.angle") - block.knee_rad;
    assert!(moved.abs() < 1e-9, "a blocked joint keeps its angle: {moved} rad");
}
