//! Every fault of a joint by every way: an event of the scenario, the command line, a connected subsystem. Each takes effect in
//! the step after it.

use terraglue::scenario::Scenario;
use terraglue::{Error, Testbed};
use terraglue_acceptance::{ROOT, build, read, steps};

/// Steps before the fault.
const BEFORE: usize = 20;

/// A double pendulum whose motors lift it; `operator` is another one, whose variables stand for commands.
const SCENARIO: &str = r#"
[time]
step_s = 0.001
duration_s = 0.1
[gluing]
strategy = "cooperative"
[operator]
module = "rigid-body"
model = "../tests/models/double_pendulum.urdf"
motor = "position"
max_torque = 60.0
[robot]
module = "rigid-body"
model = "../tests/models/double_pendulum.urdf"
motor = "position"
max_torque = 60.0
"#;

/// Start towards a raised pose.
const LIFT: &str = "{ at_s = 0.0, set = { \"robot.JOINT.angle_target\" = 0.5 } }";

/// How a fault comes to the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    TimeLine,
    CommandLine,
    Connection,
}

/// A testbed in which `value` is given to a variable of the joint at the fault's time.
fn run(way: Way, joint: &str, sets: &[(&str, &str)]) -> Result<Testbed, Error> {
    let target = if way == Way::Connection { "operator" } else { "robot" };
    let set = |(what, value): &(&str, &str)| format!("\"{target}.{joint}.{what}\" = {value}");
    let all: Vec<String> = sets.iter().map(set).collect();
    let at = BEFORE as f64 * 1e-3;
    let fault = format!("{{ at_s = {at}, set = {{ {} }} }}", all.join(", "));
    let events = format!("[{}, {fault}]", LIFT.replace("JOINT", joint));
    let mut text = SCENARIO.to_owned();
    if way == Way::Connection {
        for (what, _) in sets {
            let name = format!("{joint}.{what}");
            text += &format!("[[connect]]\nfrom = \"operator.{name}\"\nto = \"robot.{name}\"\n");
        }
    }
    let mut edits = Vec::new();
    match way {
        Way::CommandLine => edits.push(("event".to_owned(), events)),
        _ => text = format!("event = {events}\n{text}"),
    }
    build(&Scenario::parse(&text, &format!("{ROOT}/scenarios/test.toml"), &edits)?)
}

/// Runs up to the fault and one step beyond it; the angle before that step.
fn through_the_fault(way: Way, sets: &[(&str, &str)]) -> (Testbed, f64) {
    let mut testbed = run(way, "shoulder", sets).unwrap_or_else(|e| panic!("{way:?}: {e}"));
    steps(&mut testbed, BEFORE);
    let angle = read(&testbed, "robot.shoulder.angle");
    assert!(read(&testbed, "robot.shoulder.torque").abs() > 10.0, "the motor works before the fault");
    assert!(read(&testbed, "robot.shoulder.velocity").abs() > 0.1, "the joint moves before the fault");
    steps(&mut testbed, 1);
    (testbed, angle)
}

#[test]
fn every_fault_of_a_joint_takes_effect_in_the_next_step_by_every_way() {
    for way in [Way::TimeLine, Way::CommandLine, Way::Connection] {
        let torque = |t: &Testbed| read(t, "robot.shoulder.torque").abs();
        let (lost, _) = through_the_fault(way, &[("max_torque", "0.0")]);
        assert_eq!(torque(&lost), 0.0, "{way:?}");
        let (weak, _) = through_the_fault(way, &[("max_torque", "1.5")]);
        assert_eq!(torque(&weak), 1.5, "{way:?}");
        let (mut blocked, held) = through_the_fault(way, &[("blocked", "true")]);
        steps(&mut blocked, 50);
        assert!((read(&blocked, "robot.shoulder.angle") - held).abs() < 1e-9, "{way:?}");
        // The brake slips, with its torque.
        let partly = [("blocked", "true"), ("block_torque", "0.5"), ("max_torque", "0.0")];
        let (slips, held) = through_the_fault(way, &partly);
        assert!((read(&slips, "robot.shoulder.stop_torque").abs() - 0.5).abs() < 1e-9, "{way:?}");
        assert!((read(&slips, "robot.shoulder.angle") - held).abs() > 1e-5, "{way:?}");
        let (mut broken, _) = through_the_fault(way, &[("broken", "true")]);
        assert_eq!((torque(&broken), read(&broken, "robot.shoulder.reaction_z")), (0.0, 0.0), "{way:?}");
        let [height, sinks] = ["z", "vz"].map(|v| read(&broken, &format!("robot.upper.{v}")));
        steps(&mut broken, 50);
        assert!(read(&broken, "robot.upper.vz") < sinks - 0.3 && height.is_finite(), "{way:?}: it falls");
    }
}
