//! `time.settle_s`: the robot stands on its soil at t = 0, the gait has not moved, and all ledgers begin there.

use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue_acceptance::{ROOT, build, foot, read, scenario, shipped, steps};

const FEET: [&str; 6] = ["LF4", "LM4", "LR4", "RF4", "RM4", "RR4"];
const SOIL: &str = "[soil]\nmodule = \"soil-bekker\"\nparameters = \"lunar_nominal_Apollo\"";
/// Mass of the hexapod of `models/`, kg, times lunar gravity, N.
const WEIGHT: f64 = 25.02 * 1.62;

fn forces(testbed: &Testbed) -> f64 {
    FEET.iter().map(|f| read(testbed, &format!("robot.{f}.contact_normal"))).sum()
}

fn settled(strategy: &str) -> Testbed {
    let sets = [("gluing.strategy", strategy), ("soil.module", "soil-bekker")];
    let mut testbed = build(&shipped("moon_walk", &sets)).unwrap_or_else(|e| panic!("{e}"));
    testbed.begin().unwrap_or_else(|e| panic!("{e}"));
    testbed
}

#[test]
fn the_robot_stands_at_the_start() {
    for strategy in ["cooperative-compliant", "iterative"] {
        let testbed = settled(strategy);
        assert_eq!((testbed.t_s(), testbed.step_index()), (0.0, 0), "{strategy}");
        let sum = forces(&testbed);
        assert!((sum / WEIGHT - 1.0).abs() < 0.02, "{strategy}: {sum} N");
        let rate = read(&testbed, "robot.body.vz").abs();
        assert!(rate < 1e-3, "{strategy}: {rate} m/s");
        let pressed = FEET.iter().filter(|f| read(&testbed, &format!("robot.{f}.contact_normal")) > 0.0);
        assert!(pressed.count() >= 3, "{strategy}");
        assert!(read(&testbed, "soil.max_sinkage") > 1e-3, "{strategy}: the prints stay");
    }
}

#[test]
fn controllers_wait_and_books_begin_at_the_start() {
    let testbed = settled("iterative");
    let fresh = build(&shipped("moon_walk", &[])).unwrap_or_else(|e| panic!("{e}"));
    for joint in ["LF_j1", "LM_j2", "RR_j4"] {
        let name = format!("gait.{joint}.angle_target");
        assert_eq!(read(&testbed, &name), read(&fresh, &name));
        assert_eq!(read(&testbed, &format!("robot.{joint}.angle_target")), read(&testbed, &name));
    }
    let e = testbed.energy();
    assert_eq!([e.dissipated, e.port_work, e.actuator_work, e.electrical], [0.0; 4]);
    for name in ["energy.motor_work", "energy.electrical", "energy.dissipated", "energy.distance"] {
        assert_eq!(read(&testbed, &format!("robot.{name}")), 0.0, "{name}");
    }
    assert!(e.potential.is_finite() && e.kinetic < 1e-3);
}

#[test]
fn no_time_to_settle_changes_nothing() {
    let bits = |sets: &[(&str, &str)]| {
        let mut testbed = build(&scenario_of(sets)).unwrap_or_else(|e| panic!("{e}"));
        steps(&mut testbed, 200);
        (read(&testbed, "foot.ball.z").to_bits(), testbed.energy().dissipated.to_bits())
    };
    assert_eq!(bits(&[]), bits(&[("time.settle_s", "0.0")]));
    assert_ne!(bits(&[]), bits(&[("time.settle_s", "0.1")]));
}

fn scenario_of(sets: &[(&str, &str)]) -> Scenario {
    let sets: Vec<_> = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let path = format!("{ROOT}/scenarios/test.toml");
    Scenario::parse(&foot("iterative", SOIL), &path, &sets).unwrap_or_else(|e| panic!("{e}: {:?}", e.help))
}

#[test]
fn a_snapshot_before_the_start_settles_again() {
    let mut testbed = build(&scenario_of(&[("time.settle_s", "0.3")])).unwrap_or_else(|e| panic!("{e}"));
    let before = testbed.snapshot(0).unwrap_or_else(|e| panic!("{e}"));
    let mut after = || {
        steps(&mut testbed, 50);
        let seen = (read(&testbed, "foot.ball.z").to_bits(), testbed.energy().dissipated.to_bits());
        testbed.restore(&before).unwrap_or_else(|e| panic!("{e}"));
        seen
    };
    assert_eq!(after(), after());
}

#[test]
fn events_wait_for_the_start() {
    let text = foot("iterative", SOIL)
        + "[[event]]\nat_s = 0.0\nset = { \"foot.ball.force_z\" = -5.0 }\n"
        + "[[event]]\nat_s = 0.01\nset = { \"foot.ball.force_z\" = 0.0 }\n";
    let text = text.replace("duration_s = 4.0", "duration_s = 4.0\nsettle_s = 0.5");
    let mut testbed = build(&scenario(&text)).unwrap_or_else(|e| panic!("{e}"));
    testbed.begin().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(read(&testbed, "foot.ball.force_z"), 0.0);
    steps(&mut testbed, 5);
    assert_eq!(read(&testbed, "foot.ball.force_z"), -5.0);
    steps(&mut testbed, 10);
    assert_eq!(read(&testbed, "foot.ball.force_z"), 0.0);
}

#[test]
fn a_time_that_cannot_be_is_refused_with_key_and_value() {
    for (value, words) in [("-0.5", "`settle_s` = -0.5"), ("nan", "nan"), ("inf", "inf")] {
        let text = foot("iterative", SOIL)
            .replace("duration_s = 4.0", &format!("duration_s = 4.0\nsettle_s = {value}"));
        let path = format!("{ROOT}/scenarios/test.toml");
        let refused = Scenario::parse(&text, &path, &[]).err().map(|e| e.to_string());
        let told = refused.unwrap_or_default();
        assert!(told.contains("settle_s") && told.contains(words), "{value}: {told}");
    }
}
