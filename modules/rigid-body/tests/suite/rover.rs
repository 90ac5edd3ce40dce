//! A rover whose wheels rigid motors drive, on ground that yields: landings, rates that contradict each other, motors at
//! their bounds. No step may be lost, and the estimate of the forces stays within the limits of the wheels.

use crate::common;
use common::Fixture;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{Estimate, Input, Law, Motion, Port, Response, Step, component};

const G: f64 = 9.81;
const WHEELS: [&str; 6] = ["LF", "LM", "LR", "RF", "RM", "RR"];
const RADIUS: f64 = 0.15;
const MASS: f64 = 39.2;
/// Stiffness of the ground below a wheel, N/m.
const STIFFNESS: f64 = 2e4;

fn rover(max_torque: f64, z: f64) -> Fixture {
    let text = format!(
        r#"{{"model": "models/rover.urdf", "position_m": [0, 0, {z}], "max_torque": {max_torque},
        "motor": {{"*_drive": "velocity", "*_pivot": "off"}}}}"#
    );
    Fixture::new(&text, G, 1e-3)
}

/// A patch with all six components below every wheel that can touch within the step.
fn patches(fixture: &Fixture) -> Vec<Port> {
    let mut ports: Vec<Port> = Vec::new();
    for (number, (state, body)) in fixture.states().iter().zip(&fixture.scene.bodies).enumerate() {
        let [w, x, y, z] = state.world_from_body.orientation;
        let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let axle = q * Vector3::y();
        let [cx, cy, cz] = state.world_from_body.position;
        if !body.name.ends_with("_wheel") || cz - RADIUS > 5e-3 {
            continue;
        }
        let forward = axle.cross(&Vector3::z()).normalize();
        let side = Vector3::z().cross(&forward);
        ports.push(Port {
            key: ports.len() as u64,
            kind: 0,
            side: 1,
            mask: component::WRENCH,
            first: 6 * ports.len() as u32,
            body: number as u32,
            shape: 0,
            first_node: 0,
            node_count: 0,
            origin: [cx, cy, cz - RADIUS],
            frame: [0.0, 0.0, 1.0, forward.x, forward.y, forward.z, side.x, side.y, side.z],
            extent: [0.03, 0.06],
            law: Law { mu: 0.6, ..Law::UNILATERAL },
        });
    }
    ports
}

/// A step of the plain pass: every wheel gets its share of T* that a spring of the ground allows. The largest component
/// of T*.
fn step(fixture: &mut Fixture) -> f64 {
    let ports = patches(fixture);
    let n = 6 * ports.len();
    let still = vec![0.0; n];
    // Below the level of the ground the surface is where the wheel has pressed it.
    let x2: Vec<f64> =
        ports.iter().flat_map(|p| [(-p.origin[2]).min(0.0), 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
    let step = Step { ports: &ports, n: n as u32, ..Step::free(fixture.t, fixture.h, fixture.index) };
    let (mut t, mut x_free, mut g, mut active) =
        (vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n * n], vec![9; ports.len()]);
    let mut out =
        Estimate { t_star: &mut t, x_free: &mut x_free, g: &mut g, active: &mut active, unique: false };
    fixture.robot.estimate_forces(&step, &Motion { x: &x2, v: &still }, &mut out).unwrap();
    let largest = t.iter().fold(0.0_f64, |m, t| larger(m, t.abs()));
    assert!(largest.is_finite());
    for (port, t) in ports.iter().zip(t.chunks_exact_mut(6)) {
        let spring = STIFFNESS * (-port.origin[2]).max(0.0);
        let share = if t[0] > 0.0 { (spring / t[0]).min(1.0) } else { 0.0 };
        t.iter_mut().for_each(|t| *t *= share);
    }
    let mut free = [(); 3].map(|()| vec![0.0; n]);
    let [x, v, a] = &mut free;
    let mut taken = vec![0.0; n];
    let mut out = Response { x, v, a, t: &mut taken, reached: f64::NAN, flags: 0 };
    fixture.robot.advance(&step, &Input::Force { t: &t, motion: None }, &mut out).unwrap();
    fixture.robot.commit(&step, &t, &Motion { x: &x2, v: &still }).unwrap();
    fixture.t += fixture.h;
    fixture.index += 1;
    largest
}

fn drive(fixture: &mut Fixture, rates: [f64; 6]) {
    for (wheel, rate) in WHEELS.iter().zip(rates) {
        fixture.set(&format!("{wheel}_wheel_drive.velocity_target"), rate);
    }
}

/// The largest component of T* over the run, and where it ends.
fn run(max_torque: f64, z: f64, rates: [f64; 6], steps: usize) -> (f64, f64, f64) {
    let mut fixture = rover(max_torque, z);
    drive(&mut fixture, rates);
    let largest = (0..steps).fold(0.0_f64, |m, _| larger(m, step(&mut fixture)));
    (largest, fixture.get("body.x"), fixture.get("body.z"))
}

/// Twice the force that stops the whole rover within a step after a fall to the ground from z.
fn bound(z: f64) -> f64 {
    2.0 * MASS * ((2.0 * G * (z - 0.27)).sqrt() + 1.0) / 1e-3
}

#[test]
fn wheels_at_a_common_rate_drive_off() {
    let (largest, x, z) = run(200.0, 0.272, [1.0; 6], 600);
    assert!(largest < bound(0.272), "{largest}");
    assert!((0.06..0.09).contains(&x) && (0.25..0.27).contains(&z), "{x} {z}");
}

#[test]
fn wheels_at_contradicting_rates_slip() {
    for torque in [200.0, 2.0] {
        let (largest, x, z) = run(torque, 0.3, [1.0, 2.0, 0.0, 1.0, -1.0, 3.0], 300);
        assert!(largest < bound(0.3), "{torque} {largest}");
        assert!(x.abs() < 0.1 && (0.25..0.27).contains(&z), "{torque} {x} {z}");
    }
}

#[test]
fn a_hard_landing_with_turning_wheels_ends_on_the_ground() {
    for torque in [200.0, 20.0] {
        let (largest, _, z) = run(torque, 1.0, [20.0; 6], 600);
        assert!(largest < bound(1.0), "{torque} {largest}");
        assert!((0.1..0.3).contains(&z), "{torque} {z}");
    }
}
