//! Arrays of a module: their elements are connected, changed by events and faults, compared in conditions and recorded.

use terraglue::{Error, Testbed};
use terraglue_acceptance::{build, read, scenario, steps};

/// Joint whose angle is connected.
const JOINT: &str = "shoulder";

/// A double pendulum with motors, and two times two feet that follow given positions.
const SCENARIO: &str = r#"
[time]
step_s = 0.001
duration_s = 0.1
[gluing]
strategy = "cooperative"
[robot]
module = "rigid-body"
model = "../tests/models/double_pendulum.urdf"
motor = "position"
max_torque = 60.0
[feet]
module = "feet"
count = 2
position_m = [0.0, 0.0, 1.0, 0.0, 1.0, 1.0]
[others]
module = "feet"
count = 2
"#;

fn run(rest: &str, count: usize) -> Result<Testbed, Error> {
    let mut testbed = build(&scenario(&format!("{SCENARIO}{rest}")))?;
    steps(&mut testbed, count);
    Ok(testbed)
}

#[test]
fn an_element_is_connected_and_the_others_stay() {
    let rest = r#"
[[event]]
at_s = 0.0
set = { "robot.JOINT.angle_target" = 0.5 }
[[connect]]
from = "robot.JOINT.angle"
to = "feet.position[2,3]"
factor = 0.1
offset = 1.0
convert = false
"#;
    let rest = rest.replace("JOINT", JOINT);
    let [connected, before] = [50, 49].map(|count| run(&rest, count).expect("runs"));
    let angle = read(&before, &format!("robot.{JOINT}.angle"));
    assert!(angle.abs() > 1e-3, "it moves: {angle}");
    assert_eq!(read(&connected, "feet.position[2,3]"), 0.1 * angle + 1.0);
    for (name, value) in [("[1,3]", 1.0), ("[2,1]", 0.0), ("[2,2]", 1.0)] {
        assert_eq!(read(&connected, &format!("feet.position{name}")), value);
    }
}

#[test]
fn whole_arrays_are_connected_by_their_names() {
    let rest = r#"
event = [{ at_s = 0.01, set = { "feet.orientation[1,2]" = 1.0 } }]
[[connect]]
from = "feet.force"
to = "others.position"
factor = 1.0
offset = 5.0
convert = false
"#;
    let testbed = run_with_events(rest, 20);
    for row in 1..=2 {
        for column in 1..=3 {
            assert_eq!(read(&testbed, &format!("others.position[{row},{column}]")), 5.0);
        }
    }
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let turned = read(&testbed, "feet.orientation[1,2]");
    assert!((turned - half).abs() < 1e-12, "a quaternion keeps its length: {turned}");
    assert_eq!(read(&testbed, "feet.orientation[2,1]"), 1.0);
}

/// `event` stand before the first table.
fn run_with_events(rest: &str, count: usize) -> Testbed {
    let (events, tables) = rest.trim_start().split_once('\n').expect("two parts");
    let mut testbed = build(&scenario(&format!("{events}\n{SCENARIO}{tables}"))).expect("builds");
    steps(&mut testbed, count);
    testbed
}

#[test]
fn a_fault_and_a_condition_see_one_element() {
    let events = r#"event = [{ when = "feet.position[1,1] > 0.5", set = { "feet.position[2,2]" = 7.0 } }]"#;
    let tables = r#"
[[fault]]
variable = "feet.position[1,1]"
kind = "offset"
value = 2.0
at_s = 0.005
"#;
    let testbed = run_with_events(&format!("{events}\n{tables}"), 20);
    assert_eq!(read(&testbed, "feet.position[1,1]"), 2.0);
    assert_eq!(read(&testbed, "feet.position[2,2]"), 7.0);
}

#[test]
fn arrays_of_other_shapes_and_elements_that_are_not_there_are_refused() {
    for (to, says) in [
        ("others.orientation", "shape [2,3], `others.orientation` has [2,4]"),
        ("others.duration", "is no array"),
        ("others.position[3,1]", "does not exist"),
    ] {
        let from = if to.ends_with(']') { "feet.force[1,1]" } else { "feet.force" };
        let rest = format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\nconvert = false\n");
        let why = run(&rest, 0).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(why.contains(says), "{to}: {why}");
    }
}
