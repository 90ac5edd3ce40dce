//! Numbers, names and words of robot files that mean nothing are refused with place, element, value and way out.

use terraglue_robot_import::{Options, read_mjcf_text, read_urdf_text};

/// The message for a text in which `from` is replaced by `to`.
fn changed(file: &str, good: &str, from: &str, to: &str) -> String {
    let bad = good.replacen(from, to, 1);
    assert_ne!(bad, good, "`{from}` is not there");
    let read = if file.ends_with(".urdf") { read_urdf_text } else { read_mjcf_text };
    assert!(read(file, good, &Options::default()).is_ok());
    match read(file, &bad, &Options::default()) {
        Ok(_) => panic!("accepted: {to}"),
        Err(e) => e.to_string(),
    }
}

fn says(message: &str, expected: &[&str]) {
    expected.iter().for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
}

const URDF: &str = r#"<robot name="r">
<link name="a"><inertial><origin xyz="0 0 0.5" rpy="0 0 0"/><mass value="2"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0" rpy="0 0 3"/><geometry><box size="1 1 4"/></geometry></collision></link>
<link name="b"><inertial><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="c"><inertial><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="7 0 0"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="5" velocity="6"/><dynamics damping="0.3" friction="0.4"/></joint>
<joint name="k" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 1 0"/>
<mimic joint="j" multiplier="8" offset="9"/></joint>
</robot>"#;

const MJCF: &str = r#"<mujoco model="m">
<compiler angle="radian" autolimits="true" eulerseq="xyz" inertiafromgeom="auto"/>
<default><geom density="500"/><default class="thin"><geom density="100"/></default></default>
<asset><mesh name="w" vertex="0 0 0 1 0 0 0 1 0 0 0 1" scale="2 1 1" refquat="1 0 0 0"/>
<hfield name="f" nrow="2" ncol="3" size="1 2 0.5 1" elevation="5 5 7 3 3 3"/></asset>
<worldbody><geom type="hfield" hfield="f" friction="0.7 0.1 0.1"/>
<body name="a" pos="0 0 1" childclass="thin"><freejoint name="free"/><geom name="ball" size="0.1" mass="3"/>
<body name="b" pos="0 0 0.5"><joint name="j" range="-1 1" limited="true" damping="0.2" armature="0.01"/>
<inertial pos="0 0 0" mass="4" diaginertia="1 1 1"/><geom size="0.2" class="thin" contype="1"/></body></body>
<body name="post"><geom size="0.2" pos="9 0 0"/><body name="arm"><joint name="k"/><geom size="0.1"/></body></body>
</worldbody>
<actuator><position name="p" joint="j" kp="50" kv="2" gear="3 0 0" forcerange="-7 7"/></actuator>
<equality><joint name="e" joint1="k" joint2="j" polycoef="0 6"/></equality>
</mujoco>"#;

#[test]
fn numbers_that_are_not_finite_are_refused_wherever_they_stand() {
    let urdf = [
        ("0 0 0.5", "robot.urdf:2: <origin> of <link> `a`: xyz"),
        ("value=\"2\"", "robot.urdf:2: <mass> of <link> `a`: value"),
        ("izz=\"0.1\"", "robot.urdf:3: <inertia> of <link> `a`: izz"),
        ("0 0 3", "robot.urdf:4: <origin> of <link> `a`: rpy"),
        ("1 1 4", "robot.urdf:4: <box> of <link> `a`: size"),
        ("7 0 0", "robot.urdf:9: <origin> of <joint> `j`: xyz"),
        ("0 0 1\"/>\n", "robot.urdf:9: <axis> of <joint> `j`: xyz"),
        ("lower=\"-1\"", "robot.urdf:10: <limit> of <joint> `j`: lower"),
        ("upper=\"1\"", "robot.urdf:10: <limit> of <joint> `j`: upper"),
        ("effort=\"5\"", "robot.urdf:10: <limit> of <joint> `j`: effort"),
        ("velocity=\"6\"", "robot.urdf:10: <limit> of <joint> `j`: velocity"),
        ("damping=\"0.3\"", "robot.urdf:10: <dynamics> of <joint> `j`: damping"),
        ("friction=\"0.4\"", "robot.urdf:10: <dynamics> of <joint> `j`: friction"),
        ("multiplier=\"8\"", "robot.urdf:12: <mimic> of <joint> `k`: multiplier"),
        ("offset=\"9\"", "robot.urdf:12: <mimic> of <joint> `k`: offset"),
    ];
    let mjcf = [
        ("density=\"500\"", "m.xml:3: geom: density"),
        ("density=\"100\"", "m.xml:3: geom: density"),
        ("scale=\"2 ", "m.xml:4: mesh `w`: scale"),
        ("size=\"1 2 0.5 1\"", "m.xml:5: hfield `f`: size"),
        ("0.7", "m.xml:6: geom: friction"),
        ("pos=\"0 0 1\"", "m.xml:7: body `a`: pos"),
        ("mass=\"3\"", "m.xml:7: geom `ball`: mass"),
        ("range=\"-1 1\"", "m.xml:8: joint `j`: range"),
        ("mass=\"4\"", "m.xml:9: inertial: mass"),
        ("diaginertia=\"1 1 1\"", "m.xml:9: inertial: diaginertia"),
        ("kp=\"50\"", "m.xml:12: position `p`: kp"),
        ("gear=\"3 ", "m.xml:12: position `p`: gear"),
        ("-7 7", "m.xml:12: position `p`: forcerange"),
        ("0 6", "m.xml:13: joint `e`: polycoef"),
    ];
    for (file, good, places) in [("robot.urdf", URDF, &urdf[..]), ("m.xml", MJCF, &mjcf[..])] {
        for (from, place) in places {
            let digit = from.rfind(|c: char| c.is_ascii_digit()).unwrap();
            let start = from[..digit]
                .rfind(|c: char| !c.is_ascii_digit() && c != '.' && c != '-')
                .map_or(0, |k| k + 1);
            for word in ["nan", "-inf", "1e400"] {
                let to = format!("{}{word}{}", &from[..start], &from[digit + 1..]);
                says(&changed(file, good, from, &to), &[place, word, "is not finite", "finite number"]);
            }
        }
    }
    let message = changed("robot.urdf", URDF, "lower=\"-1\"", "lower=\"-inf\"");
    says(&message, &["make the joint continuous"]);
}

#[test]
fn numbers_that_cannot_be_computed_with_are_refused() {
    for (from, to) in [("value=\"2\"", "value=\"1e308\""), ("1 1 4", "1 1 1e200"), ("7 0 0", "-1e101 0 0")] {
        says(&changed("robot.urdf", URDF, from, to), &["robot.urdf:", "beyond 1e100", "check its unit"]);
    }
    says(
        &changed("m.xml", MJCF, "mass=\"4\"", "mass=\"1e308\""),
        &["m.xml:9: inertial: mass", "beyond 1e100"],
    );
    // The product of sizes and densities.
    let message = changed("m.xml", MJCF, "size=\"0.1\" mass=\"3\"", "size=\"1e40\"");
    says(&message, &["m.xml:7: body `a`", "mass 4.1", "e122 kg", "check its unit"]);
    says(
        &changed("robot.urdf", URDF, "value=\"2\"", "value=\"1e-310\""),
        &["robot.urdf:2", "mass 1e-310 kg"],
    );
    // A limit that stands for none.
    let wide = URDF.replace("upper=\"1\"", "upper=\"1.79769e308\"");
    assert!(read_urdf_text("robot.urdf", &wide, &Options::default()).is_ok());
}

#[test]
fn names_are_there_and_unique() {
    for (from, to, place) in [
        ("link name=\"a\"", "link name=\"\"", "robot.urdf:2: <link> ``: name = \"\" is empty"),
        ("joint name=\"k\"", "joint name=\" \"", "robot.urdf:11: <joint> ` `: name = \" \" is empty"),
    ] {
        says(&changed("robot.urdf", URDF, from, to), &[place, "give it one"]);
    }
    says(&changed("robot.urdf", URDF, "joint name=\"k\"", "joint name=\"j\""), &["joint `j`", "used twice"]);
    let twice = [
        ("body name=\"b\"", "body name=\"a\"", "m.xml:8: body `a`", "m.xml:7"),
        // Also one that stands still.
        ("body name=\"post\"", "body name=\"b\"", "m.xml:10: body `b`", "m.xml:8"),
        ("joint name=\"k\"", "joint name=\"free\"", "m.xml:10: joint `free`", "m.xml:7"),
        ("geom size=\"0.2\" pos", "geom name=\"ball\" size=\"0.2\" pos", "m.xml:10: geom `ball`", "m.xml:7"),
        (
            "<hfield name",
            "<hfield name=\"f\" size=\"1 1 1 1\"/><hfield name",
            "m.xml:5: hfield `f`",
            "m.xml:5",
        ),
        (
            "<position name",
            "<motor name=\"p\" joint=\"k\"/><position name",
            "m.xml:12: position `p`",
            "m.xml:12",
        ),
        ("<equality>", "<equality><weld name=\"e\" body1=\"a\"/>", "m.xml:13: joint `e`", "m.xml:13"),
        (
            "class=\"thin\"><geom",
            "class=\"thin\"/><default class=\"thin\"><geom",
            "m.xml:3: default",
            "\"thin\"",
        ),
    ];
    for (from, to, second, first) in twice {
        says(&changed("m.xml", MJCF, from, to), &[second, "used twice", first]);
    }
    says(&changed("m.xml", MJCF, "body name=\"b\"", "body name=\"\""), &["m.xml:8: body ``", "is empty"]);
}

#[test]
fn names_that_the_reader_makes_up_meet_none_of_the_file() {
    let ball = "<geom size=\"0.1\"/></body>";
    for (bodies, name) in [
        (
            format!("<body name=\"body1\"><freejoint/>{ball}<body><freejoint/>{ball}"),
            "bodies are called `body1`",
        ),
        (
            format!(
                "<body name=\"a\"><joint/><joint name=\"y\"/>{ball}<body name=\"a_1\"><freejoint/>{ball}"
            ),
            "bodies are called `a_1`",
        ),
        (
            format!("<body name=\"a\"><joint name=\"b_joint\"/>{ball}<body name=\"b\"><joint/>{ball}"),
            "joints are called `b_joint`",
        ),
    ] {
        let text = format!("<mujoco><worldbody>{bodies}</worldbody></mujoco>");
        let message = read_mjcf_text("m.xml", &text, &Options::default()).unwrap_err().to_string();
        says(&message, &["m.xml: two", name, "give it another one"]);
    }
}

#[test]
fn classes_and_words_that_do_not_exist_are_refused() {
    for (from, to, expected) in [
        (
            "childclass=\"thin\"",
            "childclass=\"thick\"",
            ["m.xml:7: body `a`: childclass = \"thick\"", "mean `thin`"],
        ),
        (
            "size=\"0.2\" class=\"thin\"",
            "size=\"0.2\" class=\"tin\"",
            ["m.xml:9: geom: class = \"tin\"", "mean `thin`"],
        ),
        ("angle=\"radian\"", "angle=\"rad\"", ["m.xml:2: compiler: angle = \"rad\"", "degree, radian"]),
        ("eulerseq=\"xyz\"", "eulerseq=\"abc\"", ["m.xml:2: compiler: eulerseq = \"abc\"", "x y z X Y Z"]),
        (
            "limited=\"true\"",
            "limited=\"yes\"",
            ["m.xml:8: joint `j`: limited = \"yes\"", "true, false, auto"],
        ),
        ("default class=\"thin\"", "default", ["m.xml:3: default: class = \"\"", "unique"]),
    ] {
        says(&changed("m.xml", MJCF, from, to), &expected);
    }
    // Without the class `thin` its users have lost theirs.
    let none = changed("m.xml", MJCF, "<default class=\"thin\"><geom density=\"100\"/></default>", "");
    says(&none, &["m.xml:7: body `a`: childclass = \"thin\"", "no such class"]);
}

#[test]
fn free_joints_are_for_bodies_of_the_world() {
    for (from, to) in [
        ("<joint name=\"j\"", "<freejoint/><joint name=\"j\""),
        ("<joint name=\"k\"/>", "<freejoint name=\"k\"/>"),
        ("<joint name=\"k\"/>", "<joint name=\"k\" type=\"free\"/>"),
    ] {
        let message = changed("m.xml", MJCF, from, to);
        says(&message, &["m.xml:", "joint", "type `free`", "on a body of <worldbody> itself"]);
    }
}

#[test]
fn numbers_outside_their_range_are_refused() {
    for (from, to, expected) in [
        ("0.7", "-0.7", ["m.xml:6: geom", "friction = -0.7 is negative"]),
        ("mass=\"3\"", "mass=\"-3\"", ["m.xml:7: geom `ball`", "mass = -3 is negative"]),
        ("mass=\"3\"", "mass=\"3 4\"", ["m.xml:7: geom `ball`", "mass has 2 numbers"]),
        ("density=\"100\"", "density=\"-100\"", ["m.xml:7: geom `ball`", "density = -100 is negative"]),
        ("contype=\"1\"", "contype=\"-1\"", ["m.xml:9: geom", "contype = -1 is not a whole number"]),
        ("kp=\"50\"", "kp=\"-50\"", ["m.xml:12: position `p`", "kp = -50 is negative"]),
        ("-7 7", "7 -7", ["m.xml:12: position `p`", "forcerange = [7.0, -7.0]"]),
        ("-1 1", "1 -1", ["m.xml:8: joint `j`", "leaves no room"]),
        ("refquat=\"1 0 0 0\"", "refquat=\"1 0\"", ["m.xml:4: mesh `w`", "refquat has 2 numbers"]),
        ("ncol=\"3\"", "ncol=\"1e30\"", ["m.xml:5: hfield `f`", "ncol = 1000000000000"]),
        ("nrow=\"2\"", "nrow=\"1.5\"", ["m.xml:5: hfield `f`", "nrow = 1.5 is not a whole number"]),
    ] {
        says(&changed("m.xml", MJCF, from, to), &expected);
    }
    for (from, to, expected) in [
        ("value=\"2\"", "value=\"-2\"", ["robot.urdf:2: link `a`", "mass -2 kg is not positive"]),
        ("damping=\"0.3\"", "damping=\"-0.3\"", ["robot.urdf:9: joint `j`", "-0.3"]),
        ("upper=\"1\"", "upper=\"-2\"", ["robot.urdf:9: joint `j`", "leave no room"]),
    ] {
        says(&changed("robot.urdf", URDF, from, to), &expected);
    }
}
