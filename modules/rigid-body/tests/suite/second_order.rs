//! The second-order option against references of reduced coordinates, and its functions for gluing.

use crate::common;
use common::{Fixture, STAND, temporary_urdf};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{Level, Port, Step, component};

const G: f64 = 9.81;
const ALPHA: &str = r#""integrator": "generalized-alpha""#;
const SPATIAL: &str = r#"{"j2": 0.2, "j4": 0.2, "j6": 0.2, "j8": 0.2}"#;

fn chain(file: &str, joints: &str, h: f64) -> Fixture {
    let parameters = format!(
        r#"{{"model": "tests/reference/multibody/{file}.urdf", "motor": "off", "joints": {joints}, {ALPHA}}}"#
    );
    Fixture::new(&parameters, G, h)
}

fn tip(fixture: &Fixture) -> nalgebra::Vector3<f64> {
    let state = fixture.states()[7];
    let q = state.world_from_body.orientation;
    let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
    nalgebra::Vector3::from(state.world_from_body.position) + q * nalgebra::Vector3::new(0.25, 0.0, 0.0)
}

/// Error of the tip at 1 s, m, and the largest energy error until `end`, J.
fn run(file: &str, joints: &str, h: f64, end: f64, expected: [f64; 3]) -> (f64, f64) {
    watch(chain(file, joints, h), h, end, expected)
}

fn watch(mut fixture: Fixture, h: f64, end: f64, expected: [f64; 3]) -> (f64, f64) {
    let start = fixture.robot.energy().mechanical();
    let (mut worst, mut error) = (0.0_f64, f64::NAN);
    for i in 1..=(end / h).round() as usize {
        fixture.free_step();
        worst = larger(worst, (fixture.robot.energy().mechanical() - start).abs());
        if i == (1.0 / h).round() as usize {
            error = (tip(&fixture) - nalgebra::Vector3::from(expected)).norm();
        }
    }
    (error, worst)
}

#[test]
fn chains_follow_the_reference_with_second_order() {
    let heavy = format!(r#"{{"j1": {}}}"#, 0.5 - std::f64::consts::FRAC_PI_2);
    let cases = [
        ("chain8", SPATIAL, [-1.640621154, -0.580129864, -0.919078146]),
        ("chain8_planar", "{}", [-1.763829172, 0.0, -0.929046757]),
        ("chain8_m1000", heavy.as_str(), [-0.566796969, 0.0, -1.918003510]),
    ];
    for (file, joints, expected) in cases {
        let [coarse, fine] = [1e-3, 5e-4].map(|h| run(file, joints, h, 1.0, expected));
        let order = libm::log2(coarse.0 / fine.0);
        assert!(coarse.0 < 2e-5 && (1.8..2.3).contains(&order), "{file}: {coarse:?} {fine:?}");
    }
}

#[test]
fn the_energy_of_a_spatial_chain_converges_with_the_step() {
    let expected = [-1.640621154, -0.580129864, -0.919078146];
    let [energy, half] = [1e-3, 5e-4].map(|h| run("chain8", SPATIAL, h, 4.0, expected).1);
    assert!(energy / half > 3.0, "{energy} {half}");
}

#[test]
fn the_scheme_that_conserves_energy_does_so_and_converges() {
    let expected = [-1.640621154, -0.580129864, -0.919078146];
    let [coarse, fine] = [1e-3, 5e-4].map(|h| {
        let parameters = format!(
            r#"{{"model": "tests/reference/multibody/chain8.urdf", "motor": "off", "joints": {SPATIAL},
            "integrator": "energy-momentum"}}"#
        );
        watch(Fixture::new(&parameters, G, h), h, 2.0, expected)
    });
    assert!(coarse.1 < 1e-8 && fine.1 < 1e-8, "{coarse:?} {fine:?}");
    assert!(coarse.0 < 2e-5 && coarse.0 / fine.0 > 3.0, "{coarse:?} {fine:?}");
}

#[test]
fn a_free_body_falls_exactly() {
    let file = common::ball("alpha_fall");
    let mut fixture =
        Fixture::new(&format!(r#"{{"model": "{file}", "position_m": [0, 0, 10], {ALPHA}}}"#), G, 1e-2);
    (0..100).for_each(|_| fixture.free_step());
    assert!((fixture.get("ball.z") - (10.0 - 0.5 * G)).abs() < 1e-11, "{}", fixture.get("ball.z"));
    assert!((fixture.get("ball.vz") + G).abs() < 1e-11);
}

fn port(fixture: &Fixture, body: u32) -> Port {
    let p = fixture.states()[body as usize].world_from_body.position;
    Port {
        key: 1,
        kind: 1,
        side: 1,
        mask: component::WRENCH,
        first: 0,
        body,
        shape: u32::MAX,
        first_node: 0,
        node_count: 0,
        origin: p,
        frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        extent: [0.0; 2],
        law: terraglue_subsystem::Law::BILATERAL,
    }
}

#[test]
fn the_compliance_is_the_derivative_of_the_step() {
    let parameters =
        format!(r#"{{"model": "models/hexapod.urdf", "position_m": [0, 0, 1], {STAND}, {ALPHA}}}"#);
    let mut fixture = Fixture::new(&parameters, G, 1e-3);
    (0..20).for_each(|_| fixture.free_step());
    let ports = [port(&fixture, 4)];
    let step = Step { ports: &ports, n: 6, ..Step::free(fixture.t, fixture.h, fixture.index) };
    let mut trial = |t: &[f64; 6]| {
        let (mut x, mut v, mut a, mut out_t) = ([f64::NAN; 6], [f64::NAN; 6], [f64::NAN; 6], [f64::NAN; 6]);
        let mut out = terraglue_subsystem::Response {
            x: &mut x,
            v: &mut v,
            a: &mut a,
            t: &mut out_t,
            reached: 0.0,
            flags: 0,
        };
        let input = terraglue_subsystem::Input::Force { t, motion: None };
        fixture.robot.advance(&step, &input, &mut out).unwrap();
        [x, v, a]
    };
    let zero = trial(&[0.0; 6]);
    let columns: Vec<[[f64; 6]; 3]> = (0..6)
        .map(|c| {
            let mut t = [0.0; 6];
            t[c] = 1e-2;
            trial(&t)
        })
        .collect();
    for (k, level) in [Level::Position, Level::Velocity, Level::Acceleration].into_iter().enumerate() {
        let mut g = [f64::NAN; 36];
        fixture.robot.interface_jacobian(&step, level, &mut g).unwrap();
        let largest = g.iter().fold(0.0_f64, |m, g| larger(m, g.abs()));
        for c in 0..6 {
            for r in 0..6 {
                let difference = (columns[c][k][r] - zero[k][r]) / 1e-2;
                assert!(
                    (difference - g[6 * c + r]).abs() < 2e-3 * largest,
                    "{level:?} {r} {c}: {difference} {}",
                    g[6 * c + r]
                );
            }
        }
    }
}

#[test]
fn a_restored_state_repeats_accelerations_too() {
    let mut fixture = chain("chain8", SPATIAL, 1e-3);
    (0..50).for_each(|_| fixture.free_step());
    fixture.robot.save_state(1).unwrap();
    (0..50).for_each(|_| fixture.free_step());
    let first = fixture.states();
    fixture.robot.restore_state(1).unwrap();
    (0..50).for_each(|_| fixture.free_step());
    assert_eq!(fixture.states(), first);
}

#[test]
fn a_driven_pendulum_converges_with_second_order() {
    let file = temporary_urdf(
        "alpha_pendulum",
        r#"<robot name="pendulum"><link name="world"/><link name="bob">
        <inertial><origin xyz="1 0 0"/><mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="pivot" type="continuous"><parent link="world"/><child link="bob"/><axis xyz="0 1 0"/></joint>
        </robot>"#,
    );
    let angle = |h: f64| {
        let parameters = format!(
            r#"{{"model": "{file}", "stiffness": 100, "damping": 0, "joints": {{"pivot": 0.5}}, {ALPHA}}}"#
        );
        let mut fixture = Fixture::new(&parameters, G, h);
        fixture.set("pivot.angle_target", 0.0);
        (0..(1.0 / h).round() as usize).for_each(|_| fixture.free_step());
        fixture.get("pivot.angle")
    };
    let [a, b, c] = [4e-3, 2e-3, 1e-3].map(angle);
    let order = libm::log2((a - b) / (b - c));
    assert!((1.9..2.1).contains(&order), "{order}");
}
