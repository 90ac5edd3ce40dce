//! Several robots and things in one subsystem: they touch, keep their names and stay where the scenario puts them.

use crate::common;
use common::{Fixture, STAND, instantiate, temporary_urdf};

const G: f64 = 9.81;

fn brick(name: &str) -> String {
    let text = r#"<robot name="brick"><link name="brick"><inertial><mass value="2"/>
        <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>"#;
    temporary_urdf(&format!("object-{name}"), text)
}

#[test]
fn a_ball_comes_to_rest_on_a_brick_that_stands_on_the_ground() {
    let (ball, brick) = (common::ball("on-brick"), brick("below"));
    let mut fixture = Fixture::new(
        &format!(
            r#"{{"model": "{ball}", "position_m": [0, 0, 0.3], "velocity_m_s": [0, 0, -0.5], "ground": "half-space",
            "object": [{{"name": "stone", "model": "{brick}", "position_m": [0, 0, 0.1], "heading_rad": 0.7}},
                       {{"name": "post", "model": "{brick}", "position_m": [1, 0, 2], "fixed_base": true}}]}}"#
        ),
        G,
        1e-3,
    );
    let names: Vec<&str> = fixture.scene.bodies.iter().map(|b| b.name.as_str()).collect();
    assert_eq!(names, ["ball", "stone/brick", "post/brick"]);
    assert_eq!(fixture.states()[1].linear_velocity, [0.0; 3]);
    (0..1000).for_each(|_| fixture.free_step());
    assert!((fixture.get("ball.z") - 0.23).abs() < 1e-5, "{}", fixture.get("ball.z"));
    assert!((fixture.get("stone/brick.yaw") - 0.7).abs() < 1e-6);
    // The brick carries the ball and itself: 5 kg above, 5 + 2 kg below.
    assert!((fixture.get("stone/brick.contact_normal") / (12.0 * G) - 1.0).abs() < 1e-3);
    assert!((fixture.get("post/brick.z") - 2.0).abs() < 1e-12);
}

#[test]
fn two_robots_meet() {
    let hexapod = r#""model": "models/hexapod.urdf", "position_m": [0, 0, 0.33], "ground": "half-space""#;
    let mut fixture = Fixture::new(
        &format!(
            r#"{{{hexapod}, {STAND}, "object": [{{"name": "second", "model": "models/hexapod.urdf",
            "position_m": [0, 0, 1.2], "heading_rad": 1}}]}}"#
        ),
        G,
        1e-3,
    );
    assert_eq!(fixture.scene.bodies.len(), 50);
    fixture.get("second/LF_j2.angle");
    // The second one falls on the first: nothing of it comes to the ground before half a second.
    (0..450).for_each(|_| fixture.free_step());
    let (first, second) = (fixture.get("body.z"), fixture.get("second/body.z"));
    assert!(second > first && second < 1.0, "{first} {second}");
    assert!(fixture.get("body.contact_normal") > 0.0 || fixture.get("contact.points") > 6.0);
}

#[test]
fn objects_that_make_no_sense_are_refused() {
    let ball = common::ball("refusing");
    let refused = |object: &str, expected: &[&str]| {
        let message =
            instantiate(&format!(r#"{{"model": "{ball}", "object": [{object}]}}"#), G).err().unwrap();
        let message = message.to_string();
        expected.iter().for_each(|e| assert!(message.contains(e), "`{e}` is not in: {message}"));
    };
    refused(r#"{"model": "x.urdf"}"#, &["`object` number 1", "`name`"]);
    refused(r#"{"name": "a.b", "model": "x.urdf"}"#, &["`a.b`", ". / *"]);
    refused(r#"{"name": "a", "model": "x.urdf"}"#, &["x.urdf", "cannot be read"]);
    refused(r#"{"name": "a"}"#, &["(`a`)", "`model`"]);
    refused(r#"{"name": "a", "modell": "x"}"#, &["modell", "unknown key"]);
    let good = format!(r#"{{"name": "a", "model": "{ball}", "fixed_base": 1}}"#);
    refused(&good, &["`fixed_base`", "true or false"]);
    let good = good.replace(", \"fixed_base\": 1", "");
    refused(&format!("{good}, {good}"), &["number 2", "used twice"]);
}
