//! MJCF in several files, general actuators, several joints on a body.

use std::path::PathBuf;
use terraglue_robot_import::{DriveKind, JointKind, Options, Robot, read_mjcf_text, read_robot};

/// Writes the files of a test and reads the first.
fn read_files(test: &str, files: &[(&str, &str)]) -> Result<Robot, String> {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("mjcf-parts-{test}"));
    std::fs::create_dir_all(&folder).unwrap();
    for (name, text) in files {
        std::fs::create_dir_all(folder.join(name).parent().unwrap()).unwrap();
        std::fs::write(folder.join(name), text).unwrap();
    }
    read_robot(&folder.join(files[0].0), &Options::default()).map_err(|e| e.to_string())
}

fn read(worldbody: &str, more: &str) -> Robot {
    let text = format!("<mujoco>{more}<worldbody>{worldbody}</worldbody></mujoco>");
    read_mjcf_text("m.xml", &text, &Options::default()).unwrap()
}

const MAIN: &str = r#"<mujoco>
  <compiler angle="radian"/>
  <include file="parts/classes.xml"/>
  <worldbody>
    <body name="a"><joint name="j" class="hip"/><geom size="0.1"/>
      <include file="parts/foot.xml"/>
    </body>
  </worldbody>
</mujoco>"#;
const CLASSES: &str = r#"<mujocoinclude>
  <default><geom density="500"/><default class="hip"><joint axis="0 1 0" range="-1 1" damping="0.2"/></default></default>
  <compiler autolimits="false"/>
</mujocoinclude>"#;
const FOOT: &str = r#"<mujocoinclude>

  <body name="foot" pos="0 0 -1"><joint name="k" ref="0.5"/><geom size="0.1" mass="2"/></body>
</mujocoinclude>"#;

#[test]
fn included_files_stand_where_they_are_named() {
    let files = [("main.xml", MAIN), ("parts/classes.xml", CLASSES), ("parts/foot.xml", FOOT)];
    let robot = read_files("good", &files).unwrap();
    let names: Vec<_> = robot.bodies.iter().map(|b| b.name.as_str()).collect();
    assert_eq!(names, ["a", "foot"]);
    let hip = &robot.joints[0];
    assert_eq!((hip.axis.y, hip.data.damping, robot.joints[1].parent), (1.0, 0.2, Some(0)));
    // autolimits = "false" of the included file: the range alone limits nothing.
    assert_eq!(hip.limits, None);
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    assert!((robot.bodies[0].mass - 500.0 * ball).abs() < 1e-9);
    // Messages name the included file.
    let text = robot.warnings.join("\n");
    assert!(text.contains("parts/foot.xml:3: <joint> `k` has `ref`"), "{text}");
}

#[test]
fn what_is_wrong_with_an_included_file_is_named_there() {
    let refused = |test: &str, main: &str, foot: &str, expected: &[&str]| {
        let files = [("main.xml", main), ("parts/classes.xml", CLASSES), ("parts/foot.xml", foot)];
        let message = read_files(test, &files).unwrap_err();
        expected.iter().for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
    };
    let bad = FOOT.replace("mass=\"2\"", "mass=\"nan\"");
    refused("nan", MAIN, &bad, &["parts/foot.xml:3: geom", "mass", "finite"]);
    refused("syntax", MAIN, "<mujocoinclude><body></mujocoinclude>", &["parts/foot.xml:1", "cannot be read"]);
    refused("root", MAIN, "<robot/>", &["main.xml:6: include", "neither <mujoco>"]);
    let gone = MAIN.replace("foot.xml", "hand.xml");
    refused("gone", &gone, FOOT, &["main.xml:6: include", "hand.xml cannot be read"]);
    let twice = MAIN.replace("parts/foot.xml", "parts/classes.xml");
    refused("twice", &twice, FOOT, &["main.xml:6: include", "included twice"]);
    let ring = FOOT.replace("<geom", "<include file=\"parts/foot.xml\"/><geom");
    refused("ring", MAIN, &ring, &["parts/foot.xml:3: include", "included twice"]);
}

const ARM: &str = r#"<body name="a"><joint name="j"/><geom size="0.1" mass="1"/></body>"#;

#[test]
fn general_actuators_are_motors_or_servos() {
    let drive = |actuator: &str| {
        let robot = read(ARM, &format!("<actuator>{actuator}</actuator>"));
        (robot.joints[0].data.drive, robot.warnings.join("\n"))
    };
    let (motor, said) = drive(r#"<general joint="j" gear="10" gainprm="2" ctrlrange="-3 3"/>"#);
    let motor = motor.unwrap();
    assert_eq!((motor.kind, motor.max_torque), (DriveKind::Torque, Some(60.0)));
    assert!(said.is_empty(), "{said}");
    let servo = r#"<general joint="j" gear="2" biastype="affine" gainprm="50" biasprm="0 -50 -3" forcerange="-7 7"/>"#;
    let servo = drive(servo).0.unwrap();
    assert_eq!((servo.kind, servo.stiffness, servo.damping), (DriveKind::Position, 200.0, 12.0));
    assert_eq!(servo.max_torque, Some(14.0));
    let rate = drive(r#"<general joint="j" biastype="affine" gainprm="5" biasprm="0 0 -5"/>"#).0.unwrap();
    assert_eq!(rate.kind, DriveKind::Velocity);
    for (actuator, expected) in [
        (
            r#"<general joint="j" biastype="affine" gainprm="5" biasprm="1 -5 0"/>"#,
            "neither a motor nor a servo",
        ),
        (
            r#"<general joint="j" biastype="affine" gainprm="5" biasprm="0 -4 0"/>"#,
            "neither a motor nor a servo",
        ),
        (r#"<general joint="j" dyntype="filter"/>"#, "dyntype = \"filter\""),
        (r#"<general joint="j" gaintype="muscle"/>"#, "gaintype = \"muscle\""),
        (r#"<general joint="j" biastype="muscle"/>"#, "biastype = \"muscle\""),
        (r#"<general joint="j" actlimited="true"/>"#, "has `actlimited`"),
    ] {
        let (_, said) = drive(actuator);
        assert!(said.contains("m.xml:1: <general>") && said.contains(expected), "{said}");
    }
}

#[test]
fn shortcuts_take_the_defaults_of_general_actuators() {
    let robot = read(
        ARM,
        r#"<default><general forcerange="-4 4" gear="2"/></default><actuator><motor joint="j"/></actuator>"#,
    );
    assert_eq!(robot.joints[0].data.drive.unwrap().max_torque, Some(8.0));
}

#[test]
fn several_joints_become_a_chain() {
    let robot = read(
        r#"<body name="p"><freejoint/><geom size="0.1" mass="1"/>
             <body name="a" pos="0 0 1"><joint name="x" type="slide" axis="1 0 0" range="-2 2"/>
               <joint axis="0 1 0" pos="0 0 0.1" damping="0.5"/><joint name="z" axis="0 0 1"/>
               <geom size="0.1" mass="2" pos="0.1 0 0"/></body></body>"#,
        r#"<actuator><motor joint="x"/></actuator>"#,
    );
    let names: Vec<_> = robot.bodies.iter().map(|b| b.name.as_str()).collect();
    assert_eq!(names, ["p", "a_1", "a_2", "a"]);
    let parents: Vec<_> = robot.joints.iter().map(|j| (j.name.as_str(), j.kind, j.parent, j.child)).collect();
    let (slide, turn) = (JointKind::Prismatic, JointKind::Revolute);
    assert_eq!(parents, [("x", slide, Some(0), 1), ("a_2_joint", turn, Some(1), 2), ("z", turn, Some(2), 3)]);
    assert_eq!(robot.joints[0].parent_from_joint.translation.z, 1.0);
    assert_eq!(robot.joints[1].parent_from_joint.translation.z, 0.1);
    assert_eq!((robot.joints[1].data.damping, robot.joints[0].limits), (0.5, Some([-2.0, 2.0])));
    assert!(robot.joints[0].data.drive.is_some());
    let mass: f64 = robot.bodies[1..].iter().map(|b| b.mass).sum();
    assert!((mass - 2.0).abs() < 1e-15 && (robot.bodies[1].mass - 2e-6).abs() < 1e-20);
    assert_eq!((robot.bodies[3].shapes.len(), robot.bodies[1].shapes.len()), (1, 0));
    // Bodies next to each other in the file never touch.
    assert_eq!(robot.excluded, [[0, 3]]);
    assert!(robot.notices[0].contains("m.xml:2: <body> `a` has 3 joints"), "{:?}", robot.notices);
}
