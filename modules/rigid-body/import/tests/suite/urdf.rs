//! Good robot files come out as trees; bad ones are refused with place, value and way out.

use std::path::Path;
use terraglue_robot_import::{Base, JointKind, Options, Robot, ShapeGeometry, read_robot, read_urdf_text};

fn read(text: &str) -> Result<Robot, String> {
    read_urdf_text("robot.urdf", text, &Options::default()).map_err(|e| e.to_string())
}

fn body(name: &str, mass: f64, moments: [f64; 3]) -> String {
    let [x, y, z] = moments;
    format!(
        "<link name=\"{name}\"><inertial><mass value=\"{mass}\"/>\n<inertia ixx=\"{x}\" iyy=\"{y}\" izz=\"{z}\" \
         ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n"
    )
}

fn good(name: &str) -> String {
    body(name, 1.0, [0.1, 0.1, 0.1])
}

fn joint(name: &str, kind: &str, parent: &str, child: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
         <origin xyz=\"1 0 0\" rpy=\"0 0 0\"/><axis xyz=\"0 0 1\"/></joint>\n"
    )
}

fn robot(parts: &[String]) -> String {
    format!("<robot name=\"r\">\n{}</robot>", parts.concat())
}

fn refused(parts: &[String], expected: &[&str]) {
    let message = read(&robot(parts)).expect_err("a bad robot");
    assert!(message.starts_with("robot.urdf"), "{message}");
    expected.iter().for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
}

#[test]
fn the_hexapod_is_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../models/hexapod.urdf");
    let robot = read_robot(&path, &Options::default()).unwrap();
    assert_eq!((robot.bodies.len(), robot.joints.len()), (25, 24));
    let mass: f64 = robot.bodies.iter().map(|b| b.mass).sum();
    assert!((mass - 25.02).abs() < 1e-9);
    assert!(robot.joints.iter().all(|j| j.kind == JointKind::Revolute && j.limits.is_some()));
    assert!(robot.joints.iter().all(|j| j.parent.is_some_and(|p| p < j.child)));
    assert!(matches!(robot.base, Base::Free(_)));
    // A foot is seen and hit, its leg only seen.
    let foot = robot.bodies.iter().find(|b| b.name == "LF4").unwrap();
    let hit: Vec<bool> = foot.shapes.iter().map(|s| s.collides).collect();
    assert_eq!(hit, [true, false]);
    assert_eq!(foot.shapes[0].geometry, ShapeGeometry::Sphere { radius: 0.03 });
    assert_eq!(robot.bodies[0].shapes.len(), 1);
}

#[test]
fn a_chain_hangs_from_the_world() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/reference/multibody/chain8.urdf");
    let robot = read_robot(&path, &Options::default()).unwrap();
    assert_eq!((robot.bodies.len(), robot.joints.len(), robot.base), (8, 8, Base::World));
    assert_eq!(robot.joints[0].parent, None);
    assert_eq!(robot.joints[1].limits, None);
}

#[test]
fn devices_and_folders_are_no_robots() {
    for path in ["/dev/zero", "/tmp"] {
        let message = read_robot(Path::new(path), &Options::default()).unwrap_err().to_string();
        assert!(message.contains(path) && message.contains("regular file"), "{message}");
    }
}

#[test]
fn urdf_with_settings_for_mujoco_is_urdf() {
    let settings = "<mujoco><compiler discardvisual=\"false\"/></mujoco>\n";
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("with_settings.urdf");
    std::fs::write(&path, robot(&[settings.into(), good("a")])).unwrap();
    assert_eq!(read_robot(&path, &Options::default()).unwrap().bodies[0].name, "a");
}

#[test]
fn links_without_mass_are_merged() {
    let text = robot(&[
        "<link name=\"footprint\"/>".into(),
        good("base"),
        "<link name=\"camera\"><visual><geometry><box size=\"0.1 0.1 0.1\"/></geometry></visual></link>"
            .into(),
        joint("a", "fixed", "footprint", "base"),
        joint("b", "fixed", "base", "camera"),
    ]);
    let robot = read(&text).unwrap();
    assert_eq!((robot.bodies.len(), robot.joints.len()), (1, 0));
    let Base::Free(pose) = robot.base else { panic!("free") };
    assert_eq!(pose.translation.vector.x, 1.0);
    assert_eq!(robot.bodies[0].shapes[0].body_from_shape.translation.vector.x, 1.0);
}

#[test]
fn bodies_that_are_fixed_to_each_other_stay_two() {
    let robot = read(&robot(&[good("a"), good("b"), joint("weld", "fixed", "a", "b")])).unwrap();
    assert_eq!((robot.bodies.len(), robot.joints[0].kind), (2, JointKind::Fixed));
}

#[test]
fn signs_that_are_wrong_are_refused() {
    refused(
        &[body("a", 1.0, [0.1, 0.1, -0.1])],
        &["robot.urdf:2", "link `a`", "izz = -0.1 is negative", "sign"],
    );
    refused(&[body("a", -2.0, [0.1; 3])], &["link `a`", "mass -2 kg"]);
    refused(&[body("a", 0.0, [0.1; 3])], &["link `a`", "mass 0 kg"]);
}

#[test]
fn masses_far_apart_are_warned_of() {
    let pair = |light: f64| {
        let parts =
            [body("a", 1e3, [10.0; 3]), body("b", light, [light; 3]), joint("j", "continuous", "a", "b")];
        read(&robot(&parts)).unwrap().warnings
    };
    assert!(pair(1.1e-9).is_empty());
    let warnings = pair(0.9e-9);
    assert_eq!(warnings.len(), 1);
    for expected in ["robot.urdf", "`b` weighs 9e-10 kg", "`a` 1e3 kg", "1e12 apart"] {
        assert!(warnings[0].contains(expected), "{}", warnings[0]);
    }
}

#[test]
fn what_is_not_a_tree_is_refused() {
    let (ab, bc, ca) = (
        joint("ab", "continuous", "a", "b"),
        joint("bc", "continuous", "b", "c"),
        joint("ca", "continuous", "c", "a"),
    );
    let links = [good("a"), good("b"), good("c")].concat();
    refused(&[links.clone(), ab.clone(), bc.clone(), ca.clone()], &["loop"]);
    let second = joint("ac", "continuous", "a", "c");
    refused(
        &[links.clone(), ab.clone(), bc, second],
        &["joint `ac`", "`c`", "already hangs below joint `bc`", "loop"],
    );
    refused(&[links.clone(), ab.clone()], &["link `c`", "not connected"]);
    refused(
        &[links.clone(), joint("ab", "continuous", "a", "bb")],
        &["joint `ab`", "no link `bb`", "did you mean `b`"],
    );
    refused(&[links, good("a")], &["link `a`", "used twice"]);
    let island = [
        good("a"),
        good("b"),
        good("c"),
        joint("bc", "continuous", "b", "c"),
        joint("cb", "continuous", "c", "b"),
    ];
    refused(&island, &["link `b`", "loop"]);
}

#[test]
fn joints_and_shapes_that_make_no_sense_are_refused() {
    let two = [good("a"), good("b")].concat();
    refused(&[two.clone(), joint("j", "floating", "a", "b")], &["joint `j`", "Floating", "revolute"]);
    refused(
        &[two.clone(), joint("j", "bent", "a", "b")],
        &["robot.urdf:6", "<joint> `j`", "`bent` is unknown", "planar"],
    );
    let reversed = joint("j", "revolute", "a", "b")
        .replace("</joint>", "<limit lower=\"1\" upper=\"-1\" effort=\"1\" velocity=\"1\"/></joint>");
    refused(&[two.clone(), reversed], &["joint `j`", "1 … -1", "continuous"]);
    refused(&[two, joint("j", "continuous", "a", "b").replace("0 0 1", "0 0 0")], &["joint `j`", "axis"]);
    let ball = good("a")
        .replace("</link>", "<collision><geometry><sphere radius=\"-1\"/></geometry></collision></link>");
    refused(&[ball], &["link `a`", "-1 m"]);
    refused(&["<link name=\"a\"/>".into()], &["link `a`", "no mass"]);
    refused(
        &[good("a"), "<link name=\"b\"/>".into(), joint("j", "continuous", "a", "b")],
        &["link `b`", "no mass"],
    );
}

#[test]
fn errors_of_the_text_name_their_line() {
    let two = [good("a"), good("b")].concat();
    let changed =
        |from: &str, to: &str| [two.clone(), joint("j", "continuous", "a", "b").replacen(from, to, 1)];
    refused(&changed("1 0 0", "1 0"), &["robot.urdf:6", "<origin>", "xyz", "3 numbers"]);
    refused(&changed("0 0 1", "0 0 one"), &["robot.urdf:6", "<axis>", "one"]);
    refused(&changed("<parent link=\"a\"/>", ""), &["robot.urdf:6", "<joint> `j`", "<parent"]);
    refused(&changed("name=\"j\" ", ""), &["robot.urdf:6", "<joint>", "no `name`"]);
    refused(&changed("type=\"continuous\"", ""), &["robot.urdf:6", "no `type`"]);
    refused(&changed("</joint>", "</joined>"), &["robot.urdf:6", "joint"]);
    refused(
        &[good("a").replace("value=\"1\"", "value=\"1 kg\"")],
        &["robot.urdf:2", "<mass>", "1 kg", "a number"],
    );
    let message = read("<mars/>").unwrap_err();
    assert!(message.contains("robot.urdf:1") && message.contains("<robot>"), "{message}");
}

#[test]
fn mimic_joints_become_couplings() {
    let links = [good("a"), good("b"), good("c")].concat();
    let mimic = |of: &str| {
        let joint = joint("jc", "continuous", "a", "c");
        joint
            .replace("</joint>", &format!("<mimic joint=\"{of}\" multiplier=\"-2\" offset=\"0.5\"/></joint>"))
    };
    let with = |of: &str| [links.clone(), joint("jb", "continuous", "a", "b"), mimic(of)];
    let robot = read(&robot(&with("jb"))).unwrap();
    let c = &robot.couplings[0];
    assert_eq!((c.name.as_str(), c.follower, c.leader, c.ratio, c.offset), ("jc_mimic", 1, 0, -2.0, 0.5));
    refused(&with("no"), &["joint `jc`", "<mimic>", "`no`"]);
    refused(&with("jc"), &["joint `jc`", "another"]);
    let circle = [
        links.clone(),
        joint("jb", "continuous", "a", "b").replace("</joint>", "<mimic joint=\"jc\"/></joint>"),
        mimic("jb"),
    ];
    refused(&circle, &["joint `jb`", "<mimic>", "circle"]);
}

#[test]
fn what_nothing_reads_is_named_once() {
    let inertial = good("a").replace("</link>", "<sensor name=\"s\"/></link>");
    let with = "<dynamics damping=\"1\" stiction=\"2\"/><safety_controller k_velocity=\"1\"/>\
                <limit effort=\"3\" velocity=\"4\"/></joint>";
    let joint = |name: &str, child: &str| joint(name, "continuous", "a", child).replace("</joint>", with);
    let gazebo = "<gazebo reference=\"a\"><mu1>0.9</mu1></gazebo>\n".to_owned();
    let drive = "<transmission name=\"t\"/><transmission name=\"u\"/>\n".to_owned();
    let parts = [inertial, good("b"), good("c"), joint("j", "b"), joint("k", "c"), gazebo, drive];
    let robot = read(&robot(&parts)).unwrap();
    let expected = [
        "robot.urdf:8: `stiction` = \"2\" of <dynamics> is not supported and does nothing (1 more like it)",
        "robot.urdf:8: <safety_controller> in <joint> is not supported and does nothing (1 more like it)",
        "robot.urdf:3: <sensor> in <link> is not supported and does nothing",
        "robot.urdf:10: <gazebo> in <robot> is not supported and does nothing",
    ];
    assert_eq!(robot.warnings, expected);
    assert_eq!(robot.notices.len(), 2);
    assert!(robot.notices[0].contains("joint `j`: `effort` and `velocity`"), "{}", robot.notices[0]);
    // every robot of ROS has them; a warning would be there in every run
    let said = "robot.urdf:11: <transmission> is for controllers of ROS and does nothing (2 in all)";
    assert_eq!(robot.notices[1], said);
}

#[test]
fn planar_and_spherical_joints_are_read() {
    let two = [good("a"), good("b")].concat();
    for (name, kind) in [("planar", JointKind::Planar), ("spherical", JointKind::Spherical)] {
        let robot = read(&robot(&[two.clone(), joint("j", name, "a", "b")])).unwrap();
        assert_eq!(robot.joints[0].kind, kind);
    }
}

#[test]
fn what_cannot_be_read_is_refused() {
    let missing =
        read_robot(Path::new("no/such.urdf"), &Options::default()).expect_err("missing").to_string();
    assert!(missing.starts_with("no/such.urdf: the robot file cannot be read"), "{missing}");
    for text in ["", "not xml", "<robot>", "<sdf></sdf>"] {
        assert!(read(text).is_err(), "{text}");
    }
}

#[test]
fn elements_too_deep_in_each_other_are_refused() {
    let deep = format!("<robot name=\"r\">\n{}{}</robot>", "<a>".repeat(100_000), "</a>".repeat(100_000));
    assert!(read(&deep).unwrap_err().contains("robot.urdf:2: "));
    let bodies = ("<body><geom size=\"1\"/>".repeat(100_000), "</body>".repeat(100_000));
    let deep = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", bodies.0, bodies.1);
    let message = terraglue_robot_import::read_mjcf_text("m.xml", &deep, &Options::default()).unwrap_err();
    assert!(message.to_string().contains("500 deep"), "{message}");
}
