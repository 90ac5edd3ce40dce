//! MJCF comes out as the same robot as its URDF twin; unused parts are named.

use std::path::Path;
use terraglue_robot_import::{
    Base, DriveKind, JointKind, Options, Robot, ShapeGeometry, read_mjcf_text, read_robot,
};

fn file(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(name)
}

fn read(worldbody: &str, more: &str) -> Result<Robot, String> {
    let text = format!("<mujoco model=\"m\">\n{more}\n<worldbody>\n{worldbody}\n</worldbody></mujoco>");
    read_mjcf_text("m.xml", &text, &Options::default()).map_err(|e| e.to_string())
}

#[test]
fn the_hexapod_is_its_urdf_twin() {
    let ours = read_robot(&file("tests/reference/multibody/hexapod.xml"), &Options::default()).unwrap();
    let twin = read_robot(&file("models/hexapod.urdf"), &Options::default()).unwrap();
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
        "<equality><tendon tendon1=\"t\"/></equality>\n<sensor><gyro name=\"g\" site=\"s\"/></sensor>",
    )
    .unwrap();
    let text = robot.warnings.join("\n");
    for expected in ["m.xml:2: <tendon>", "m.xml:3: <gyro> `g`", "m.xml:6: <geom> `egg`", "ellipsoid"] {
        assert!(text.contains(expected), "`{expected}` is not in: {text}");
    }
}

#[test]
fn a_type_of_a_geom_that_mjcf_does_not_have_is_refused() {
    let world = "<body name=\"a\"><freejoint/><geom name=\"egg\" type=\"elipsoid\" size=\"1 1 2\" mass=\"1\"/></body>";
    let text = read(world, "").expect_err("refused").to_string();
    for expected in ["m.xml:4: ", "geom `egg`", "type = \"elipsoid\"", "sphere, capsule, ellipsoid"] {
        assert!(text.contains(expected), "`{expected}` is not in: {text}");
    }
}

#[test]
fn attributes_that_act_and_are_not_supported_are_named() {
    let cases = [
        (
            "<body name=\"a\" gravcomp=\"1\"><freejoint/><geom size=\"1\"/></body>",
            "<body> `a` has `gravcomp`",
        ),
        (
            "<body name=\"a\"><joint springdamper=\"1 1\"/><geom size=\"1\"/></body>",
            "<joint> has `springdamper`",
        ),
        ("<body name=\"a\"><joint ref=\"30\"/><geom size=\"1\"/></body>", "has `ref` = \"30\""),
        ("<body name=\"a\"><freejoint/><geom size=\"1\" margin=\"0.1\"/></body>", "<geom> has `margin`"),
        (
            "<body name=\"a\"><joint type=\"ball\" damping=\"1\"/><geom size=\"1\"/></body>",
            "turns freely: `damping`",
        ),
        (
            "<body name=\"a\"><freejoint/><geom size=\"1\"/><composite/></body>",
            "<composite> is not supported",
        ),
        (
            "<body name=\"a\"><freejoint/><geom size=\"1\"/><geom type=\"plane\" size=\"1 1 1\"/></body>",
            "plane on a body",
        ),
        (
            "<body name=\"a\"><freejoint/><geom size=\"1\" solref=\"0.01 1\"/><geom size=\"1\" solref=\"0.1 1\"/></body>",
            "<geom> has `solref` = \"0.01 1\", which is not supported and does nothing (1 more like it)",
        ),
        (
            "<body name=\"a\"><freejoint/><geom size=\"1\" condim=\"6\"/></body>",
            "<geom> has `condim` = \"6\"",
        ),
        (
            "<body name=\"a\"><freejoint/><geom size=\"1\" spin=\"fast\"/></body>",
            "<geom> has `spin` = \"fast\"",
        ),
        (
            "<frame><body name=\"b\"/></frame><body name=\"a\"><freejoint/><geom size=\"1\"/></body>",
            "<frame> is not",
        ),
    ];
    for (world, expected) in cases {
        let robot = read(world, "").unwrap();
        let text = robot.warnings.join("\n");
        assert!(text.contains("m.xml:4: ") && text.contains(expected), "`{expected}` is not in: {text}");
    }
    let ball = "<body name=\"a\"><joint name=\"j\"/><geom size=\"1\"/></body>";
    for (more, expected) in [
        ("<option density=\"1.2\"/>", "<option> has `density`"),
        ("<compiler boundmass=\"3\"/>", "<compiler> has `boundmass`"),
        ("<tendon><fixed name=\"t\"/></tendon>", "<fixed> `t` is not supported"),
        ("<actuator><muscle joint=\"j\"/></actuator>", "<muscle> is not supported"),
        ("<actuator><position joint=\"j\" dampratio=\"1\"/></actuator>", "<position> has `dampratio`"),
        ("<contact><pair geom1=\"x\" geom2=\"y\"/></contact>", "<pair> is not supported"),
        (
            "<option><flag contact=\"disable\" energy=\"enable\"/></option>",
            "<flag> has `contact` = \"disable\"",
        ),
        ("<actuator><position joint=\"j\" ctrlrange=\"-1 1\"/></actuator>", "<position> has `ctrlrange`"),
        ("<keyframe><key qpos=\"1\"/></keyframe>", "<key> is not supported"),
        ("<default><joint springdamper=\"1 1\"/></default>", "<joint> `j` has `springdamper`"),
    ] {
        let text = read(ball, more).unwrap().warnings.join("\n");
        assert!(text.contains(expected), "`{expected}` is not in: {text}");
    }
    assert!(read(ball, "<option gravity=\"0 0 -1\" density=\"0\"/>").unwrap().warnings.is_empty());
}

const PAIR: &str = r#"<body name="a" pos="0 0 1"><joint name="ja" axis="0 1 0"/><geom size="0.1" mass="1"/></body>
    <body name="b" pos="1 0 1"><joint name="jb" axis="0 1 0"/><geom size="0.1" mass="1"/>
      <body name="c" pos="0 0 -0.5"><geom size="0.1" mass="0"/></body></body>"#;

#[test]
fn equality_becomes_loops_and_couplings() {
    let robot = read(
        PAIR,
        r#"<equality><connect name="c" body1="c" body2="a" anchor="0.1 0 0"/><weld body1="b"/>
           <joint joint1="jb" joint2="ja" polycoef="0.2 -3 0 0 0"/>
           <connect body1="a" body2="b" anchor="0 0 0" active="false"/></equality>"#,
    )
    .unwrap();
    let [connect, weld] = &robot.loops[..] else { panic!("{:?}", robot.loops) };
    // `c` hangs fixed below `b`, 0.5 m lower.
    assert_eq!((connect.name.as_str(), connect.bodies, connect.rigid), ("c", [Some(1), Some(0)], false));
    assert!((connect.origin - nalgebra::Vector3::new(0.1, 0.0, -0.5)).norm() < 1e-15);
    assert_eq!((weld.bodies, weld.rigid), ([Some(1), None], true));
    let c = &robot.couplings[0];
    assert_eq!((c.follower, c.leader, c.ratio, c.offset), (1, 0, -3.0, 0.2));
    assert!(robot.warnings.len() == 1 && robot.warnings[0].contains("not active"), "{:?}", robot.warnings);
    let refused = |equality: &str, expected: &str| {
        let message = read(PAIR, &format!("<equality>{equality}</equality>")).unwrap_err();
        assert!(message.starts_with("m.xml:2: ") && message.contains(expected), "{message}");
    };
    refused("<connect body1=\"x\" anchor=\"0 0 0\"/>", "no body `x`");
    refused("<connect body1=\"b\" body2=\"c\" anchor=\"0 0 0\"/>", "do not move against each other");
    refused("<connect body1=\"b\"/>", "anchor");
    refused("<weld body1=\"a\" body2=\"b\" relpose=\"1 0 0.1 1 0 0 0\"/>", "open by 1.000e-1");
    refused("<joint joint1=\"ja\" joint2=\"jx\"/>", "no joint `jx`");
    refused("<joint joint1=\"ja\" joint2=\"jb\" polycoef=\"0 1 2\"/>", "polycoef");
    assert!(
        read(PAIR, r#"<equality><weld body1="a" body2="b" relpose="1 0 0 1 0 0 0"/></equality>"#).is_ok()
    );
}

#[test]
fn excluded_pairs_may_name_parts_of_bodies_and_bodies_that_stand_still() {
    let post = r#"<body name="post" pos="5 0 0"><geom size="0.1"/></body>"#;
    let exclude = |one: &str, other: &str| {
        let more = format!(r#"<contact><exclude body1="{one}" body2="{other}"/></contact>"#);
        read(&format!("{PAIR}{post}"), &more)
    };
    // `c` is a part of `b`, so the pair is that of a and b.
    assert_eq!(exclude("a", "c").unwrap().excluded, [[0, 1]]);
    let own = exclude("b", "c").unwrap();
    assert!(own.excluded.is_empty() && own.warnings.is_empty(), "{:?}", own.warnings);
    for still in ["post", "world"] {
        let robot = exclude("a", still).unwrap();
        assert!(robot.excluded.is_empty());
        assert!(robot.warnings[0].contains("m.xml:2: <exclude> names a body that stands still"));
    }
    assert!(exclude("a", "d").unwrap_err().contains("m.xml:2: exclude: body2: there is no body `d`"));
}

#[test]
fn meshes_and_height_fields_come_from_assets() {
    let robot = read(
        r#"<geom type="hfield" hfield="f" pos="0 0 0.2"/><geom type="mesh" mesh="wedge"/>
           <body name="a" pos="0 0 1"><freejoint/><geom type="mesh" mesh="wedge" density="600"/></body>"#,
        r#"<asset><mesh name="wedge" vertex="0 0 0 1 0 0 0 1 0 0 0 1" scale="2 1 1" refpos="1 0 0"/>
           <hfield name="f" nrow="2" ncol="3" size="1 2 0.5 1" elevation="5 5 7 3 3 3"/></asset>"#,
    )
    .unwrap();
    let ShapeGeometry::Heights(field) = &robot.world_shapes[0].geometry else { panic!("heights") };
    assert_eq!((field.nodes, field.lengths), ([3, 2], [2.0, 4.0]));
    assert_eq!(field.heights, [0.0, 0.0, 0.0, 0.25, 0.25, 0.5]);
    assert!(matches!(&robot.world_shapes[1].geometry, ShapeGeometry::Triangles(m) if m.triangles.len() == 4));
    assert!(matches!(&robot.bodies[0].shapes[0].geometry, ShapeGeometry::Hull(m) if m.points.len() == 4));
    // A tetrahedron with edges 2, 1, 1 m around a corner at (−1, 0, 0): 1/3 m³.
    let a = &robot.bodies[0];
    assert!((a.mass - 200.0).abs() < 1e-9);
    assert!((a.com - nalgebra::Vector3::new(-0.5, 0.25, 0.25)).norm() < 1e-12);
    assert!((a.inertia[(0, 0)] - 200.0 * 3.0 / 80.0 * 2.0).abs() < 1e-9, "{}", a.inertia);
    assert!(robot.notices[0].contains("m.xml:6: <geom> with the mesh `wedge`"), "{:?}", robot.notices);
    let refused = |world: &str, more: &str, expected: &[&str]| {
        let message = read(world, more).unwrap_err();
        expected.iter().for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
    };
    let body = r#"<body name="a"><freejoint/><geom type="mesh" mesh="m"/></body>"#;
    refused(body, "", &["m.xml:4", "no <mesh> `m`"]);
    let missing = r#"<compiler meshdir="parts"/><asset><mesh name="m" file="no.stl"/></asset>"#;
    refused(body, missing, &["m.xml:4", "no.stl", "tried: parts/no.stl"]);
    let seen = r#"<body name="a"><freejoint/><geom size="1"/>
        <geom type="mesh" mesh="m" contype="0" conaffinity="0"/></body>"#;
    let robot = read(seen, missing).unwrap();
    assert!(
        robot.warnings[0].contains("only seen") && robot.warnings[0].contains("no.stl"),
        "{:?}",
        robot.warnings
    );
    let field =
        |size: &str, grid: &str| format!("<asset><hfield name=\"f\" size=\"{size}\" {grid}/></asset>");
    let ground = r#"<geom type="hfield" hfield="f"/><body name="a"><freejoint/><geom size="1"/></body>"#;
    refused(ground, &field("1 1 1", ""), &["m.xml:2", "four numbers"]);
    refused(ground, &field("1 1 1 1", r#"nrow="2" ncol="2" elevation="1 2 3""#), &["nrow = 2", "are not 3"]);
    refused(ground, &field("1 1 1 1", r#"file="x.png""#), &["x.png"]);
}

#[test]
fn what_would_be_another_mechanism_is_refused() {
    let refused = |worldbody: &str, expected: &[&str]| {
        let message = read(worldbody, "").expect_err("a bad robot");
        assert!(message.starts_with("m.xml"), "{message}");
        expected.iter().for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
    };
    refused(
        r#"<body name="a"><joint type="screw"/><geom size="0.1"/></body>"#,
        &["m.xml:4", "`screw` cannot be simulated", "hinge"],
    );
    refused(
        r#"<body name="a"><freejoint/><joint/><geom size="0.1"/></body>"#,
        &["m.xml:4", "free (alone, on a body of <worldbody> itself)"],
    );
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
        r#"<body name="a"><freejoint/><geom size="0.1" mass="1e5"/></body>
           <body name="b"><freejoint/><geom size="0.1" mass="1e-8"/></body>"#,
        "",
    );
    let warnings = robot.unwrap().warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("m.xml: link `b` weighs 1e-8 kg"), "{warnings:?}");
}

#[test]
fn the_total_mass_is_what_the_compiler_says() {
    let text = |compiler: &str| {
        format!(
            "<mujoco>{compiler}<worldbody><body name=\"a\"><joint name=\"j\"/><geom size=\"0.1\" mass=\"3\"/>\
             <body name=\"b\"><joint name=\"k\"/><geom size=\"0.1\" mass=\"1\"/></body></body></worldbody></mujoco>"
        )
    };
    let read = |compiler: &str| read_mjcf_text("m.xml", &text(compiler), &Options::default()).unwrap();
    let (plain, scaled) = (read(""), read("<compiler settotalmass=\"14\"/>"));
    for (a, b) in plain.bodies.iter().zip(&scaled.bodies) {
        assert!((b.mass - 3.5 * a.mass).abs() < 1e-12 && (b.inertia - 3.5 * a.inertia).norm() < 1e-12);
    }
    assert!(scaled.warnings.is_empty(), "{:?}", scaled.warnings);
}
