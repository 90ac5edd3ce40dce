//! The interface Jacobian at ports of glued joints is the derivative of the trial, at any length of the step.

use crate::common;
use common::Fixture;
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{Input, Law, Level, Port, PortKind, Response, Step, component};

const INTEGRATORS: [&str; 3] = ["symplectic-euler", "generalized-alpha", "energy-momentum"];

/// A spatial chain of eight links after a second's fall: its links turn with up to 10 rad/s.
fn falling_chain(integrator: &str) -> Fixture {
    let parameters = format!(
        r#"{{"model": "tests/reference/multibody/chain8.urdf", "motor": "off", "integrator": "{integrator}",
        "joints": {{"j2": 0.2, "j4": 0.2, "j6": 0.2, "j8": 0.2}}}}"#
    );
    let mut fixture = Fixture::new(&parameters, 9.81, 1e-3);
    (0..1000).for_each(|_| fixture.free_step());
    fixture
}

fn beside(fixture: &Fixture, body: u32) -> [f64; 3] {
    let [x, y, z] = fixture.states()[body as usize].world_from_body.position;
    [x + 0.3, y - 0.4, z + 0.2]
}

/// Ports of six components on two bodies, half a metre from their centres of mass.
fn ports(fixture: &Fixture, kind: PortKind) -> [Port; 2] {
    [(3, 0), (7, 6)].map(|(body, first)| Port {
        key: u64::from(first),
        kind: kind as u32,
        side: 1,
        mask: component::WRENCH,
        first,
        body,
        shape: u32::MAX,
        first_node: 0,
        node_count: 0,
        origin: beside(fixture, body),
        frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        extent: [0.0; 2],
        law: Law::BILATERAL,
    })
}

fn trial(fixture: &mut Fixture, step: &Step, t: &[f64]) -> [Vec<f64>; 3] {
    let [mut x, mut v, mut a, mut out_t] = [0; 4].map(|_| vec![f64::NAN; t.len()]);
    let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut out_t, reached: 0.0, flags: 0 };
    fixture.robot.advance(step, &Input::Force { t, motion: None }, &mut out).unwrap();
    [x, v, a]
}

/// Largest difference of the Jacobian from central differences of trials in parts of its largest entry, by level.
fn error(fixture: &mut Fixture, kind: PortKind, h: f64) -> [f64; 3] {
    let ports = ports(fixture, kind);
    let step = Step { ports: &ports, n: 12, ..Step::free(fixture.t, h, fixture.index) };
    let base: Vec<f64> = (0..12).map(|i| 0.3 * f64::from(i) - 1.0).collect();
    let mut errors = [0.0_f64; 3];
    let before = trial(fixture, &step, &base);
    let mut g = [0; 3].map(|_| vec![f64::NAN; 144]);
    for (level, g) in [Level::Position, Level::Velocity, Level::Acceleration].into_iter().zip(&mut g) {
        fixture.robot.interface_jacobian(&step, level, g).unwrap();
    }
    assert_eq!(trial(fixture, &step, &base), before, "the trial is another one after the derivatives");
    for c in 0..12 {
        let largest = g[0][12 * c..][..12].iter().fold(0.0_f64, |m, g| larger(m, g.abs()));
        let delta = 1e-4 / largest;
        let moved = |fixture: &mut Fixture, way: f64| {
            let mut t = base.clone();
            t[c] += way * delta;
            trial(fixture, &step, &t)
        };
        let (plus, minus) = (moved(fixture, 1.0), moved(fixture, -1.0));
        for k in 0..3 {
            let all = g[k].iter().fold(0.0_f64, |m, g| larger(m, g.abs()));
            for r in 0..12 {
                let difference = (plus[k][r] - minus[k][r]) / (2.0 * delta);
                errors[k] = larger(errors[k], (difference - g[k][12 * c + r]).abs() / all);
            }
        }
    }
    errors
}

#[test]
fn it_is_that_of_the_trial_whatever_the_step() {
    for integrator in INTEGRATORS {
        let mut fixture = falling_chain(integrator);
        for h in [1e-2, 5e-3, 2.5e-3, 1e-3, 1e-4] {
            let errors = error(&mut fixture, PortKind::Joint, h);
            println!("{integrator} {h}: {errors:?}");
            assert!(errors.iter().all(|e| *e < 1e-5), "{integrator} {h}: {errors:?}");
        }
    }
}

/// Without the terms that the factor leaves out the error is of the order of the step.
#[test]
fn what_contacts_take_instead_is_off_by_the_order_of_the_step() {
    for integrator in INTEGRATORS {
        let mut fixture = falling_chain(integrator);
        let [coarse, fine] = [5e-3, 2.5e-3].map(|h| error(&mut fixture, PortKind::Contact, h)[0]);
        println!("{integrator}: {coarse:e} {fine:e}");
        assert!(coarse > 1e-3 && (1.5..2.7).contains(&(coarse / fine)), "{integrator}: {coarse} {fine}");
    }
}
