//! Motors at their bounds, torque loss, block, breakage, limits, state.
#![allow(clippy::unwrap_used, missing_docs)]

mod common;
use common::{MOON, Rig, temporary_urdf};
use terraglue_subsystem::{Values, ValuesMut};

fn walk_in_place(rig: &mut Rig, steps: usize) -> Vec<f64> {
    let mut changes = Vec::new();
    for _ in 0..steps {
        for (k, leg) in ["LF", "LM", "LR", "RF", "RM", "RR"].iter().enumerate() {
            let lift = 0.1 * libm::sin(8.0 * rig.t + k as f64 * std::f64::consts::PI) * rig.t.min(1.0);
            rig.set(&format!("{leg}_j2.angle_target"), 0.958192179 + lift);
        }
        let before = rig.balance();
        rig.ground_step();
        changes.push((rig.balance() - before).abs());
    }
    changes
}

fn median(mut v: Vec<f64>) -> f64 {
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}

#[test]
fn torque_is_bounded_exactly_and_zero_means_zero() {
    let mut rig = Rig::hexapod(0.33, 9.81, 1e-3);
    for joint in rig.joints() {
        rig.set(&format!("{joint}.max_torque"), 5.0);
    }
    let mut saturated = 0;
    for _ in 0..200 {
        rig.ground_step();
        for joint in rig.joints() {
            let torque = rig.get(&format!("{joint}.torque")).abs();
            assert!(torque <= 5.0);
            saturated += usize::from(torque == 5.0);
        }
    }
    assert!(saturated > 100, "{saturated}");
    rig.set("LF_j2.max_torque", 0.0);
    for _ in 0..20 {
        rig.ground_step();
        assert_eq!(rig.get("LF_j2.torque"), 0.0);
    }
}

#[test]
fn a_fault_puts_no_energy_in() {
    for fault in ["torque", "break", "block"] {
        let mut rig = Rig::hexapod(0.33, MOON, 1e-3);
        let changes = walk_in_place(&mut rig, 500);
        let usual = median(changes[400..].to_vec());
        match fault {
            "torque" => {
                rig.set("LF_j2.max_torque", 0.0);
                rig.set("LF_j3.max_torque", 0.0);
            }
            "break" => rig.robot.act("LF_j2.break", "{}").unwrap(),
            _ => rig.robot.act("LF_j3.block", "{}").unwrap(),
        }
        let before = rig.balance();
        walk_in_place(&mut rig, 1);
        let gain = rig.balance() - before;
        // beside what a step changes in the book as a rule, rounding of the energies, about 10 J
        assert!(gain <= 3.0 * usual && gain.abs() <= 3.0 * usual + 1e-8, "{fault}: {gain} {usual}");
    }
}

#[test]
fn a_broken_leg_falls_away_and_the_body_stays_up() {
    let mut rig = Rig::hexapod(0.33, 9.81, 1e-3);
    walk_in_place(&mut rig, 200);
    rig.robot.act("LF_j2.break", "{}").unwrap();
    let mut broken = [false];
    rig.robot.get(&[rig.id("LF_j2.broken")], ValuesMut::Bool(&mut broken)).unwrap();
    assert!(broken[0]);
    walk_in_place(&mut rig, 1000);
    assert!(
        rig.get("body.z") > 0.25 && rig.get("LF2.z") < 0.33,
        "{} {}",
        rig.get("body.z"),
        rig.get("LF2.z")
    );
    assert!(rig.get("body.roll").abs() < 0.3);
    // The leg lies with its foot on the ground, which still is a contact of it.
    assert!(rig.get("LF4.contact_normal") >= 0.0 && rig.get("LF4.z").is_finite());
    assert_eq!(rig.get("LF_j2.torque"), 0.0);
}

#[test]
fn a_blocked_joint_stays_where_it_is_until_released() {
    let mut rig = Rig::hexapod(0.33, MOON, 1e-3);
    walk_in_place(&mut rig, 300);
    let id = rig.id("LF_j2.blocked");
    rig.robot.set(&[id], Values::Bool(&[true])).unwrap();
    let held = rig.get("LF_j2.angle");
    for _ in 0..10 {
        walk_in_place(&mut rig, 20);
        assert!((rig.get("LF_j2.angle") - held).abs() < 1e-6, "{}", rig.get("LF_j2.angle") - held);
    }
    rig.robot.act("LF_j2.release", "{}").unwrap();
    walk_in_place(&mut rig, 100);
    assert!((rig.get("LF_j2.angle") - held).abs() > 1e-4);
}

fn arm(name: &str, parameters: &str) -> Rig {
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
    Rig::new(&format!(r#"{{"model": "{file}"{parameters}}}"#), 9.81, 1e-3)
}

#[test]
fn limits_hold_and_turn_the_impact_into_heat() {
    let mut rig = arm("limits", r#", "motor": "off""#);
    for _ in 0..2000 {
        rig.free_step();
        assert!(rig.get("hinge.angle") < 0.6 + 1e-6 && rig.get("rail.angle") < 0.1 + 1e-6);
    }
    assert!((rig.get("hinge.angle") - 0.6).abs() < 1e-6 && (rig.get("rail.angle") - 0.1).abs() < 1e-6);
    assert!(rig.robot.energy().dissipated > 0.5);
    assert_eq!(rig.get("hinge.torque"), 0.0);
}

#[test]
fn a_velocity_motor_keeps_its_rate_and_a_torque_motor_its_torque() {
    let mut rig = arm("motors", r#", "motor": "velocity", "max_torque": 50"#);
    rig.set("hinge.velocity_target", -0.4);
    // Under its bound the motor takes a few steps to come up to speed.
    (0..100).for_each(|_| rig.free_step());
    let angle = rig.get("hinge.angle");
    (0..500).for_each(|_| rig.free_step());
    assert!((rig.get("hinge.angle") - angle + 0.2).abs() < 1e-6, "{}", rig.get("hinge.angle") - angle);
    assert!(rig.get("rail.angle").abs() < 1e-6);
    rig.motor("hinge", 3);
    rig.set("hinge.torque_target", -3.0);
    rig.free_step();
    assert_eq!(rig.get("hinge.torque"), -3.0);
    rig.motor("hinge", 0);
    rig.free_step();
    assert_eq!(rig.get("hinge.torque"), 0.0);
}

#[test]
fn a_position_motor_holds_by_its_law() {
    let mut rig = arm("position", r#", "max_torque": 100"#);
    (0..3000).for_each(|_| rig.free_step());
    let law = 600.0 * (0.0 - rig.get("hinge.angle")) - 10.0 * rig.get("hinge.velocity");
    assert!((rig.get("hinge.torque") - law).abs() < 1e-6, "{} {law}", rig.get("hinge.torque"));
    // At rest the motor carries the arm and the slide: about (1·0.5 + 0.5·1)·g.
    assert!((rig.get("hinge.torque") + 9.81).abs() < 0.1);
}

#[test]
fn a_restored_state_repeats_the_run_bit_by_bit() {
    let mut rig = Rig::hexapod(0.33, MOON, 1e-3);
    walk_in_place(&mut rig, 50);
    rig.robot.save_state(1).unwrap();
    let t = rig.t;
    walk_in_place(&mut rig, 50);
    // as text, where what is unknown is the same as itself
    let energy = |rig: &Rig| format!("{:?}", rig.robot.energy());
    let first = (rig.states(), energy(&rig));
    rig.robot.restore_state(1).unwrap();
    rig.t = t;
    walk_in_place(&mut rig, 50);
    assert_eq!((rig.states(), energy(&rig)), first);
    assert!(rig.robot.restore_state(3).is_err());
}

#[test]
fn what_cannot_be_set_is_refused() {
    let mut rig = Rig::hexapod(0.33, MOON, 1e-3);
    let (x, bound, motor) =
        (rig.id("body.contact_normal"), rig.id("LF_j1.max_torque"), rig.id("LF_j1.motor"));
    assert!(rig.robot.set(&[x], Values::F64(&[1.0])).is_err());
    assert!(rig.robot.set(&[bound], Values::F64(&[-1.0])).is_err());
    assert!(rig.robot.set(&[bound], Values::F64(&[f64::NAN])).is_err());
    assert!(rig.robot.set(&[motor], Values::Enumeration(&[7])).is_err());
    assert!(rig.robot.act("LF_j9.break", "{}").is_err());
    assert!(rig.commit(&[], &[]).is_err());
    // All or nothing, and nothing on what is gone.
    let before = rig.get("LF_j1.max_torque");
    assert!(rig.robot.set(&[bound, x], Values::F64(&[1.0, 1.0])).is_err());
    assert_eq!(rig.get("LF_j1.max_torque"), before);
    rig.robot.act("LF_j1.break", "{}").unwrap();
    assert!(rig.robot.act("LF_j1.block", "{}").is_err());
}

/// A body of 1 kg on a vertical rail above its lower limit.
fn drop_on_a_stop(name: &str, upper: f64, parameters: &str) -> Rig {
    let file = temporary_urdf(
        name,
        &format!(
            r#"<robot name="drop"><link name="world"/><link name="body"><inertial><mass value="1"/>
            <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="rail" type="prismatic"><parent link="world"/><child link="body"/><axis xyz="0 0 1"/>
            <limit lower="0" upper="{upper}" effort="1" velocity="1"/></joint></robot>"#
        ),
    );
    Rig::new(&format!(r#"{{"model": "{file}", "motor": "off"{parameters}}}"#), 9.81, 1e-3)
}

#[test]
fn a_joint_bounces_off_its_limit_and_comes_to_rest() {
    let bouncy = r#", "joints": {"rail": 1.0}, "actuator": {"limit_restitution": 0.8}"#;
    let mut rig = drop_on_a_stop("bounce", 5.0, bouncy);
    let (mut apexes, mut last, mut rising) = (Vec::new(), 1.0, false);
    for _ in 0..2500 {
        rig.free_step();
        let height = rig.get("rail.angle");
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
    (0..3000).for_each(|_| rig.free_step());
    assert!(rig.get("rail.angle").abs() < 1e-9 && rig.get("rail.velocity").abs() < 1e-9);
    let lost = rig.robot.energy().dissipated;
    assert!((lost - 9.81).abs() < 0.03 * 9.81, "{lost}");
}

#[test]
fn play_narrower_than_a_step_stays_within_its_limits() {
    let elastic = r#", "joint_rates": {"rail": 1.0}, "actuator": {"limit_restitution": 1.0}"#;
    let mut rig = drop_on_a_stop("play", 1e-4, elastic);
    for _ in 0..2000 {
        rig.free_step();
        let (x, v) = (rig.get("rail.angle"), rig.get("rail.velocity"));
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
