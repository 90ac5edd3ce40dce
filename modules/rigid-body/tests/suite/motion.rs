//! Motion without ground against closed forms and conservation laws.

use crate::common;
use common::{Fixture, STAND, ball, temporary_urdf};

const G: f64 = 9.81;

#[test]
fn free_fall_follows_the_closed_form_of_its_scheme() {
    let parameters = format!(r#"{{"model": "{}", "position_m": [0, 0, 10]}}"#, ball("free_fall"));
    let mut fixture = Fixture::new(&parameters, G, 1e-3);
    (0..1000).for_each(|_| fixture.free_step());
    // Semi-implicit Euler: z = z0 − ½·g·t·(t + h).
    assert!((fixture.get("ball.z") - (10.0 - 0.5 * G * 1.001)).abs() < 1e-12);
    assert!((fixture.get("ball.vz") + G).abs() < 1e-12);
}

fn pendulum(name: &str, angle: f64, h: f64) -> Fixture {
    let file = temporary_urdf(
        name,
        r#"<robot name="pendulum"><link name="world"/><link name="bob">
        <inertial><origin xyz="1 0 0"/><mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="pivot" type="continuous"><parent link="world"/><child link="bob"/><axis xyz="0 1 0"/></joint>
        </robot>"#,
    );
    let parameters = format!(r#"{{"model": "{file}", "motor": "off", "joints": {{"pivot": {angle}}}}}"#);
    Fixture::new(&parameters, G, h)
}

/// Time between the first and the third zero crossing of the rate, by linear interpolation.
fn period(fixture: &mut Fixture) -> f64 {
    let (mut crossings, mut last) = (Vec::new(), 0.0);
    while crossings.len() < 3 {
        fixture.free_step();
        let rate = fixture.get("pivot.velocity");
        if last != 0.0 && rate * last < 0.0 {
            crossings.push(fixture.t - fixture.h * rate / (rate - last));
        }
        last = rate;
    }
    crossings[2] - crossings[0]
}

/// Complete elliptic integral by the arithmetic-geometric mean: T = 2π·√(I/mgl) / agm(1, cos(θ0/2)).
fn exact_period(amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0_f64, libm::cos(amplitude / 2.0));
    (0..8).for_each(|_| (a, b) = (0.5 * (a + b), (a * b).sqrt()));
    std::f64::consts::TAU * (1.01_f64 / G).sqrt() / a
}

#[test]
fn the_period_of_a_pendulum_is_the_elliptic_integral() {
    // The bob hangs at angle π/2 about y; it starts one radian away.
    let start = std::f64::consts::FRAC_PI_2 - 1.0;
    let errors = [2e-3, 1e-3]
        .map(|h| period(&mut pendulum(&format!("period{h}"), start, h)) / exact_period(1.0) - 1.0);
    assert!(errors[1].abs() < 1e-6, "{errors:?}");
}

#[test]
fn a_pendulum_neither_gains_nor_loses_energy() {
    let mut fixture = pendulum("energy", 0.0, 1e-3);
    let start = fixture.robot.energy().mechanical();
    let mut early = [f64::INFINITY, f64::NEG_INFINITY];
    let mut late = early;
    for i in 0..20_000 {
        fixture.free_step();
        let e = fixture.robot.energy().mechanical() - start;
        let range = if i < 5_000 { &mut early } else { &mut late };
        *range = [range[0].min(e), range[1].max(e)];
    }
    // The error oscillates with O(h²) and does not grow; the bob falls by 1 m, which is 9.81 J.
    assert!(early[0] > -2e-4 && early[1] < 2e-4, "{early:?}");
    assert!((late[0] - early[0]).abs() < 2e-6 && (late[1] - early[1]).abs() < 2e-6, "{early:?} {late:?}");
}

#[test]
fn a_tumbling_body_keeps_energy_and_momentum() {
    let file = temporary_urdf(
        "tumbling",
        r#"<robot name="racket"><link name="racket"><inertial><mass value="1"/>
        <inertia ixx="0.1" iyy="0.2" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <link name="ring"><inertial><mass value="0.1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="spinner" type="continuous"><parent link="racket"/><child link="ring"/><axis xyz="0 1 0"/></joint>
        </robot>"#,
    );
    let mut fixture = Fixture::new(&format!(r#"{{"model": "{file}", "motor": "torque"}}"#), 0.0, 1e-3);
    // A motor spins the ring up against the body; then the joint breaks and both fly freely.
    fixture.set("spinner.torque_target", 0.5);
    (0..200).for_each(|_| fixture.free_step());
    fixture.robot.act("spinner.break", "{}").unwrap();
    let start = fixture.robot.energy().mechanical();
    assert!(start > 0.1);
    for _ in 0..5_000 {
        fixture.free_step();
        let change = fixture.robot.energy().mechanical() / start - 1.0;
        assert!(change.abs() < 1e-8, "{} {change:e}", fixture.t);
    }
}

fn tip(fixture: &Fixture) -> [f64; 3] {
    let state = fixture.states()[7];
    let q = state.world_from_body.orientation;
    let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
    (nalgebra::Vector3::from(state.world_from_body.position) + q * nalgebra::Vector3::new(0.25, 0.0, 0.0))
        .into()
}

fn chain_error(file: &str, joints: &str, h: f64, expected: [f64; 3]) -> f64 {
    let parameters = format!(
        r#"{{"model": "tests/reference/multibody/{file}.urdf", "motor": "off", "joints": {joints}}}"#
    );
    let mut fixture = Fixture::new(&parameters, G, h);
    (0..(1.0 / h).round() as usize).for_each(|_| fixture.free_step());
    let tip = tip(&fixture);
    (0..3).map(|k| (tip[k] - expected[k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn chains_approach_the_reference_with_first_order() {
    let spatial = r#"{"j2": 0.2, "j4": 0.2, "j6": 0.2, "j8": 0.2}"#;
    let heavy = format!(r#"{{"j1": {}}}"#, 0.5 - std::f64::consts::FRAC_PI_2);
    let cases = [
        ("chain8", spatial, [-1.640621154, -0.580129864, -0.919078146]),
        ("chain8_planar", "{}", [-1.763829172, 0.0, -0.929046757]),
        ("chain8_m1000", heavy.as_str(), [-0.566796969, 0.0, -1.918003510]),
    ];
    for (file, joints, expected) in cases {
        let errors = [1e-3, 5e-4].map(|h| chain_error(file, joints, h, expected));
        let order = libm::log2(errors[0] / errors[1]);
        assert!(errors[0] < 0.02 && (0.9..1.2).contains(&order), "{file}: {errors:?}");
    }
}

#[test]
fn a_swinging_chain_stays_together_and_finite() {
    let parameters = r#"{"model": "tests/reference/multibody/chain8.urdf", "motor": "off", "joints": {"j2": 0.2, "j4": 0.2}}"#;
    let mut fixture = Fixture::new(parameters, G, 1e-3);
    let start = fixture.robot.energy().mechanical();
    for _ in 0..5_000 {
        fixture.free_step();
        let change = fixture.robot.energy().mechanical() - start;
        assert!(change.abs() < 3.0, "{change}");
    }
    // Each link starts where the one before ends.
    let states = fixture.states();
    for pair in states.windows(2) {
        let q = pair[0].world_from_body.orientation;
        let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
        let end = nalgebra::Vector3::from(pair[0].world_from_body.position)
            + q * nalgebra::Vector3::new(0.25, 0.0, 0.0);
        assert!((end - nalgebra::Vector3::from(pair[1].world_from_body.position)).norm() < 1e-10);
    }
}

#[test]
fn a_gait_without_gravity_moves_no_momentum() {
    let mut fixture = Fixture::new(
        &format!(r#"{{"model": "models/hexapod.urdf", "position_m": [0, 0, 5], {STAND}}}"#),
        0.0,
        1e-3,
    );
    let joints = fixture.joints();
    let start: Vec<f64> = joints.iter().map(|j| fixture.get(&format!("{j}.angle"))).collect();
    let masses: Vec<f64> = fixture.scene.bodies.iter().map(|b| b.mass).collect();
    assert_eq!((masses.len(), joints.len()), (25, 24));
    assert!((fixture.mass() - 25.02).abs() < 1e-9);
    let coms: Vec<[f64; 3]> = (0..25).map(com).collect();
    for _ in 0..1000 {
        for (k, (joint, q)) in joints.iter().zip(&start).enumerate() {
            let target = q + 0.3 * libm::sin(6.0 * fixture.t + k as f64) - 0.3 * libm::sin(k as f64);
            fixture.set(&format!("{joint}.angle_target"), target);
        }
        fixture.free_step();
        let mut momentum = nalgebra::Vector3::zeros();
        for ((s, m), c) in fixture.states().iter().zip(&masses).zip(&coms) {
            let q = s.world_from_body.orientation;
            let q =
                nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
            let w = nalgebra::Vector3::from(s.angular_velocity);
            momentum += *m
                * (nalgebra::Vector3::from(s.linear_velocity) + w.cross(&(q * nalgebra::Vector3::from(*c))));
        }
        assert!(momentum.norm() < 1e-10, "{momentum}");
    }
}

/// Centres of mass of the hexapod's links, in the order of the file.
fn com(body: usize) -> [f64; 3] {
    match body {
        0 => [0.0; 3],
        b => [[0.03, 0.05, 0.1, 0.157142857143][(b - 1) % 4], 0.0, 0.0],
    }
}
