//! A robot from MJCF moves as its URDF twin; scenes of several bodies and standing shapes.

use crate::common;
use common::{Fixture, STAND};

/// Writes a model next to the temporary ones of this test.
fn scene(name: &str, worldbody: &str, more: &str) -> String {
    let text = format!("<mujoco>{more}<worldbody>{worldbody}</worldbody></mujoco>");
    common::temporary_urdf(&format!("mjcf-{name}"), &text)
}

#[test]
fn the_hexapod_stands_and_moves_as_its_urdf_twin() {
    let mut twins = [
        r#""model": "tests/reference/multibody/hexapod.xml""#,
        r#""model": "models/hexapod.urdf", "position_m": [0, 0, 0.33], "ground": "half-space""#,
    ]
    .map(|model| Fixture::new(&format!(r#"{{{model}, {STAND}}}"#), 9.81, 1e-3));
    for fixture in &mut twins {
        for step in 0..400 {
            let target = fixture.get("LF_j2.angle_target") - 5e-4 * f64::from(u8::from(step > 100));
            fixture.set("LF_j2.angle_target", target);
            fixture.free_step();
        }
    }
    let [ours, twin] = twins.map(|fixture| fixture.states());
    for (a, b) in ours.iter().zip(&twin) {
        let (a, b) = (a.world_from_body, b.world_from_body);
        for k in 0..3 {
            assert!((a.position[k] - b.position[k]).abs() < 1e-7, "{:?} {:?}", a.position, b.position);
        }
    }
}

#[test]
fn bodies_of_one_file_fall_on_what_stands_in_it() {
    let model = scene(
        "table",
        r#"<geom type="plane" size="1 1 1"/><geom type="box" pos="0 0 0.5" size="0.5 0.5 0.5"/>
           <body name="a" pos="0 0 1.2"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body>
           <body name="b" pos="2 0 0.3"><freejoint/><geom size="0.1" mass="2"/></body>"#,
        "",
    );
    let mut fixture = Fixture::new(&format!(r#"{{"model": "{model}"}}"#), 9.81, 1e-3);
    (0..1000).for_each(|_| fixture.free_step());
    assert!((fixture.get("a.z") - 1.1).abs() < 1e-5, "{}", fixture.get("a.z"));
    assert!((fixture.get("b.z") - 0.1).abs() < 1e-5, "{}", fixture.get("b.z"));
    assert!((fixture.get("a.contact_normal") - 9.81).abs() < 1e-3);
}

#[test]
fn friction_is_that_of_the_pair_and_bits_filter() {
    let model = scene(
        "pair",
        r#"<geom type="plane" size="1 1 1" friction="0.1"/>
           <body name="rough" pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" friction="0.6"/></body>
           <body name="smooth" pos="0 1 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" friction="0.05"/></body>
           <body name="ghost" pos="0 1 0.2"><freejoint/>
             <geom type="box" size="0.1 0.1 0.1" contype="0" conaffinity="0"/></body>"#,
        "",
    );
    let mut fixture = Fixture::new(&format!(r#"{{"model": "{model}"}}"#), 9.81, 1e-3);
    let mass = 8.0;
    for body in ["rough", "smooth"] {
        fixture.push(body, [0.3 * mass * 9.81, 0.0, 0.0]);
    }
    (0..500).for_each(|_| fixture.free_step());
    assert!(fixture.get("rough.x").abs() < 1e-9);
    // 0.3·g of push less 0.1·g of friction: the larger one of the pair.
    let exact = 0.2 * 9.81 * 0.5;
    assert!((fixture.get("smooth.vx") / exact - 1.0).abs() < 1e-6, "{}", fixture.get("smooth.vx"));
    assert!(fixture.get("ghost.z") < -0.5);
}

#[test]
fn the_file_speaks_where_the_scenario_is_silent() {
    let model = scene(
        "silent",
        r#"<body name="arm"><joint name="j" axis="0 1 0" damping="0.5" armature="0.1"/><geom size="0.1" mass="1"/></body>"#,
        "<actuator><position joint=\"j\" kp=\"50\" kv=\"2\" forcerange=\"-3 3\"/></actuator>",
    );
    // Actuators may come before the world.
    let fixture = Fixture::new(&format!(r#"{{"model": "{model}"}}"#), 9.81, 1e-3);
    let shown = ["j.stiffness", "j.damping", "j.max_torque", "j.viscous_friction", "j.armature"]
        .map(|n| fixture.get(n));
    assert_eq!(shown, [50.0, 2.0, 3.0, 0.5, 0.1]);
    let fixture =
        Fixture::new(&format!(r#"{{"model": "{model}", "max_torque": 9, "stiffness": 70}}"#), 9.81, 1e-3);
    assert_eq!(
        [fixture.get("j.stiffness"), fixture.get("j.max_torque"), fixture.get("j.damping")],
        [70.0, 9.0, 2.0]
    );
}

#[test]
fn a_joint_that_mimics_follows_with_its_own_ratio() {
    let link = |name: &str| {
        format!(
            r#"<link name="{name}"><inertial><mass value="1"/>
            <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>"#
        )
    };
    let joint = |name: &str, child: &str, more: &str| {
        format!(
            r#"<joint name="{name}" type="revolute"><parent link="a"/><child link="{child}"/>
            <origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/>{more}</joint>"#
        )
    };
    let mimic = r#"<mimic joint="leader" multiplier="-0.5" offset="0.3"/>"#;
    let text = [
        "<robot name=\"r\">".into(),
        [link("a"), link("b"), link("c")].concat(),
        // The follower stands first in the file.
        joint("follower", "c", mimic),
        joint("leader", "b", ""),
        "</robot>".into(),
    ];
    let model = common::temporary_urdf("mimic", &text.concat());
    let mut fixture = Fixture::new(
        &format!(r#"{{"model": "{model}", "fixed_base": true, "joints": {{"leader": 0.4}}}}"#),
        9.81,
        1e-3,
    );
    assert!((fixture.get("follower.angle") - 0.1).abs() < 1e-15);
    fixture.set("leader.angle_target", 1.2);
    (0..2000).for_each(|_| fixture.free_step());
    let (leader, follower) = (fixture.get("leader.angle"), fixture.get("follower.angle"));
    assert!((leader - 1.2).abs() < 1e-3, "{leader}");
    assert!((follower - (0.3 - 0.5 * leader)).abs() < 1e-9, "{follower}");
    // A load on the follower is felt by the leader: it gives way by half the torque over its stiffness.
    let outside = common::instantiate(
        &format!(r#"{{"model": "{model}", "fixed_base": true, "joints": {{"leader": -2, "follower": 0}}}}"#),
        9.81,
    );
    assert!(outside.is_ok(), "1.3 rad is inside the limits");
    let text = text.concat().replace("multiplier=\"-0.5\"", "multiplier=\"5\"");
    let model = common::temporary_urdf("mimic-out", &text);
    let outside = common::instantiate(&format!(r#"{{"model": "{model}", "joints": {{"leader": 1}}}}"#), 9.81);
    let message = outside.err().unwrap().to_string();
    assert!(message.contains("`follower` follows `leader` to 5.3"), "{message}");
}

#[test]
fn connected_and_welded_bodies_stay_together() {
    // A pendulum whose end is connected to a slider: a crank; and a load welded to the slider.
    let model = scene(
        "crank",
        r#"<body name="crank"><joint name="jc" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/></body>
           <body name="rod" pos=".3 0 0"><joint name="jr" axis="0 1 0"/>
             <geom type="capsule" fromto="0 0 0 .5 0 0" size=".02" contype="0" conaffinity="0"/></body>
           <body name="load" pos="2 0 0"><freejoint/><geom size=".1" mass="2"/></body>
           <body name="slider" pos="1 0 0"><joint name="js" type="slide" axis="1 0 0"/><geom size=".1" mass="1"/></body>"#,
        r#"<equality><weld name="hold" body1="slider" body2="load"/>
           <connect name="pin" body1="crank" body2="slider" anchor=".3 0 0"/></equality>"#,
    );
    // The slider is held where the crank ends: the crank cannot turn without pulling it.
    let mut fixture = Fixture::new(&format!(r#"{{"model": "{model}", "motor": "off"}}"#), 9.81, 1e-3);
    (0..500).for_each(|_| fixture.free_step());
    let (slider, load) = (fixture.get("slider.x"), fixture.get("load.x"));
    assert!((load - slider - 1.0).abs() < 1e-9, "{slider} {load}");
    // The pin binds the end of the crank to the slider's height 0: the crank stays level.
    assert!(
        fixture.get("jc.angle").abs() < 1e-9 && fixture.get("jr.angle") > 1.0,
        "{}",
        fixture.get("jr.angle")
    );
    assert!(fixture.get("hold.force") > 19.0);
}

#[test]
fn a_body_on_two_hinges_swings_as_on_a_universal_joint() {
    let body = |joints: &str| {
        format!(
            r#"<body name="a">{joints}<inertial pos="0.3 0.2 -0.4" mass="2" diaginertia="0.05 0.06 0.03"/></body>"#
        )
    };
    let hinges = body(r#"<joint name="jx" axis="1 0 0"/><joint name="jz" axis="0 0 1"/>"#);
    let (two, one) = (
        scene("two_hinges", &hinges, ""),
        scene("universal", &body(r#"<joint name="j" axis="1 0 0"/>"#), ""),
    );
    let kind = r#", "joint_kind": {"j": "universal"}"#;
    let places = [(two, ""), (one, kind)].map(|(model, more)| {
        let mut fixture =
            Fixture::new(&format!(r#"{{"model": "{model}", "motor": "off"{more}}}"#), 9.81, 1e-3);
        (0..1000).for_each(|_| fixture.free_step());
        ["a.roll", "a.pitch", "a.yaw"].map(|name| fixture.get(name))
    });
    // It swings far, and the body between the hinges weighs a millionth.
    assert!(places[1][0].abs() > 0.2 && places[1][2].abs() > 0.2, "{places:?}");
    for (ours, exact) in places[0].iter().zip(&places[1]) {
        assert!((ours - exact).abs() < 1e-4, "{places:?}");
    }
}
