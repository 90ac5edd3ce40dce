//! Motors at their bounds, torque loss, block, breakage, limits, state.

use crate::common;
use common::{Fixture, MOON, temporary_urdf};
use terraglue_subsystem::{Values, ValuesMut};

fn walk_in_place(fixture: &mut Fixture, steps: usize) -> Vec<f64> {
    let mut changes = Vec::new();
    for _ in 0..steps {
        for (k, leg) in ["LF", "LM", "LR", "RF", "RM", "RR"].iter().enumerate() {
            let lift =
                0.1 * libm::sin(8.0 * fixture.t + k as f64 * std::f64::consts::PI) * fixture.t.min(1.0);
            fixture.set(&format!("{leg}_j2.angle_target"), 0.958192179 + lift);
        }
        let before = fixture.balance();
        fixture.ground_step();
        changes.push((fixture.balance() - before).abs());
    }
    changes
}

fn median(mut v: Vec<f64>) -> f64 {
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}

#[test]
fn torque_is_bounded_exactly_and_zero_means_zero() {
    let mut fixture = Fixture::hexapod(0.33, 9.81, 1e-3);
    for joint in fixture.joints() {
        fixture.set(&format!("{joint}.max_torque"), 5.0);
    }
    let mut saturated = 0;
    for _ in 0..200 {
        fixture.ground_step();
        for joint in fixture.joints() {
            let torque = fixture.get(&format!("{joint}.torque")).abs();
            assert!(torque <= 5.0);
            saturated += usize::from(torque == 5.0);
        }
    }
    assert!(saturated > 100, "{saturated}");
    fixture.set("LF_j2.max_torque", 0.0);
    for _ in 0..20 {
        fixture.ground_step();
        assert_eq!(fixture.get("LF_j2.torque"), 0.0);
    }
}

#[test]
fn a_fault_puts_no_energy_in() {
    for fault in ["torque", "break", "block"] {
        let mut fixture = Fixture::hexapod(0.33, MOON, 1e-3);
        let changes = walk_in_place(&mut fixture, 500);
        let usual = median(changes[400..].to_vec());
        match fault {
            "torque" => {
                fixture.set("LF_j2.max_torque", 0.0);
                fixture.set("LF_j3.max_torque", 0.0);
            }
            "break" => fixture.robot.act("LF_j2.break", "{}").unwrap(),
            _ => fixture.robot.act("LF_j3.block", "{}").unwrap(),
        }
        let before = fixture.balance();
        walk_in_place(&mut fixture, 1);
        let gain = fixture.balance() - before;
        // besides the usual change of the ledger in a step, rounding of the energies, about 10 J
        assert!(gain <= 3.0 * usual && gain.abs() <= 3.0 * usual + 1e-8, "{fault}: {gain} {usual}");
    }
}

#[test]
fn a_broken_leg_falls_away_and_the_body_stays_up() {
    let mut fixture = Fixture::hexapod(0.33, 9.81, 1e-3);
    walk_in_place(&mut fixture, 200);
    fixture.robot.act("LF_j2.break", "{}").unwrap();
    let mut broken = [false];
    fixture.robot.get(&[fixture.id("LF_j2.broken")], ValuesMut::Bool(&mut broken)).unwrap();
    assert!(broken[0]);
    walk_in_place(&mut fixture, 1000);
    assert!(
        fixture.get("body.z") > 0.25 && fixture.get("LF2.z") < 0.33,
        "{} {}",
        fixture.get("body.z"),
        fixture.get("LF2.z")
    );
    assert!(fixture.get("body.roll").abs() < 0.3);
    // The leg lies with its foot on the ground, which still is a contact of it.
    assert!(fixture.get("LF4.contact_normal") >= 0.0 && fixture.get("LF4.z").is_finite());
    assert_eq!(fixture.get("LF_j2.torque"), 0.0);
}

#[test]
fn a_blocked_joint_stays_where_it_is_until_released() {
    let mut fixture = Fixture::hexapod(0.33, MOON, 1e-3);
    walk_in_place(&mut fixture, 300);
    let id = fixture.id("LF_j2.blocked");
    fixture.robot.set(&[id], Values::Bool(&[true])).unwrap();
    let held = fixture.get("LF_j2.angle");
    for _ in 0..10 {
        walk_in_place(&mut fixture, 20);
        assert!((fixture.get("LF_j2.angle") - held).abs() < 1e-6, "{}", fixture.get("LF_j2.angle") - held);
    }
    fixture.robot.act("LF_j2.release", "{}").unwrap();
    walk_in_place(&mut fixture, 100);
    assert!((fixture.get("LF_j2.angle") - held).abs() > 1e-4);
}

fn arm(name: &str, parameters: &str) -> Fixture {
    let file = temporary_urdf(
        name,
        r#"<robot name="arm"><link name="world"/><link name="arm">
        <inertial><origin xyz="0.5 0 0"/><mass value="1"/>
        <inertia ixx="0.01" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <link name="slide"><inertial><mass value="0.5"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="hinge" type="revolute"><parent link="world"/><child link="arm"/><axis xyz="0 1 0"/>
        <limit lower="-0.5" upper="0.6" effort="1" velocity="1"/></joint>
        <joint name="rail" type="prismatic"><origin xyz="1 0 0"/><parent link="arm"/><child link="slide"/>
        <axis xyz="1 0 0"/><limit lower="-0.2" upper="0.1" effort="1" velocity="1"/></joint></robot>"#,
    );
    Fixture::new(&format!(r#"{{"model": "{file}"{parameters}}}"#), 9.81, 1e-3)
}

#[test]
fn limits_hold_and_turn_the_impact_into_heat() {
    let mut fixture = arm("limits", r#", "motor": "off""#);
    for _ in 0..2000 {
        fixture.free_step();
        assert!(fixture.get("hinge.angle") < 0.6 + 1e-6 && fixture.get("rail.angle") < 0.1 + 1e-6);
    }
    assert!(
        (fixture.get("hinge.angle") - 0.6).abs() < 1e-6 && (fixture.get("rail.angle") - 0.1).abs() < 1e-6
    );
    assert!(fixture.robot.energy().dissipated > 0.5);
    assert_eq!(fixture.get("hinge.torque"), 0.0);
}

#[test]
fn a_velocity_motor_keeps_its_rate_and_a_torque_motor_its_torque() {
    let mut fixture = arm("motors", r#", "motor": "velocity", "max_torque": 50"#);
    fixture.set("hinge.velocity_target", -0.4);
    // Under its bound the motor takes a few steps to come up to speed.
    (0..100).for_each(|_| fixture.free_step());
    let angle = fixture.get("hinge.angle");
    (0..500).for_each(|_| fixture.free_step());
    assert!(
        (fixture.get("hinge.angle") - angle + 0.2).abs() < 1e-6,
        "{}",
        fixture.get("hinge.angle") - angle
    );
    assert!(fixture.get("rail.angle").abs() < 1e-6);
    fixture.motor("hinge", 3);
    fixture.set("hinge.torque_target", -3.0);
    fixture.free_step();
    assert_eq!(fixture.get("hinge.torque"), -3.0);
    fixture.motor("hinge", 0);
    fixture.free_step();
    assert_eq!(fixture.get("hinge.torque"), 0.0);
}

#[test]
fn a_position_motor_holds_by_its_law() {
    let mut fixture = arm("position", r#", "max_torque": 100"#);
    (0..3000).for_each(|_| fixture.free_step());
    let law = 600.0 * (0.0 - fixture.get("hinge.angle")) - 10.0 * fixture.get("hinge.velocity");
    assert!((fixture.get("hinge.torque") - law).abs() < 1e-6, "{} {law}", fixture.get("hinge.torque"));
    // At rest the motor carries the arm and the slide: about (1·0.5 + 0.5·1)·g.
    assert!((fixture.get("hinge.torque") + 9.81).abs() < 0.1);
}

#[test]
fn a_restored_state_repeats_the_run_bit_by_bit() {
    let mut fixture = Fixture::hexapod(0.33, MOON, 1e-3);
    walk_in_place(&mut fixture, 50);
    fixture.robot.save_state(1).unwrap();
    let t = fixture.t;
    walk_in_place(&mut fixture, 50);
    // as text, in which an unknown energy equals itself
    let energy = |fixture: &Fixture| format!("{:?}", fixture.robot.energy());
    let first = (fixture.states(), energy(&fixture));
    fixture.robot.restore_state(1).unwrap();
    fixture.t = t;
    walk_in_place(&mut fixture, 50);
    assert_eq!((fixture.states(), energy(&fixture)), first);
    assert!(fixture.robot.restore_state(3).is_err());
}

#[test]
fn what_cannot_be_set_is_refused() {
    let mut fixture = Fixture::hexapod(0.33, MOON, 1e-3);
    let (x, bound, motor) =
        (fixture.id("body.contact_normal"), fixture.id("LF_j1.max_torque"), fixture.id("LF_j1.motor"));
    assert!(fixture.robot.set(&[x], Values::F64(&[1.0])).is_err());
    assert!(fixture.robot.set(&[bound], Values::F64(&[-1.0])).is_err());
    assert!(fixture.robot.set(&[bound], Values::F64(&[f64::NAN])).is_err());
    assert!(fixture.robot.set(&[motor], Values::Enumeration(&[7])).is_err());
    assert!(fixture.robot.act("LF_j9.break", "{}").is_err());
    assert!(fixture.commit(&[], &[]).is_err());
    // All or nothing, and nothing on a part that is gone.
    let before = fixture.get("LF_j1.max_torque");
    assert!(fixture.robot.set(&[bound, x], Values::F64(&[1.0, 1.0])).is_err());
    assert_eq!(fixture.get("LF_j1.max_torque"), before);
    fixture.robot.act("LF_j1.break", "{}").unwrap();
    assert!(fixture.robot.act("LF_j1.block", "{}").is_err());
}

/// A body of 1 kg on a vertical rail above its lower limit.
fn drop_on_a_stop(name: &str, upper: f64, parameters: &str) -> Fixture {
    let file = temporary_urdf(
        name,
        &format!(
            r#"<robot name="drop"><link name="world"/><link name="body"><inertial><mass value="1"/>
            <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="rail" type="prismatic"><parent link="world"/><child link="body"/><axis xyz="0 0 1"/>
            <limit lower="0" upper="{upper}" effort="1" velocity="1"/></joint></robot>"#
        ),
    );
    Fixture::new(&format!(r#"{{"model": "{file}", "motor": "off"{parameters}}}"#), 9.81, 1e-3)
}

#[test]
fn a_joint_bounces_off_its_limit_and_comes_to_rest() {
    let bouncy = r#", "joints": {"rail": 1.0}, "actuator": {"limit_restitution": 0.8}"#;
    let mut fixture = drop_on_a_stop("bounce", 5.0, bouncy);
    let (mut apexes, mut last, mut rising) = (Vec::new(), 1.0, false);
    for _ in 0..2500 {
        fixture.free_step();
        let height = fixture.get("rail.angle");
        assert!(height > -1e-12, "{height}");
        if rising && height < last {
            apexes.push(last);
        }
        (rising, last) = (height > last, height);
    }
    // The stop is met up to a step before or after the limit, at 4.43 m/s first: 4.4 mm.
    for (n, apex) in apexes[..3].iter().enumerate() {
        let exact = 0.64_f64.powi(n as i32 + 1);
        assert!((apex - exact).abs() < 0.009, "{n}: {apex} {exact}");
    }
    // All bounces take 4.06 s.
    (0..3000).for_each(|_| fixture.free_step());
    assert!(fixture.get("rail.angle").abs() < 1e-9 && fixture.get("rail.velocity").abs() < 1e-9);
    let lost = fixture.robot.energy().dissipated;
    assert!((lost - 9.81).abs() < 0.03 * 9.81, "{lost}");
}

#[test]
fn play_narrower_than_a_step_stays_within_its_limits() {
    let elastic = r#", "joint_rates": {"rail": 1.0}, "actuator": {"limit_restitution": 1.0}"#;
    let mut fixture = drop_on_a_stop("play", 1e-4, elastic);
    for _ in 0..2000 {
        fixture.free_step();
        let (x, v) = (fixture.get("rail.angle"), fixture.get("rail.velocity"));
        assert!((-1e-12..1e-4 + 1e-12).contains(&x) && v.abs() < 1.0 + 1e-9, "{x} {v}");
    }
}

#[test]
fn rebound_is_refused_where_there_are_no_impulses() {
    let text = |e: f64| {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/hexapod.urdf");
        format!(
            r#"{{"model": "{}", "integrator": "generalized-alpha", "actuator": {{"limit_restitution": {e}}}}}"#,
            file.display()
        )
    };
    let refusal = |e: f64| common::instantiate(&text(e), 9.81).err().unwrap().to_string();
    let message = refusal(0.5);
    assert!(message.contains("limit_restitution") && message.contains("LF_j1"), "{message}");
    assert!(refusal(1.5).contains("out of range"));
}
