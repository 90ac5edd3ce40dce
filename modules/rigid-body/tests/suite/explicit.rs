//! Explicit PD control is stable up to its limit, and refused with a way out beyond it.

use crate::common;
use common::{Fixture, STAND, temporary_urdf};
use terraglue_subsystem::{Input, Response};

/// A wheel of 0.1 kg m² on an axle that stands still.
fn wheel(damping: f64, stiffness: f64) -> Fixture {
    let text = r#"<robot name="r"><link name="world"/><link name="w"><inertial><mass value="1"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="j" type="continuous"><parent link="world"/><child link="w"/><axis xyz="0 0 1"/></joint></robot>"#;
    let model = temporary_urdf("explicit-wheel", text);
    Fixture::new(
        &format!(
            r#"{{"model": "{model}", "motor": "explicit-position", "damping": {damping}, "stiffness": {stiffness},
            "max_torque": 1e9, "joint_rates": {{"j": 1}}}}"#
        ),
        9.81,
        1e-3,
    )
}

fn message(fixture: &mut Fixture) -> Option<String> {
    let mut none: [f64; 0] = [];
    let (mut x, mut v, mut a) = ([], [], []);
    let step = fixture.step(&[]);
    let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut none, reached: f64::NAN, flags: 0 };
    let input = Input::Force { t: &[], motion: None };
    fixture.robot.advance(&step, &input, &mut out).err().map(|e| e.to_string())
}

#[test]
fn up_to_the_limit_it_is_stable_and_beyond_it_is_refused() {
    // h·(2·kd + h·kp) < 4·I = 0.4.
    for (damping, stiffness) in [(198.0, 1e3), (10.0, 3.7e5), (0.5, 50.0)] {
        let mut fixture = wheel(damping, stiffness);
        (0..3000).for_each(|_| fixture.free_step());
        let rate = fixture.get("j.velocity");
        assert!(rate.abs() < 1e-3, "{damping} {stiffness}: {rate}");
    }
    for (damping, stiffness) in [(201.0, 0.0), (1.0, 4e5)] {
        let text = message(&mut wheel(damping, stiffness)).unwrap();
        for expected in ["joint `j`", "0.001 s", "less than 0.99", "motor = \"position\""] {
            assert!(text.contains(expected), "`{expected}` is not in: {text}");
        }
    }
}

#[test]
fn joints_together_are_less_stable_than_each_alone() {
    let hexapod = |damping: f64| {
        Fixture::new(
            &format!(
                r#"{{"model": "models/hexapod.urdf", "position_m": [0, 0, 1], {STAND}, "motor": "explicit-position",
                "damping": {damping}, "stiffness": 100}}"#
            ),
            0.0,
            1e-3,
        )
    };
    let text = message(&mut hexapod(10.0)).unwrap();
    let share: f64 = text.split("less than ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    println!("{text}");
    assert!(share > 0.1 && share < 1.0, "{text}");
    // Just below the share that the message names it runs and comes to rest.
    let mut fixture = hexapod(0.95 * share * 10.0);
    fixture.set("LF_j2.angle_target", 1.0);
    (0..3000).for_each(|_| fixture.free_step());
    assert!(fixture.get("LF_j2.velocity").abs() < 1e-2, "{}", fixture.get("LF_j2.velocity"));
    let mut live = hexapod(0.5);
    live.free_step();
    live.set("RF_j4.damping", 1e3);
    assert!(message(&mut live).unwrap().contains("`RF_j4`"));
}
