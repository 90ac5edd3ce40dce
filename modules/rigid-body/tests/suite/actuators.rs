//! Actuators against closed forms: a rotor on a vertical axis without gravity, h = 1 ms.

use crate::common;
use common::{Fixture, temporary_urdf};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::Values;

const INERTIA: f64 = 0.02;
const MOTOR: &str = r#""kind": "dc", "gear_ratio": 50, "winding_resistance": 0.8, "winding_inductance": 4e-4,
    "torque_constant": 0.04, "max_voltage": 24, "resistance_temperature_coefficient": 0"#;

/// A rotor; `actuator` and `more` are JSON members of the actuator and of the robot.
fn rotor(name: &str, actuator: &str, more: &str) -> Fixture {
    let file = temporary_urdf(
        name,
        r#"<robot name="rotor"><link name="world"/><link name="rotor"><inertial><mass value="1"/>
        <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="j" type="continuous"><parent link="world"/><child link="rotor"/><axis xyz="0 0 1"/></joint></robot>"#,
    );
    let h = 1e-3;
    Fixture::new(&format!(r#"{{"model": "{file}", "actuator": {{{actuator}}}{more}}}"#), 0.0, h)
}

fn steps(fixture: &mut Fixture, n: usize) {
    (0..n).for_each(|_| fixture.free_step());
}

fn close(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs().max(1e-12), "{a} is not {b}");
}

fn block(fixture: &mut Fixture) {
    let id = fixture.id("j.blocked");
    fixture.robot.set(&[id], Values::Bool(&[true])).unwrap();
}

#[test]
fn stall_and_no_load_are_those_of_the_motor() {
    let mut fixture = rotor("stall", MOTOR, r#", "motor": "voltage", "max_torque": 1000"#);
    fixture.set("j.voltage_target", 24.0);
    block(&mut fixture);
    steps(&mut fixture, 50);
    close(fixture.get("j.current"), 24.0 / 0.8, 1e-12);
    close(fixture.get("j.torque"), 50.0 * 0.04 * 30.0, 1e-12);
    let id = fixture.id("j.blocked");
    fixture.robot.set(&[id], Values::Bool(&[false])).unwrap();
    steps(&mut fixture, 500);
    close(fixture.get("j.velocity"), 24.0 / (0.04 * 50.0), 1e-9);
    assert!(fixture.get("j.current").abs() < 1e-7);
}

#[test]
fn the_current_rises_with_the_time_constant_of_the_winding() {
    // L/R = 50 ms; implicit Euler follows 1 − e^(−t/τ) to h/2τ.
    let motor = MOTOR.replace("4e-4", "0.04");
    let mut fixture = rotor("transient", &motor, r#", "motor": "voltage", "max_torque": 1000"#);
    fixture.set("j.voltage_target", 24.0);
    block(&mut fixture);
    for n in 1..=150 {
        fixture.free_step();
        let (t, tau) = (f64::from(n) * 1e-3, 0.05);
        let exact = 30.0 * (1.0 - libm::exp(-t / tau));
        assert!((fixture.get("j.current") - exact).abs() < 30.0 * 0.5 * 1e-3 / tau, "{n}");
        // The result of the scheme itself, exactly.
        close(fixture.get("j.current"), 30.0 * (1.0 - libm::pow(1.0 + 1e-3 / tau, -f64::from(n))), 1e-9);
    }
}

#[test]
fn a_time_constant_far_below_the_step_is_no_trouble() {
    let motor = MOTOR.replace("4e-4", "1e-9");
    let mut fixture = rotor("stiff", &motor, r#", "motor": "position", "max_torque": 1000"#);
    fixture.set("j.angle_target", 0.3);
    steps(&mut fixture, 1500);
    close(fixture.get("j.angle"), 0.3, 1e-9);
}

#[test]
fn a_gear_loses_in_both_directions() {
    let geared = format!(r#"{MOTOR}, "efficiency_driving": 0.8, "efficiency_driven": 0.6"#);
    let mut fixture = rotor("gear", &geared, r#", "motor": "torque", "max_torque": 1000"#);
    fixture.set("j.torque_target", 4.0);
    steps(&mut fixture, 5);
    // A current for 4 N m without a loss drives with 80 % of it …
    close(fixture.get("j.current"), 4.0 / (50.0 * 0.04), 1e-12);
    close(fixture.get("j.torque"), 0.8 * 4.0, 1e-12);
    fixture.set("j.torque_target", -4.0);
    steps(&mut fixture, 1);
    assert!(fixture.get("j.velocity") > 0.0);
    // … and brakes with 1/0.6 of it: the joint has to turn the gear as well.
    close(fixture.get("j.torque"), -4.0 / 0.6, 1e-12);
    assert!(fixture.get("j.gear_heat") > 0.0);
    // At rest the gear holds against anything within its losses.
    let mut fixture = rotor("gear_rest", &geared, r#", "motor": "velocity", "max_torque": 1000"#);
    fixture.set("j.velocity_target", 0.0);
    steps(&mut fixture, 3);
    assert_eq!((fixture.get("j.velocity"), fixture.get("j.current")), (0.0, 0.0));
}

#[test]
fn current_and_voltage_are_limited() {
    let limited = format!(r#"{MOTOR}, "max_current": 5"#);
    let mut fixture = rotor("limits_dc", &limited, r#", "motor": "velocity", "max_torque": 1000"#);
    fixture.set("j.velocity_target", 100.0);
    let mut largest = 0.0_f64;
    for _ in 0..2000 {
        fixture.free_step();
        largest = larger(largest, fixture.get("j.current"));
        assert!(fixture.get("j.voltage").abs() <= 24.0 && fixture.get("j.current").abs() <= 5.0 + 1e-12);
    }
    close(largest, 5.0, 1e-12);
    // 100 rad/s are out of reach: no-load speed.
    close(fixture.get("j.velocity"), 12.0, 1e-6);
    // The knob bounds the torque at the joint whatever the winding could do.
    fixture.set("j.max_torque", 2.0);
    fixture.set("j.velocity_target", -100.0);
    fixture.free_step();
    assert_eq!(fixture.get("j.torque"), -2.0);
}

#[test]
fn electrical_energy_is_work_and_heat_and_what_is_stored() {
    let geared =
        format!(r#"{MOTOR}, "efficiency_driving": 0.8, "efficiency_driven": 0.6, "recuperation": 1"#);
    let residue = |h: f64| {
        let mut fixture = rotor("balance", &geared, r#", "motor": "torque", "max_torque": 1000"#);
        fixture.h = h;
        let n = (0.2 / h).round() as usize;
        for k in 0..n {
            fixture.set("j.torque_target", 2.0 * libm::sin(40.0 * k as f64 * h));
            fixture.free_step();
        }
        let kinetic = 0.5 * INERTIA * libm::pow(fixture.get("j.velocity"), 2.0);
        assert!(
            (fixture.get("j.work") - kinetic).abs() < 1e-5 * kinetic,
            "{} {kinetic}",
            fixture.get("j.work")
        );
        let heat = fixture.get("j.winding_heat") + fixture.get("j.gear_heat");
        assert!(heat > 0.0 && fixture.robot.energy().electrical == fixture.get("j.electrical_energy"));
        // All heat that is not winding or gear is the scheme's.
        (fixture.get("j.motor_heat") - heat).abs() / fixture.get("j.electrical_energy")
    };
    let (coarse, fine) = (residue(1e-3), residue(2.5e-4));
    assert!(coarse < 0.05 && fine < 0.3 * coarse, "{coarse} {fine}");
}

#[test]
fn winding_and_housing_warm_up_with_their_time_constants() {
    let warm = format!(
        r#"{MOTOR}, "winding_heat_capacity": 2, "housing_heat_capacity": 50, "winding_housing_resistance": 0.5,
        "housing_ambient_resistance": 4"#
    );
    let mut fixture = rotor("warm", &warm, r#", "motor": "voltage", "max_torque": 1000"#);
    fixture.set("j.voltage_target", 4.0);
    block(&mut fixture);
    let power = 4.0 * 4.0 / 0.8;
    steps(&mut fixture, 1000);
    let first = fixture.get("j.winding_temperature") - fixture.get("j.housing_temperature");
    fixture.h = 0.5;
    steps(&mut fixture, 8000);
    // After a second the housing has hardly begun: P·R_wh·(1 − e^(−t/(R_wh·C_w))).
    let tau = 0.5 * 2.0;
    close(first, power * 0.5 * (1.0 - libm::exp(-1.0 / tau)), 0.06);
    // In the end: P·R_ha and P·(R_ha + R_wh).
    close(fixture.get("j.housing_temperature") - 293.15, power * 4.0, 1e-3);
    close(fixture.get("j.winding_temperature") - 293.15, power * 4.5, 1e-3);
}

#[test]
fn a_hot_winding_resists_more_and_is_spared() {
    let hot = MOTOR.replace(r#""resistance_temperature_coefficient": 0"#, r#""winding_heat_capacity": 0.5"#);
    let hot = format!(r#"{hot}, "max_winding_temperature": 393.15, "max_current": 20"#);
    let mut fixture = rotor("hot", &hot, r#", "motor": "torque", "max_torque": 1000"#);
    fixture.set("j.torque_target", 30.0);
    block(&mut fixture);
    fixture.free_step();
    close(fixture.get("j.current"), 15.0, 0.2);
    steps(&mut fixture, 5000);
    let t = fixture.get("j.winding_temperature");
    assert!((383.15..393.15).contains(&t), "{t}");
    assert!(fixture.get("j.current") < 10.0);
    let r = 0.8 * (1.0 + 0.00393 * (t - 293.15));
    close(fixture.get("j.voltage"), r * fixture.get("j.current"), 1e-2);
}

#[test]
fn coulomb_friction_sticks_exactly_and_breaks_away_at_its_torque() {
    for (bristles, name) in
        [("", "coulomb"), (r#", "bristle_stiffness": 2000, "bristle_damping": 4"#, "lugre")]
    {
        let friction = format!(r#""coulomb_friction": 1.0, "static_friction": 1.5{bristles}"#);
        let mut fixture = rotor(name, &friction, r#", "motor": "torque", "max_torque": 100"#);
        // Slowly: the torque at which LuGre friction breaks away falls with the rate of the torque.
        for k in 1..=2000 {
            fixture.set("j.torque_target", 1.3 * f64::from(k) / 2000.0);
            fixture.free_step();
        }
        steps(&mut fixture, 200);
        let held = fixture.get("j.angle");
        if bristles.is_empty() {
            assert_eq!((held, fixture.get("j.velocity")), (0.0, 0.0));
        } else {
            // It gives way by no more than the bristles bend (1.3/2000 rad at first, more near the break-away), then stays.
            assert!(held > 1.3 / 2000.0 * 0.9 && held < 2e-2, "{held}");
            assert!(fixture.get("j.velocity").abs() < 1e-3, "{}", fixture.get("j.velocity"));
        }
        close(fixture.get("j.friction_torque"), -1.3, 1e-2);
        fixture.set("j.torque_target", 1.6);
        steps(&mut fixture, 1000);
        // Sliding: acceleration (1.6 − F_c)/I once it has left the Stribeck range.
        let before = fixture.get("j.velocity");
        steps(&mut fixture, 100);
        // Coordinates of a joint that turns by 0.03 rad per step are those of the Cayley map: 1e-3 here.
        close(fixture.get("j.velocity") - before, 0.1 * 0.6 / INERTIA, 1e-3);
        close(fixture.get("j.friction_torque"), -1.0, 1e-9);
        let ledger = fixture.balance();
        fixture.set("j.torque_target", 0.0);
        steps(&mut fixture, 3000);
        assert!(fixture.get("j.velocity").abs() < 1e-9, "{name} {before}: {}", fixture.get("j.velocity"));
        assert!((fixture.balance() - ledger).abs() < 1e-6 * fixture.robot.energy().dissipated);
    }
}

#[test]
fn armature_spring_and_damper_make_the_oscillator_they_should() {
    let parts = r#""armature": 0.03, "spring_stiffness": 5, "spring_reference": 0.2"#;
    let mut fixture = rotor("oscillator", parts, r#", "motor": "off""#);
    fixture.h = 1e-4;
    let omega = (5.0_f64 / (INERTIA + 0.03)).sqrt();
    let ledger = fixture.balance();
    steps(&mut fixture, 1000);
    let exact = 0.2 * (1.0 - libm::cos(omega * 0.1));
    close(fixture.get("j.angle"), exact, 5e-3);
    assert!((fixture.balance() - ledger).abs() < 1e-9);
}

#[test]
fn a_partial_block_slips_above_its_torque_only() {
    let mut fixture = rotor("partial", r#""block_torque": 3"#, r#", "motor": "torque", "max_torque": 100"#);
    block(&mut fixture);
    fixture.set("j.torque_target", 2.99);
    steps(&mut fixture, 1000);
    assert_eq!((fixture.get("j.angle"), fixture.get("j.velocity")), (0.0, 0.0));
    fixture.set("j.torque_target", 4.0);
    steps(&mut fixture, 100);
    close(fixture.get("j.velocity"), 0.1 * 1.0 / INERTIA, 1e-4);
    close(fixture.get("j.stop_torque"), -3.0, 1e-9);
}

#[test]
fn a_rigid_position_motor_takes_its_error_back_in_its_time() {
    let mut fixture = rotor("rigid", "", r#", "motor": "rigid-position", "max_torque": 1e4"#);
    fixture.set("j.angle_target", 0.1);
    fixture.free_step();
    // A tenth of the error per step of 1 ms, to the curvature of a turn of 0.01 rad.
    close(fixture.get("j.angle"), 0.01, 1e-5);
    fixture.free_step();
    close(fixture.get("j.angle"), 0.019, 1e-5);
}

#[test]
fn the_current_formula_of_the_preset_feeds_the_energy_ledger() {
    let mut fixture = rotor(
        "formula",
        r#""preset": "mars-space-climber""#,
        r#", "motor": "torque", "supply": {"voltage": 30}"#,
    );
    fixture.set("j.torque_target", 2.0);
    steps(&mut fixture, 10);
    let w = fixture.get("j.velocity");
    let current = 0.027813 * 2.0 * w + 0.0074559 * 2.0 + 0.057296 * w + 0.025;
    close(fixture.get("j.current"), current, 1e-12);
    close(fixture.get("j.electrical_power"), 30.0 * current, 1e-12);
    close(fixture.get("energy.electrical"), fixture.get("j.electrical_energy"), 1e-12);
    close(fixture.get("energy.motor_work"), fixture.get("j.work"), 1e-12);
}

#[test]
fn what_ideal_motors_draw_is_unknown() {
    let electrical = |name: &str, actuator: &str| {
        let mut fixture = rotor(name, actuator, r#", "motor": "torque""#);
        fixture.set("j.torque_target", 2.0);
        steps(&mut fixture, 10);
        assert!(fixture.robot.energy().is_known() && fixture.robot.energy().actuator_work > 0.0);
        fixture.robot.energy().electrical
    };
    assert!(electrical("without_losses", "").is_nan());
    assert!(electrical("with_losses", r#""preset": "mars-space-climber""#) > 0.0);
}

#[test]
fn a_battery_sags_empties_and_starves_the_motor() {
    let battery = r#", "motor": "voltage", "max_torque": 1000,
        "battery": {"capacity_a_h": 0.01, "internal_resistance": 0.4, "open_circuit_v": [20, 24]}"#;
    let motor = MOTOR.replace(r#""max_voltage": 24"#, r#""max_voltage": 100"#);
    let mut fixture = rotor("battery", &motor, battery);
    fixture.set("j.voltage_target", 100.0);
    block(&mut fixture);
    steps(&mut fixture, 200);
    // A stalled winding across the battery: U0·R/(R + R_i).
    let open = 20.0 + 4.0 * fixture.get("battery.charge");
    close(fixture.get("supply.voltage"), open * 0.8 / 1.2, 5e-3);
    close(fixture.get("j.current"), open / 1.2, 5e-3);
    // 0.2 s at 20 A of 36 A s.
    close(1.0 - fixture.get("battery.charge"), 0.2 * open / 1.2 / 36.0, 0.1);
    steps(&mut fixture, 3000);
    assert_eq!(fixture.get("battery.charge"), 0.0);
    assert!(fixture.get("j.torque").abs() < 1e-9);
}

#[test]
fn actuators_are_given_by_pattern_and_nonsense_is_refused() {
    let stand = common::STAND;
    let robot = |more: &str| {
        common::instantiate(&format!(r#"{{"model": "models/hexapod.urdf", {stand}, {more}}}"#), 1.62)
    };
    let ok = robot(
        r#""max_torque": {"*": 60, "*_j1": 30}, "actuator": {"kind": {"*_j2": "dc"}, "gear_ratio": {"*_j2": 80}}"#,
    )
    .unwrap();
    let find = |name: &str| ok.variables().iter().find(|v| v.name == name).map(|v| v.id);
    let mut out = [0.0; 3];
    let ids = ["LF_j1.max_torque", "LF_j2.max_torque", "LF_j2.gear_ratio"].map(|n| find(n).unwrap());
    ok.get(&ids, terraglue_subsystem::ValuesMut::F64(&mut out)).unwrap();
    assert_eq!(out, [30.0, 60.0, 80.0]);
    assert!(find("LF_j1.gear_ratio").is_none());
    for (bad, says) in [
        (r#""actuator": {"gear_ratio": 0}"#, "gear_ratio"),
        (r#""actuator": {"kind": "hydraulic"}"#, "hydraulic"),
        (r#""actuator": {"preset": "nobody"}"#, "nobody"),
        (r#""max_torque": {"XX": 1}"#, "XX"),
        (r#""battery": {"capacity_a_h": 1, "open_circuit_v": [20, 19]}"#, "open_circuit_v"),
    ] {
        let error = robot(bad).err().expect(bad).to_string();
        assert!(error.contains(says), "{error}");
    }
}
