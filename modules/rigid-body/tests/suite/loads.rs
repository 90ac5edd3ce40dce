//! External force and moment as inputs: they turn a body according to its inertia, and their work is its energy.

use crate::common;
use common::{Fixture, temporary_urdf};
use terraglue_subsystem::{Input, Law, Motion, Port, PortKind, Response, Step, Values, ValuesMut, component};

const INTEGRATORS: [&str; 3] = ["symplectic-euler", "generalized-alpha", "energy-momentum"];
const COM: [f64; 3] = [0.1, -0.2, 0.05];

/// A free body of 2 kg with its centre of mass off its frame, tumbling at `spin` rad/s.
fn body(name: &str, integrator: &str, spin: [f64; 3], h: f64) -> Fixture {
    let file = temporary_urdf(
        name,
        r#"<robot name="slab"><link name="slab"><inertial><origin xyz="0.1 -0.2 0.05"/><mass value="2"/>
        <inertia ixx="0.2" iyy="0.5" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#,
    );
    let parameters =
        format!(r#"{{"model": "{file}", "integrator": "{integrator}", "rotation_rate_rad_s": {spin:?}}}"#);
    Fixture::new(&parameters, 0.0, h)
}

#[test]
fn a_moment_about_a_principal_axis_spins_the_body_up_and_its_work_is_the_energy() {
    for integrator in INTEGRATORS {
        let mut fixture = body(&format!("spun_{integrator}"), integrator, [0.0; 3], 1e-3);
        fixture.set("slab.moment_z", 0.6);
        (0..1000).for_each(|_| fixture.free_step());
        assert!((fixture.get("slab.wz") - 1.5).abs() < 1e-11, "{integrator}: {}", fixture.get("slab.wz"));
        // half of 1.5 rad/s² over 1 s; symplectic Euler is half a step ahead
        let half = 0.5 * (0.75 + if integrator == INTEGRATORS[0] { 0.75e-3 } else { 0.0 });
        let found = libm::atan2(fixture.get("slab.qz"), fixture.get("slab.qw"));
        assert!((found - half).abs() < 1e-6, "{integrator}: {found} {half}");
        let energy = fixture.robot.energy();
        assert!((energy.kinetic - 0.45).abs() < 1e-10, "{integrator}: {energy:?}");
        assert!((energy.actuator_work - 0.45).abs() < 1e-10, "{integrator}: {energy:?}");
    }
}

/// Difference of the energy of a tumbling body from the work of force and moment after a second, J; and that work.
fn missed(integrator: &str, h: f64) -> [f64; 2] {
    let mut fixture = body(&format!("driven_{integrator}"), integrator, [1.0, 2.0, -1.5], h);
    for (name, value) in [("force_x", 3.0), ("moment_x", 0.3), ("moment_y", -0.4), ("moment_z", 0.2)] {
        fixture.set(&format!("slab.{name}"), value);
    }
    let start = fixture.balance();
    (0..(1.0 / h).round() as usize).for_each(|_| fixture.free_step());
    [fixture.balance() - start, fixture.robot.energy().actuator_work]
}

#[test]
fn a_tumbling_body_gains_what_force_and_moment_do() {
    let [off, work] = missed("energy-momentum", 1e-3);
    assert!(work > 0.5 && off.abs() < 1e-11, "{off:e} of {work}");
    let [[coarse, _], [fine, work]] = [1e-3, 5e-4].map(|h| missed("symplectic-euler", h));
    assert!(work > 0.5 && fine.abs() < 1e-3 * work, "{fine:e} of {work}");
    assert!((1.8..2.2).contains(&(coarse / fine)), "no first order: {coarse:e} {fine:e}");
}

/// A step under a force at a port off the centre of mass.
fn step_by_port(fixture: &mut Fixture, origin: [f64; 3], force: [f64; 3]) {
    let port = Port {
        key: 1,
        kind: PortKind::Joint as u32,
        side: 1,
        mask: component::FORCE,
        first: 0,
        body: 0,
        shape: u32::MAX,
        first_node: 0,
        node_count: 0,
        origin,
        frame: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        extent: [0.0; 2],
        law: Law::BILATERAL,
    };
    let step = Step { ports: &[port], n: 3, ..Step::free(fixture.t, fixture.h, fixture.index) };
    let [mut x, mut v, mut a, mut t] = [[f64::NAN; 3]; 4];
    let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
    fixture.robot.advance(&step, &Input::Force { t: &force, motion: None }, &mut out).unwrap();
    fixture.robot.commit(&step, &force, &Motion { x: &x, v: &v }).unwrap();
    (fixture.t, fixture.index) = (fixture.t + fixture.h, fixture.index + 1);
}

#[test]
fn force_and_moment_at_the_told_point_are_a_force_at_a_port() {
    let make = |name| body(name, INTEGRATORS[0], [0.5, 1.0, -2.0], 1e-3);
    let (mut ported, mut loaded) = (make("ported"), make("loaded"));
    let told = ["x", "y", "z"].map(|k| loaded.get(&format!("slab.force_at_{k}")));
    assert_eq!(told, COM);
    for k in 0..500 {
        let (origin, force) = ([0.4, 0.1 * libm::sin(0.01 * f64::from(k)), -0.3], [5.0, -2.0, 1.0]);
        step_by_port(&mut ported, origin, force);
        let [w, x, y, z] = ["qw", "qx", "qy", "qz"].map(|k| loaded.get(&format!("slab.{k}")));
        let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let place = nalgebra::Vector3::from(["x", "y", "z"].map(|k| loaded.get(&format!("slab.{k}"))));
        let arm = nalgebra::Vector3::from(origin) - place - q * nalgebra::Vector3::from(told);
        let moment = arm.cross(&nalgebra::Vector3::from(force));
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            loaded.set(&format!("slab.force_{axis}"), force[k]);
            loaded.set(&format!("slab.moment_{axis}"), moment[k]);
        }
        loaded.free_step();
    }
    for name in ["x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"] {
        let name = format!("slab.{name}");
        let (a, b) = (ported.get(&name), loaded.get(&name));
        assert!((a - b).abs() < 1e-11, "{name}: {a} {b}");
    }
    assert!(ported.get("slab.qw").abs() < 0.9, "it has turned: {}", ported.get("slab.qw"));
}

#[test]
fn loads_are_saved_with_the_state_and_what_is_told_only_is_refused() {
    let mut fixture = body("saved_loads", INTEGRATORS[0], [0.0; 3], 1e-3);
    fixture.set("slab.moment_y", 0.7);
    let bytes = fixture.robot.serialize().unwrap();
    fixture.set("slab.moment_y", 0.0);
    fixture.robot.deserialize(&bytes).unwrap();
    assert_eq!(fixture.get("slab.moment_y"), 0.7);
    for name in ["slab.qx", "slab.force_at_z"] {
        let error = fixture.robot.set(&[fixture.id(name)], Values::F64(&[0.0])).unwrap_err();
        assert!(error.to_string().contains("read only"), "{error}");
    }
    let gap = fixture.id("slab.qz") + 1;
    assert!(fixture.robot.get(&[gap], ValuesMut::F64(&mut [0.0])).is_err());
}
