//! Estimates of special contacts: six feet on one body, friction, patches with moments, own bodies, placement.

use crate::common;
use common::{Fixture, root, temporary_urdf};
use std::sync::Arc;
use terraglue_rigid_body::RigidBody;
use terraglue_subsystem::{
    BodyState, Config, Estimate, Law, Module, Motion, Port, Standalone, Step, Terrain, TerrainTile, component,
};

fn solid(name: &str, mass: f64, shapes: &str) -> String {
    format!(
        "<link name=\"{name}\"><inertial><mass value=\"{mass}\"/>\
         <inertia ixx=\"0.5\" iyy=\"0.6\" izz=\"0.7\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>{shapes}</link>"
    )
}

fn sphere(x: f64, y: f64, z: f64, r: f64) -> String {
    format!(
        "<collision><origin xyz=\"{x} {y} {z}\"/><geometry><sphere radius=\"{r}\"/></geometry></collision>"
    )
}

fn table(name: &str, com_shift: f64) -> Fixture {
    let feet: String = [(0.35, 0.5), (0.0, 0.5), (-0.35, 0.5), (0.35, -0.5), (0.0, -0.5), (-0.35, -0.5)]
        .iter()
        .map(|(x, y)| sphere(x - com_shift, *y, -0.3, 0.03))
        .collect();
    let file = temporary_urdf(name, &format!("<robot name=\"t\">{}</robot>", solid("table", 20.0, &feet)));
    Fixture::new(&format!(r#"{{"model": "{file}", "position_m": [0, 0, 0.33]}}"#), 9.81, 1e-3)
}

#[test]
fn six_feet_on_one_body_share_the_weight_with_the_smallest_norm() {
    let mut fixture = table("table", 0.0);
    let ports = fixture.ports();
    let e = fixture.estimate(&ports).unwrap();
    assert!(!e.unique);
    for n in e.t_star.iter().step_by(3) {
        assert!((n / (20.0 * 9.81 / 6.0) - 1.0).abs() < 1e-8, "{:?}", e.t_star);
    }
    assert_eq!(e.active, [1; 6]);
}

#[test]
fn a_shifted_load_is_shared_linearly_and_in_any_order() {
    let shares = |reversed: bool| {
        let mut fixture = table("shifted", 0.1);
        fixture.reversed = reversed;
        let ports = fixture.ports();
        let mut t: Vec<f64> = fixture.estimate(&ports).unwrap().t_star.iter().copied().step_by(3).collect();
        if reversed {
            t.reverse();
        }
        t
    };
    let (a, b) = (shares(false), shares(true));
    // Minimum norm: an affine function of the place of the foot; front feet stand at x − 0.1.
    assert!((a[0] + a[2] - 2.0 * a[1]).abs() < 1e-6 && a[0] > a[2], "{a:?}");
    assert!((a.iter().sum::<f64>() / (20.0 * 9.81) - 1.0).abs() < 1e-8);
    a.iter().zip(&b).for_each(|(a, b)| assert!((a - b).abs() < 1e-6, "{a} {b}"));
}

#[test]
fn friction_bounds_the_tangential_estimate() {
    let mut fixture = table("sliding", 0.0);
    fixture.mu = 0.1;
    fixture.set("table.force_x", 300.0);
    let ports = fixture.ports();
    let e = fixture.estimate(&ports).unwrap();
    let mut slip = 0.0;
    for t in e.t_star.chunks(3) {
        assert!(libm::hypot(t[1], t[2]) <= 0.1 * t[0] * (1.0 + 1e-9) + 1e-12, "{t:?}");
        slip += t[1];
    }
    assert!((slip + 0.1 * 20.0 * 9.81).abs() < 1.0, "{slip}");
    fixture.mu = 0.8;
    fixture.set("table.force_x", 30.0);
    let ports = fixture.ports();
    let e = fixture.estimate(&ports).unwrap();
    let held: f64 = e.t_star.iter().skip(1).step_by(3).sum();
    assert!((held + 30.0).abs() < 1e-6, "{held}");
}

#[test]
fn a_plate_holds_by_one_patch_with_moments() {
    let shape = "<collision><geometry><box size=\"0.4 0.2 0.1\"/></geometry></collision>";
    let file = temporary_urdf("plate", &format!("<robot name=\"p\">{}</robot>", solid("plate", 10.0, shape)));
    let mut fixture =
        Fixture::new(&format!(r#"{{"model": "{file}", "position_m": [0, 0, 0.05]}}"#), 9.81, 1e-3);
    fixture.set("plate.force_x", 20.0);
    let port = Port {
        key: 1,
        kind: 0,
        side: 1,
        mask: component::WRENCH,
        first: 0,
        body: 0,
        shape: 0,
        first_node: 0,
        node_count: 0,
        origin: [0.0; 3],
        frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        extent: [0.2, 0.1],
        law: Law { mu: 0.8, ..Law::UNILATERAL },
    };
    let step = Step { ports: &[port], n: 6, ..Step::free(0.0, 1e-3, 0) };
    let (mut t, mut x, mut g, mut active) = ([f64::NAN; 6], [f64::NAN; 6], [f64::NAN; 36], [9]);
    let mut out = Estimate { t_star: &mut t, x_free: &mut x, g: &mut g, active: &mut active, unique: false };
    fixture.robot.estimate_forces(&step, &Motion { x: &[0.0; 6], v: &[0.0; 6] }, &mut out).unwrap();
    // Equilibrium about the patch: force at the centre of mass, 0.05 m above it, along x: a moment about y.
    for (t, expected) in t.iter().zip([98.1, -20.0, 0.0, 0.0, 0.0, -1.0]) {
        assert!((t - expected).abs() < 1e-6, "{t} {expected}");
    }
    // The centre of pressure stays within the plate.
    fixture.set("plate.force_x", 600.0);
    let mut out = Estimate { t_star: &mut t, x_free: &mut x, g: &mut g, active: &mut active, unique: false };
    fixture.robot.estimate_forces(&step, &Motion { x: &[0.0; 6], v: &[0.0; 6] }, &mut out).unwrap();
    assert!(t[5].abs() <= 0.2 * t[0] + 1e-9 && libm::hypot(t[1], t[2]) <= 0.8 * t[0] + 1e-9, "{t:?}");
}

#[test]
fn own_bodies_do_not_pass_through_each_other() {
    // Two arms on one base swing towards each other; their balls meet half way.
    let arm = |name: &str| solid(name, 1.0, &sphere(0.0, 0.0, -0.5, 0.1));
    let hinge = |name: &str, child: &str, x: f64| {
        format!(
            "<joint name=\"{name}\" type=\"continuous\"><origin xyz=\"{x} 0 0\"/><parent link=\"world\"/>\
             <child link=\"{child}\"/><axis xyz=\"0 1 0\"/></joint>"
        )
    };
    let text = format!(
        "<robot name=\"arms\"><link name=\"world\"/>{}{}{}{}</robot>",
        arm("left"),
        arm("right"),
        hinge("l", "left", -0.3),
        hinge("r", "right", 0.3)
    );
    let file = temporary_urdf("arms", &text);
    let mut fixture =
        Fixture::new(&format!(r#"{{"model": "{file}", "motor": "torque", "friction": 0.0}}"#), 0.0, 1e-3);
    // Without friction: with 0.8 the two arms, 24 degrees off the vertical, lock (tan 24 degrees = 0.44). A wrench at a port on the left arm, later felt by the right arm too.
    let port = |fixture: &Fixture| {
        let p = fixture.states()[0].world_from_body.position;
        Port {
            key: 1,
            kind: 0,
            side: 1,
            mask: component::FORCE,
            first: 0,
            body: 0,
            shape: 0,
            first_node: 0,
            node_count: 0,
            origin: [p[0], p[1], p[2] - 0.6],
            frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            extent: [0.0; 2],
            law: Law::UNILATERAL,
        }
    };
    let mobility = |fixture: &mut Fixture| {
        let ports = [port(fixture)];
        let x = fixture.advance(&ports, &[0.0, 1.0, 0.0]).unwrap()[1]
            - fixture.advance(&ports, &[0.0; 3]).unwrap()[1];
        let mut g = [f64::NAN; 9];
        let step = fixture.step(&ports);
        fixture.robot.interface_jacobian(&step, terraglue_subsystem::Level::Position, &mut g).unwrap();
        assert!((x / g[4] - 1.0).abs() < 1e-3, "{x} {}", g[4]);
        x
    };
    let alone = mobility(&mut fixture);
    fixture.set("l.torque_target", -2.0);
    fixture.set("r.torque_target", 2.0);
    let mut met = false;
    let before = fixture.balance();
    for _ in 0..1500 {
        fixture.free_step();
        let centre = |s: &BodyState| {
            let q = s.world_from_body.orientation;
            let q =
                nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
            nalgebra::Vector3::from(s.world_from_body.position) + q * nalgebra::Vector3::new(0.0, 0.0, -0.5)
        };
        let states = fixture.states();
        let apart = (centre(&states[0]) - centre(&states[1])).norm();
        assert!(apart > 0.2 - 1e-4, "{apart}");
        met |= apart < 0.2 + 1e-4;
    }
    assert!(met && fixture.get("l.velocity").abs() < 1e-2, "{}", fixture.get("l.velocity"));
    assert!(fixture.balance() <= before + 1e-6);
    // Pressed together the arms move as one.
    assert!((mobility(&mut fixture) / alone - 0.5).abs() < 0.05);
}

struct Ramp;

impl Terrain for Ramp {
    fn origin(&self) -> [f64; 2] {
        [-2.0, -2.0]
    }
    fn spacing(&self) -> f64 {
        0.01
    }
    fn size(&self) -> [u32; 2] {
        [401, 401]
    }
    fn heights(&self, i0: i64, _j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        (0..ni * nj).for_each(|k| out[k] = 0.2 * (-2.0 + (i0 + (k % ni) as i64) as f64 * 0.01));
        TerrainTile::Varied
    }
}

fn placed(parameters: &str) -> Vec<BodyState> {
    let host = Standalone { gravity: [0.0, 0.0, -9.81], terrain: Some(Box::new(Ramp)), folder: root() };
    let robot = RigidBody::instantiate(&Config::parse(parameters).unwrap(), Arc::new(host)).unwrap();
    let mut states = vec![BodyState::REST; robot.scene().bodies.len()];
    robot.body_states(&mut states).unwrap();
    states
}

#[test]
fn the_robot_is_set_down_on_the_terrain() {
    let file = common::ball("placed");
    let z =
        placed(&format!(r#"{{"model": "{file}", "position_m": [1, 0, 7]}}"#))[0].world_from_body.position[2];
    // A ball on a ramp of slope s touches at R·√(1 + s²) above the ramp below its centre; lattice: a hair more.
    let exact = 0.2 + 0.03 * (1.0 + 0.04_f64).sqrt();
    assert!(z <= exact + 1e-12 && z > exact - 2e-3, "{z} {exact}");
    let free =
        placed(&format!(r#"{{"model": "{file}", "position_m": [1, 0, 7], "place_on_ground": false}}"#));
    assert_eq!(free[0].world_from_body.position[2], 7.0);
    let fixed = placed(&format!(r#"{{"model": "{file}", "position_m": [1, 0, 7], "fixed_base": true}}"#));
    assert_eq!(fixed[0].world_from_body.position[2], 7.0);
}

#[test]
fn a_fixed_base_stays_under_load() {
    let file = common::ball("fixed");
    let mut fixture = Fixture::new(
        &format!(r#"{{"model": "{file}", "position_m": [1, 2, 3], "fixed_base": true}}"#),
        9.81,
        1e-3,
    );
    fixture.set("ball.force_x", 1e3);
    (0..100).for_each(|_| fixture.free_step());
    for (name, expected) in [("ball.x", 1.0), ("ball.y", 2.0), ("ball.z", 3.0)] {
        assert!((fixture.get(name) - expected).abs() < 1e-10);
    }
}

#[test]
fn wrong_parameters_are_refused() {
    let refused = |parameters: &str, expected: &str| {
        let message = common::instantiate(parameters, 9.81).err().expect("a wrong parameter").to_string();
        assert!(message.contains(expected), "{message}");
    };
    refused(r#"{"model": "models/hexapot.urdf"}"#, "models/hexapot.urdf");
    refused(r#"{"model": "models/hexapod.urdf", "joints": {"LF_j9": 0.1}}"#, "did you mean `LF_j1`");
    refused(r#"{"model": "models/hexapod.urdf", "joints": {"LF_j1": 2.0}}"#, "-1.3 … 1.3");
    refused(r#"{"model": "models/hexapod.urdf", "position_m": [0, 0]}"#, "position_m");
    refused(r#"{"model": "models/hexapod.urdf", "motor": "steam"}"#, "steam");
}

#[test]
fn a_changing_step_length_keeps_joints_closed_and_energy_booked() {
    let mut fixture = Fixture::hexapod(0.33, 9.81, 1e-3);
    let before = fixture.balance();
    for k in 0..200 {
        fixture.h = [1e-3, 5e-4, 2.5e-4, 2e-3][k % 4];
        fixture.ground_step();
    }
    assert!((fixture.balance() - before).abs() < 1e-2, "{}", fixture.balance() - before);
    assert!(fixture.get("body.z") > 0.3);
}
