//! Poses, coordinates and rates set by name before the first step give the robot that parameters give.

use crate::common;
use common::Fixture;
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{Effect, Values};

const G: f64 = 9.81;

fn hexapod(more: &str) -> Fixture {
    Fixture::new(&format!(r#"{{"model": "models/hexapod.urdf" {more}}}"#), G, 1e-3)
}

fn farthest(a: &Fixture, b: &Fixture) -> f64 {
    let apart = |(a, b): (&terraglue_subsystem::BodyState, &terraglue_subsystem::BodyState)| {
        let (p, q) = (a.world_from_body, b.world_from_body);
        let place = (0..3).map(|k| (p.position[k] - q.position[k]).abs()).fold(0.0, larger);
        let speed = |k: usize| {
            let spin = (a.angular_velocity[k] - b.angular_velocity[k]).abs();
            larger(spin, (a.linear_velocity[k] - b.linear_velocity[k]).abs())
        };
        let turn = (0..4).map(|k| (p.orientation[k] - q.orientation[k]).abs()).fold(0.0, larger);
        (0..3).map(speed).fold(larger(place, turn), larger)
    };
    a.states().iter().zip(&b.states()).map(apart).fold(0.0, larger)
}

#[test]
fn what_is_set_before_the_start_is_what_parameters_give() {
    let mut wanted = hexapod(
        r#", "position_m": [0.4, -0.2, 1.5], "heading_rad": 0.7, "velocity_m_s": [0.3, 0.1, -0.2],
        "rotation_rate_rad_s": [0, 0, 0.5], "joints": {"LF_j2": 0.6}, "joint_rates": {"LF_j3": 1.5}"#,
    );
    let mut fixture = hexapod("");
    for (name, value) in [
        ("body.x", 0.4),
        ("body.y", -0.2),
        ("body.z", 1.5),
        ("body.yaw", 0.7),
        ("body.vx", 0.3),
        ("body.vy", 0.1),
        ("body.vz", -0.2),
        ("body.wz", 0.5),
        ("LF_j2.angle", 0.6),
        ("LF_j3.velocity", 1.5),
    ] {
        fixture.set(name, value);
        assert!((fixture.get(name) - value).abs() < 1e-12, "{name} reads {}", fixture.get(name));
    }
    assert!(farthest(&fixture, &wanted) < 1e-12, "{:e}", farthest(&fixture, &wanted));
    assert_eq!(fixture.get("LF_j2.angle_target"), 0.6);
    for _ in 0..100 {
        fixture.free_step();
        wanted.free_step();
    }
    assert!(farthest(&fixture, &wanted) < 1e-9, "{:e}", farthest(&fixture, &wanted));
}

#[test]
fn any_orientation_can_be_given_by_its_angles() {
    let mut fixture = hexapod("");
    for (name, value) in [("body.yaw", -2.5), ("body.pitch", 1.1), ("body.roll", 2.9)] {
        fixture.set(name, value);
    }
    for (name, value) in [("body.yaw", -2.5), ("body.pitch", 1.1), ("body.roll", 2.9)] {
        assert!((fixture.get(name) - value).abs() < 1e-12, "{name} reads {}", fixture.get(name));
    }
}

#[test]
fn what_follows_from_joints_and_what_comes_late_is_refused_and_changes_nothing() {
    let mut fixture = hexapod("");
    let refused = |fixture: &mut Fixture, name: &str, value: f64, why: &str| {
        let (id, before) = (fixture.id(name), fixture.get(name));
        let said = fixture.robot.set(&[id], Values::F64(&[value])).expect_err("refused").to_string();
        assert!(said.contains(why), "{name}: {said}");
        assert_eq!(fixture.get(name).to_bits(), before.to_bits());
    };
    refused(&mut fixture, "LF4.z", 1.0, "its joints");
    refused(&mut fixture, "body.pitch", 2.0, "beyond");
    refused(&mut fixture, "LF_j2.angle", 9.0, "limits");
    refused(&mut fixture, "body.contact_normal", 1.0, "read only");
    let effect = |fixture: &Fixture, name: &str| {
        fixture.robot.variables().iter().find(|v| v.name == name).unwrap().effect
    };
    assert_eq!(effect(&fixture, "body.z"), Effect::NeedsReset);
    assert_eq!(effect(&fixture, "LF_j2.velocity"), Effect::NeedsReset);
    assert_eq!(effect(&fixture, "LF4.z"), Effect::ReadOnly);
    fixture.free_step();
    refused(&mut fixture, "body.z", 1.0, "before the first step");
    refused(&mut fixture, "LF_j2.angle", 0.1, "before the first step");
}

#[test]
fn a_joint_whose_range_has_no_zero_starts_at_its_end() {
    for motor in ["position", "velocity", "torque", "off"] {
        let json = format!(r#"{{"model": "models/harvester.urdf", "motor": {{"*": "{motor}"}}}}"#);
        let mut fixture = Fixture::new(&json, G, 1e-3);
        assert_eq!(fixture.get("luff.angle"), 0.2);
        (0..20).for_each(|_| fixture.free_step());
        assert!((fixture.get("luff.angle") - 0.2).abs() < 0.05, "{}", fixture.get("luff.angle"));
    }
}
