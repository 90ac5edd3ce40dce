//! The paper's three faults: what a fault does is far more than what the step length does, and it injects no energy.

use terraglue::Testbed;
use terraglue_acceptance::{build, shipped};

const FAULT_AT: f64 = 3.0;

struct Walk {
    /// x, y, heading at the end.
    pose: [f64; 3],
    lowest_body_m: f64,
    /// |ΔE| of the fault's step over the median of the 100 steps before.
    energy_jump: f64,
}

fn balance(testbed: &Testbed) -> f64 {
    testbed.energy().mechanical()
}

fn walk(name: &str, duration_s: f64, sets: &[(&str, &str)]) -> (Walk, Testbed) {
    let scenario = shipped(name, sets);
    let mut testbed = build(&scenario).unwrap_or_else(|e| panic!("{e}"));
    let mut before = Vec::new();
    let (mut last, mut jump, mut lowest) = (balance(&testbed), 0.0, f64::INFINITY);
    while duration_s - testbed.t_s() > 1e-6 {
        testbed.step().unwrap_or_else(|e| panic!("{name}: {e}"));
        let energy = balance(&testbed);
        let change = (energy - last).abs();
        last = energy;
        let t = testbed.t_s();
        if (FAULT_AT - 0.1..FAULT_AT + 1e-9).contains(&t) {
            before.push(change);
        } else if jump == 0.0 && t > FAULT_AT {
            jump = change;
        }
        lowest = f64::min(lowest, testbed.read("robot.body.z").expect("height"));
    }
    before.sort_by(f64::total_cmp);
    let pose = ["x", "y", "yaw"].map(|c| testbed.read(&format!("robot.body.{c}")).expect("pose"));
    let walk = Walk { pose, lowest_body_m: lowest, energy_jump: jump / before[before.len() / 2] };
    (walk, testbed)
}

fn distance(a: &Walk, b: &Walk) -> f64 {
    let squares: f64 = a.pose.iter().zip(b.pose).map(|(a, b)| (a - b) * (a - b)).sum();
    squares.sqrt()
}

fn check(name: &str) -> Testbed {
    let duration = 10.0;
    let (fault, testbed) = walk(name, duration, &[]);
    let (sound, _) = walk(name, duration, &[("event", "[]")]);
    let (half, _) = walk(name, duration, &[("event", "[]"), ("time.step_s", "0.0005")]);
    let (effect, numerics) = (distance(&fault, &sound), distance(&half, &sound));
    println!(
        "{name}: {:?} against {:?}, effect {effect:.4}, halving h {numerics:.5}, energy jump {:.2}, lowest {:.3} m",
        fault.pose, sound.pose, fault.energy_jump, fault.lowest_body_m
    );
    assert!(effect > 10.0 * numerics, "{name}: the fault moves {effect}, halving h {numerics}");
    assert!(fault.energy_jump <= 3.0, "{name}: energy jump {}", fault.energy_jump);
    testbed
}

#[test]
fn lost_torque_is_exactly_zero_from_the_next_step_on() {
    let testbed = check("leg_faults_torque");
    for joint in ["LF_j2", "LF_j3"] {
        assert_eq!(testbed.read(&format!("robot.{joint}.torque")), Some(0.0));
    }
    let mut testbed = build(&shipped("leg_faults_torque", &[])).unwrap_or_else(|e| panic!("{e}"));
    while testbed.t_s() < FAULT_AT + 0.5e-3 {
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
    }
    assert_eq!(testbed.read("robot.LF_j2.torque"), Some(0.0));
}

#[test]
fn the_body_stays_up_after_the_loss_of_a_leg() {
    let testbed = check("leg_faults_loss");
    assert!(testbed.read("robot.body.z").expect("height") > 0.2);
}

#[test]
fn a_blocked_joint_keeps_its_angle() {
    let testbed = check("leg_faults_block");
    assert!(testbed.read("robot.LF_j3.velocity").expect("velocity").abs() < 1e-9);
}
