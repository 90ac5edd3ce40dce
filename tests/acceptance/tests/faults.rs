//! The paper's three faults: what a fault does is far more than what the step length does, it takes effect in the
//! next step and it injects no energy.

use terraglue::Testbed;
use terraglue_acceptance::{build, shipped};

const FAULT_AT: f64 = 3.0;
const DURATION: f64 = 10.0;

struct Walk {
    testbed: Testbed,
    /// x and y, m, and heading, rad, of the body every 10 ms.
    track: Vec<[f64; 3]>,
    /// Angle of LF_j3 after the fault's step, rad.
    knee_rad: f64,
    lowest_body_m: f64,
    /// |ΔE| of the fault's step over the median of the 100 steps before.
    energy_jump: f64,
    /// |torque| of the joints LF_j2 and LF_j3 after the fault's step, N m.
    torques_after: [f64; 2],
}

fn read(testbed: &Testbed, name: &str) -> f64 {
    testbed.read(name).unwrap_or_else(|| panic!("no variable {name}"))
}

fn walk(name: &str, sets: &[(&str, &str)]) -> Walk {
    let mut testbed = build(&shipped(name, sets)).unwrap_or_else(|e| panic!("{e}"));
    let (mut before, mut after) = (Vec::new(), None);
    let (mut track, mut knee_rad) = (Vec::new(), f64::NAN);
    let steps_per_sample =
        (0.01 / if sets.iter().any(|s| s.0 == "time.step_s") { 5e-4 } else { 1e-3 }) as u64;
    let (mut lowest, mut torques_after) = (f64::INFINITY, [f64::NAN; 2]);
    let mut last = testbed.energy().mechanical();
    while DURATION - testbed.t_s() > 1e-6 {
        testbed.step().unwrap_or_else(|e| panic!("{name}: {e}"));
        let energy = testbed.energy().mechanical();
        let change = (energy - last).abs();
        last = energy;
        let t = testbed.t_s();
        if t > FAULT_AT - 0.1 && t < FAULT_AT + 1e-9 {
            before.push(change);
        } else if t > FAULT_AT && after.is_none() {
            after = Some(change);
            knee_rad = read(&testbed, "robot.LF_j3.angle");
            torques_after = ["LF_j2", "LF_j3"].map(|j| read(&testbed, &format!("robot.{j}.torque")).abs());
        }
        lowest = f64::min(lowest, read(&testbed, "robot.body.z"));
        if testbed.step_index().is_multiple_of(steps_per_sample) {
            track.push(["x", "y", "yaw"].map(|c| read(&testbed, &format!("robot.body.{c}"))));
        }
    }
    before.sort_by(f64::total_cmp);
    let energy_jump = after.unwrap_or(f64::NAN) / before[before.len() / 2];
    Walk { testbed, track, knee_rad, lowest_body_m: lowest, energy_jump, torques_after }
}

/// Largest distance of the two paths (m) and of the two headings (rad) over the run.
fn path_and_heading(a: &Walk, b: &Walk) -> (f64, f64) {
    assert_eq!(a.track.len(), b.track.len());
    a.track.iter().zip(&b.track).fold((0.0, 0.0), |(path, heading): (f64, f64), (p, q)| {
        let [dx, dy, turn] = std::array::from_fn(|k| p[k] - q[k]);
        (path.max((dx * dx + dy * dy).sqrt()), heading.max(turn.abs()))
    })
}

#[test]
fn each_fault_shows_ten_times_more_than_the_step_length_and_injects_no_energy() {
    let sound = walk("leg_faults_torque", &[("event", "[]")]);
    let half = walk("leg_faults_torque", &[("event", "[]"), ("time.step_s", "0.0005")]);
    let (path_h, heading_h) = path_and_heading(&half, &sound);
    println!("halving h: path {:.2} mm, heading {:.3} mrad", path_h * 1e3, heading_h * 1e3);
    let walks = ["torque", "loss", "block"].map(|fault| {
        let walk = walk(&format!("leg_faults_{fault}"), &[]);
        let (path, heading) = path_and_heading(&walk, &sound);
        println!(
            "{fault}: path {:.1} mm, heading {:.2} mrad, energy jump {:.2}, lowest body {:.3} m",
            path * 1e3,
            heading * 1e3,
            walk.energy_jump,
            walk.lowest_body_m
        );
        assert!(path > 10.0 * path_h, "{fault}: path {path} m against {path_h} m by halving h");
        assert!(
            heading > 10.0 * heading_h,
            "{fault}: heading {heading} rad against {heading_h} by halving h"
        );
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
