//! MJCF comes out as the same robot as its URDF twin; what cannot be used is named.
#![allow(clippy::unwrap_used, missing_docs)]

use std::path::Path;
use terraglue_robot_import::{
    Base, DriveKind, JointKind, Robot, ShapeGeometry, read_mjcf, read_mjcf_text, read_urdf,
};

fn file(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(name)
}

fn read(worldbody: &str, more: &str) -> Result<Robot, String> {
    let text = format!("<mujoco model=\"m\">\n{more}\n<worldbody>\n{worldbody}\n</worldbody></mujoco>");
    read_mjcf_text("m.xml", &text).map_err(|e| e.to_string())
}

#[test]
fn the_hexapod_is_its_urdf_twin() {
    let ours = read_mjcf(&file("tests/reference/multibody/hexapod.xml")).unwrap();
    let twin = read_urdf(&file("models/hexapod.urdf"), false).unwrap();
    assert_eq!((ours.bodies.len(), ours.joints.len()), (25, 24));
    assert!(matches!(ours.base, Base::Free(_)) && ours.warnings.is_empty(), "{:?}", ours.warnings);
    assert_eq!(ours.planes.len(), 1);
    assert_eq!((*ours.planes[0].normal, ours.planes[0].offset), (nalgebra::Vector3::z(), 0.0));
    for (a, b) in ours.bodies.iter().zip(&twin.bodies) {
        assert_eq!((&a.name, a.mass), (&b.name, b.mass));
        assert!((a.com - b.com).norm() < 1e-12 && (a.inertia - b.inertia).norm() < 1e-12, "{}", a.name);
    }
    for (a, b) in ours.joints.iter().zip(&twin.joints) {
        assert_eq!(
            (&a.name, a.kind, a.parent, a.child, a.limits),
            (&b.name, b.kind, b.parent, b.child, b.limits)
        );
        assert!((*a.axis - *b.axis).norm() < 1e-12);
        let apart = a.parent_from_joint.inverse() * b.parent_from_joint;
        assert!(apart.translation.vector.norm() + apart.rotation.angle() < 1e-9, "{}", a.name);
        let drive = a.data.drive.unwrap();
        assert_eq!((drive.kind, drive.stiffness, drive.damping), (DriveKind::Position, 600.0, 10.0));
        assert_eq!(drive.max_torque, Some(60.0));
    }
    let foot = |r: &Robot| r.bodies[4].shapes.iter().find(|s| s.collides).unwrap().clone();
    assert_eq!(foot(&ours).geometry, foot(&twin).geometry);
    assert_eq!((foot(&ours).friction, foot(&ours).group, foot(&ours).mask), (Some(0.8), 1, 2));
    // Body against feet: 1 & 2 = 0.
    let trunk = ours.bodies[0].shapes[0].clone();
    assert!(!trunk.meets(&foot(&ours)));
}

#[test]
fn angles_defaults_and_weights_are_those_of_the_format() {
    let robot = read(
        r#"<body name="a" pos="0 0 1" euler="90 0 0" childclass="thin"><freejoint/>
             <geom type="box" size="0.1 0.2 0.3"/>
             <body name="b" pos="0 0 0.5"><joint name="j" axis="0 1 0" range="-90 45" damping="0.2"/>
               <geom fromto="0 0 0 0 0 0.4" type="capsule"/></body></body>
           <body name="c" pos="3 0 1"><joint type="free"/><geom size="0.1" mass="2"/></body>"#,
        r#"<default><geom density="500"/><default class="thin"><geom size="0.05" density="100"/>
             <joint armature="0.01"/></default></default>"#,
    )
    .unwrap();
    let [a, b, c] = &robot.bodies[..] else { panic!("three bodies") };
    assert!((a.mass - 100.0 * 0.048).abs() < 1e-12);
    let capsule = std::f64::consts::PI * 0.0025 * (0.4 + 4.0 / 3.0 * 0.05);
    assert!((b.mass - 100.0 * capsule).abs() < 1e-12 && (b.com.z - 0.2).abs() < 1e-12);
    assert!((c.inertia[(0, 0)] - 0.4 * 2.0 * 0.01).abs() < 1e-15);
    let j = &robot.joints[0];
    let half = std::f64::consts::FRAC_PI_2;
    assert_eq!((j.kind, j.data.damping, j.data.armature), (JointKind::Revolute, 0.2, 0.01));
    assert!((j.limits.unwrap()[0] + half).abs() < 1e-12 && (j.limits.unwrap()[1] - half / 2.0).abs() < 1e-12);
    let Base::Free(pose) = robot.base else { panic!("free") };
    assert!((pose * nalgebra::Vector3::z() + nalgebra::Vector3::y()).norm() < 1e-12);
    assert_eq!(robot.others.len(), 1);
    assert_eq!((robot.others[0].0, robot.others[0].1.translation.x), (2, 3.0));
}

#[test]
fn a_world_has_shapes_and_bodies_hang_from_it() {
    let robot = read(
        r#"<geom type="box" size="1 1 0.1" pos="0 0 -0.1" friction="0.4"/>
           <body name="post" pos="0 0 1"><geom type="sphere" size="0.1"/>
             <body name="arm"><joint/><geom size="0.1" mass="1" pos="0.5 0 0"/></body></body>"#,
        "",
    )
    .unwrap();
    assert_eq!(robot.base, Base::World);
    assert_eq!((robot.bodies.len(), robot.world_shapes.len()), (1, 2));
    assert_eq!(robot.world_shapes[0].friction, Some(0.4));
    assert_eq!(robot.joints[0].parent, None);
    assert_eq!(robot.joints[0].parent_from_joint.translation.z, 1.0);
    assert_eq!(robot.bodies[0].shapes[0].geometry, ShapeGeometry::Sphere { radius: 0.1 });
}

#[test]
fn what_is_not_supported_is_named_with_its_line() {
    let robot = read(
        "<body name=\"a\"><freejoint/><geom size=\"0.1\"/>\n<geom name=\"egg\" type=\"ellipsoid\" size=\"1 1 2\"/></body>",
        "<equality><weld body1=\"a\"/></equality>\n<sensor><gyro name=\"g\" site=\"s\"/></sensor>",
    )
    .unwrap();
    let text = robot.warnings.join("\n");
    for expected in ["m.xml:2: <weld>", "m.xml:3: <gyro> `g`", "m.xml:6: <geom> `egg`", "ellipsoid"] {
        assert!(text.contains(expected), "`{expected}` is not in: {text}");
    }
}

#[test]
fn what_would_be_another_mechanism_is_refused() {
    let refused = |worldbody: &str, expected: &[&str]| {
        let message = read(worldbody, "").expect_err("a bad robot");
        assert!(message.starts_with("m.xml"), "{message}");
        expected.iter().for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
    };
    refused(
        r#"<body name="a"><joint type="ball"/><geom size="0.1"/></body>"#,
        &["m.xml:4", "`ball` cannot be simulated", "hinge"],
    );
    refused(r#"<body name="a"><joint/><joint/><geom size="0.1"/></body>"#, &["body `a`", "2 joints"]);
    refused(r#"<body name="a"><freejoint/></body>"#, &["body `a`", "no mass"]);
    refused(r#"<body name="a"><freejoint/><geom size="0"/></body>"#, &["positive"]);
    refused(r#"<body name="a" pos="0 0"><freejoint/><geom size="1"/></body>"#, &["pos has 2 numbers"]);
    refused(r#"<body name="a" pos="0 0 nan"><freejoint/><geom size="1"/></body>"#, &["body `a`", "finite"]);
    let inertial = |mass: &str, inertia: &str| {
        format!(
            r#"<body name="a"><freejoint/><inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/></body>"#
        )
    };
    refused(&inertial("1", "1 1 3"), &["m.xml:4", "body `a`", "sum of the other two"]);
    refused(&inertial("1", "0 0 0"), &["body `a`", "not positive"]);
    refused(&inertial("nan", "1 1 1"), &["m.xml:4", "mass", "finite"]);
    refused(&inertial("-1", "1 1 1"), &["positive mass"]);
    let hinge = |more: &str| format!(r#"<body name="b"><joint name="j" {more}/><geom size="0.1"/></body>"#);
    refused(&hinge("damping=\"-1\""), &["joint `j`", "damping = -1", "negative"]);
    refused(&(hinge("") + &hinge("")), &["body `b`", "used twice"]);
    refused(&(hinge("") + &hinge("").replace("\"b\"", "\"c\"")), &["joint `j`", "used twice"]);
    refused("<geom size=\"1\"/>", &["no body"]);
}

#[test]
fn masses_far_apart_are_warned_of() {
    let robot = read(
        r#"<body name="a"><freejoint/><geom size="0.1" mass="1e7"/></body>
           <body name="b"><freejoint/><geom size="0.1" mass="1e-6"/></body>"#,
        "",
    );
    let warnings = robot.unwrap().warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("m.xml: link `b` weighs 1e-6 kg"), "{warnings:?}");
}
