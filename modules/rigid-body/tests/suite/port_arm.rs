//! A wrench at a port of a glued joint acts on the material point of the body, where the rule takes forces.
//!
//! A free body with a constant force at a point far from its centre of mass turns like a pendulum, I·θ¨ = −L·F·sin θ, its
//! centre of mass moves with F/m, and the energy ½·I·ω² + ½·m·v² − F·x of the point stays.

use crate::common;
use common::{Fixture, temporary_urdf};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{Input, Law, Motion, Port, PortKind, Response, Step, component};

/// Arm of the force, m; force, N; inertia, kg m².
const ARM: [f64; 3] = [0.3, 0.4, 0.0];
const FORCE: [f64; 6] = [4.0, 0.0, 0.0, 0.0, 0.0, 0.0];
const INERTIA: f64 = 0.5;

fn body(integrator: &str, h: f64) -> Fixture {
    let file = temporary_urdf(
        &format!("port_arm_{integrator}"),
        r#"<robot name="bar"><link name="bar"><inertial><mass value="2"/>
        <inertia ixx="0.5" iyy="0.5" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#,
    );
    let parameters =
        format!(r#"{{"model": "{file}", "integrator": "{integrator}", "rotation_rate_rad_s": [0, 0, 1.5]}}"#);
    Fixture::new(&parameters, 0.0, h)
}

/// The port where the material point is at t, with world axes.
fn port(fixture: &Fixture) -> Port {
    let pose = fixture.states()[0].world_from_body;
    let [w, x, y, z] = pose.orientation;
    let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
    let origin = nalgebra::Vector3::from(pose.position) + q * nalgebra::Vector3::from(ARM);
    Port {
        key: 1,
        kind: PortKind::Joint as u32,
        side: 1,
        mask: component::WRENCH,
        first: 0,
        body: 0,
        shape: u32::MAX,
        first_node: 0,
        node_count: 0,
        origin: origin.into(),
        frame: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        extent: [0.0; 2],
        law: Law::BILATERAL,
    }
}

/// A step of length h under the force; the displacement of the port.
fn step(fixture: &mut Fixture, h: f64) -> f64 {
    let ports = [port(fixture)];
    let step = Step { ports: &ports, n: 6, ..Step::free(fixture.t, h, fixture.index) };
    let [mut x, mut v, mut a, mut t] = [[f64::NAN; 6]; 4];
    let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
    fixture.robot.advance(&step, &Input::Force { t: &FORCE, motion: None }, &mut out).unwrap();
    fixture.robot.commit(&step, &FORCE, &Motion { x: &x, v: &v }).unwrap();
    fixture.t += h;
    fixture.index += u64::from(h > 0.0);
    x[0]
}

/// Angle of the body after a second, from Runge–Kutta steps of 0.1 ms.
fn reference() -> f64 {
    let slope = |angle: f64| {
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let [x, y] = [ARM[0] * cos - ARM[1] * sin, ARM[0] * sin + ARM[1] * cos];
        (x * FORCE[1] - y * FORCE[0]) / INERTIA
    };
    let (mut angle, mut rate, h) = (0.0, 1.5, 1e-4);
    for _ in 0..10_000 {
        let (k1, l1) = (rate, slope(angle));
        let (k2, l2) = (rate + 0.5 * h * l1, slope(angle + 0.5 * h * k1));
        let (k3, l3) = (rate + 0.5 * h * l2, slope(angle + 0.5 * h * k2));
        let (k4, l4) = (rate + h * l3, slope(angle + h * k3));
        angle += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        rate += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
    }
    angle
}

/// Error of the angle after a second, rad, and the largest error of the energy, J.
fn errors(integrator: &str, h: f64) -> (f64, f64) {
    let mut fixture = body(integrator, h);
    let start = fixture.robot.energy().mechanical();
    step(&mut fixture, 0.0);
    let (mut work, mut worst) = (0.0, 0.0_f64);
    for _ in 0..(1.0 / h).round() as usize {
        work += FORCE[0] * step(&mut fixture, h);
        worst = larger(worst, (fixture.robot.energy().mechanical() - start - work).abs());
    }
    let [w, _, _, z] = fixture.states()[0].world_from_body.orientation;
    let angle = 2.0 * libm::atan2(z, w);
    let off = angle - reference();
    (off - std::f64::consts::TAU * (off / std::f64::consts::TAU).round(), worst)
}

/// Orders of convergence of the angle and of the energy, and both errors at the shortest step.
fn orders(integrator: &str) -> ([f64; 2], [f64; 2]) {
    let runs = [1e-2, 5e-3, 2.5e-3].map(|h| errors(integrator, h));
    println!("{integrator}: {runs:?}");
    let order = |of: fn(&(f64, f64)) -> f64| {
        let [_, coarse, fine] = [0, 1, 2].map(|k| of(&runs[k]).abs());
        libm::log2(coarse / fine)
    };
    ([order(|r| r.0), order(|r| r.1)], [runs[2].0.abs(), runs[2].1])
}

#[test]
fn rules_of_second_order_converge_with_second_order() {
    let ([angle, energy], [off, _]) = orders("generalized-alpha");
    assert!((1.9..2.2).contains(&angle) && (1.8..2.2).contains(&energy), "{angle} {energy}");
    assert!(off < 1e-5, "{off:e}");
    let ([angle, _], [off, lost]) = orders("energy-momentum");
    assert!((1.9..2.1).contains(&angle), "{angle}");
    assert!(off < 1e-5 && lost < 1e-12, "{off:e} {lost:e}");
}

#[test]
fn the_rule_of_first_order_converges_with_first_order() {
    let ([angle, _], _) = orders("symplectic-euler");
    assert!((0.9..1.1).contains(&angle), "{angle}");
}
