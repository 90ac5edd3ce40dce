//! The force of a contact port acts where the foot is when the rule takes forces, not where it was at the start.
//!
//! A free body with a foot far from its centre of mass on a springy, viscous ground, in a plane, against Runge–Kutta. The
//! ball is pressed at its lowest point, which stays below its centre as it turns: about the point of the body that the port was put on
//! this force has a moment. The plate is pressed at that point.

use crate::common;
use common::{Fixture, temporary_urdf};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{Input, Law, Motion, Port, PortKind, Response, Step, component};

/// Centre of the foot from that of mass in body axes, x and z, and how far below it the sole is, m.
const FOOT: [f64; 2] = [0.4, -0.3];
const RADIUS: f64 = 0.1;
const MASS: f64 = 2.0;
const INERTIA: f64 = 0.5;
const GRAVITY: f64 = 1.62;
/// Rates at the start: along x, about y.
const RATE: [f64; 2] = [0.3, 1.5];
/// Spring along z (N/m) from z = 0, damper along x (N s/m), spring against turning of the plate (N m/rad).
const SPRING: f64 = 40.0;
const DAMPER: f64 = 4.0;
const TURN_SPRING: f64 = 3.0;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Foot {
    Ball,
    Plate,
}

impl Foot {
    fn shape(self) -> &'static str {
        if self == Self::Ball { r#"<sphere radius="0.1"/>"# } else { r#"<box size="0.2 0.2 0.2"/>"# }
    }

    /// From the centre of mass to where the ground pushes, x and z, at a pitch.
    fn arm(self, pitch: f64) -> [f64; 2] {
        let below = |[x, z]: [f64; 2]| [x, z - RADIUS];
        if self == Self::Ball { below(turned(FOOT, pitch)) } else { turned(below(FOOT), pitch) }
    }

    /// Force along x and z and moment about y on the foot where it stands at z, moves with vx and is turned by pitch; the moment about
    /// the point of the body that was its lowest one `turn` ago.
    fn law(self, z: f64, vx: f64, pitch: f64, turn: f64) -> [f64; 3] {
        let [along, up] = [-DAMPER * vx, -SPRING * z];
        let moment = match self {
            Self::Ball => {
                let [x, z] = turned([0.0, -RADIUS], turn);
                (-RADIUS - z) * along + x * up
            }
            Self::Plate => -TURN_SPRING * pitch,
        };
        [along, up, moment]
    }
}

/// A vector of the plane, x and z, turned about y.
fn turned([x, z]: [f64; 2], pitch: f64) -> [f64; 2] {
    let (sin, cos) = (libm::sin(pitch), libm::cos(pitch));
    [x * cos + z * sin, z * cos - x * sin]
}

fn body(foot: Foot, integrator: &str, h: f64) -> Fixture {
    let (shape, [x, z]) = (foot.shape(), FOOT);
    let file = temporary_urdf(
        &format!("contact_arm_{foot:?}_{integrator}"),
        &format!(
            r#"<robot name="body"><link name="body"><inertial><mass value="{MASS}"/>
            <inertia ixx="{INERTIA}" iyy="{INERTIA}" izz="{INERTIA}" ixy="0" ixz="0" iyz="0"/></inertial>
            <collision><origin xyz="{x} 0 {z}"/><geometry>{shape}</geometry></collision></link></robot>"#
        ),
    );
    let [vx, wy] = RATE;
    let parameters = format!(
        r#"{{"model": "{file}", "integrator": "{integrator}", "velocity_m_s": [{vx}, 0, 0],
        "rotation_rate_rad_s": [0, {wy}, 0], "position_m": [0, 0, 0.3]}}"#
    );
    Fixture::new(&parameters, GRAVITY, h)
}

/// Pitch and position of the body.
fn pose(fixture: &Fixture) -> [f64; 3] {
    let pose = fixture.states()[0].world_from_body;
    let [w, _, y, _] = pose.orientation;
    [pose.position[0], pose.position[2], 2.0 * libm::atan2(y, w)]
}

fn port(fixture: &Fixture, foot: Foot) -> Port {
    let [x, z, pitch] = pose(fixture);
    let [rx, rz] = foot.arm(pitch);
    Port {
        key: 1,
        kind: PortKind::Contact as u32,
        side: 1,
        mask: component::WRENCH,
        first: 0,
        body: 0,
        shape: fixture.scene.shapes[0].id,
        first_node: 0,
        node_count: 0,
        origin: [x + rx, 0.0, z + rz],
        frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        extent: [0.0; 2],
        law: Law::BILATERAL,
    }
}

/// A step of length h with the ground's law where the rule takes forces: at the end, or in the middle of the step.
fn step(fixture: &mut Fixture, foot: Foot, h: f64, middle: bool) {
    let (ports, pitch) = ([port(fixture, foot)], pose(fixture)[2]);
    let n = ports[0].len();
    let step = Step { ports: &ports, n: n as u32, ..Step::free(fixture.t, h, fixture.index) };
    let [mut x, mut v, mut a, mut out_t] = [0; 4].map(|_| vec![0.0; n]);
    let mut t = vec![0.0; n];
    let mut now = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut out_t, reached: 0.0, flags: 0 };
    fixture.robot.set_ports(&step, &mut [Law::BILATERAL], &mut now).unwrap();
    for _ in 0..60 {
        let share = if middle { 0.5 } else { 1.0 };
        let rate = if middle && h > 0.0 { x[1] / h } else { v[1] };
        let turn = share * x[5];
        let [along, up, moment] = foot.law(ports[0].origin[2] + share * x[0], rate, pitch + turn, turn);
        let wanted = [up, along, 0.0, 0.0, 0.0, moment];
        let change = t.iter().zip(wanted).fold(0.0_f64, |m, (t, w)| larger(m, (t - w).abs()));
        t.copy_from_slice(&wanted);
        let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut out_t, reached: 0.0, flags: 0 };
        fixture.robot.advance(&step, &Input::Force { t: &t, motion: None }, &mut out).unwrap();
        if change < 1e-12 {
            fixture.robot.commit(&step, &t, &Motion { x: &x, v: &v }).unwrap();
            fixture.t += h;
            fixture.index += u64::from(h > 0.0);
            return;
        }
    }
    panic!("the law and the body do not agree");
}

/// x, z and pitch after a second, from Runge–Kutta steps of 0.1 ms.
fn reference(foot: Foot) -> [f64; 3] {
    let slope = |s: [f64; 6]| {
        let [_, z, pitch, vx, vz, w] = s;
        let [rx, rz] = foot.arm(pitch);
        let [fx, fz, moment] = foot.law(z + rz, vx + w * rz, pitch, 0.0);
        [vx, vz, w, fx / MASS, fz / MASS - GRAVITY, (moment + rz * fx - rx * fz) / INERTIA]
    };
    let moved = |s: [f64; 6], by: f64, k: [f64; 6]| std::array::from_fn(|i| s[i] + by * k[i]);
    let (mut s, h) = ([0.0, 0.3, 0.0, RATE[0], 0.0, RATE[1]], 1e-4);
    for _ in 0..10_000 {
        let k1 = slope(s);
        let k2 = slope(moved(s, 0.5 * h, k1));
        let k3 = slope(moved(s, 0.5 * h, k2));
        let k4 = slope(moved(s, h, k3));
        s = std::array::from_fn(|i| s[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    [s[0], s[1], s[2]]
}

/// Largest error after a second, m or rad.
fn error(foot: Foot, integrator: &str, h: f64) -> f64 {
    let mut fixture = body(foot, integrator, h);
    let middle = integrator == "energy-momentum";
    if integrator == "generalized-alpha" {
        step(&mut fixture, foot, 0.0, false);
    }
    (0..(1.0 / h).round() as usize).for_each(|_| step(&mut fixture, foot, h, middle));
    pose(&fixture).iter().zip(reference(foot)).fold(0.0_f64, |m, (a, b)| larger(m, (a - b).abs()))
}

/// Order between the two shortest of three steps and the error at the shortest.
fn order(foot: Foot, integrator: &str) -> (f64, f64) {
    let [a, b, c] = [1e-2, 5e-3, 2.5e-3].map(|h| error(foot, integrator, h));
    println!("{foot:?} {integrator}: {a:e} {b:e} {c:e}");
    (libm::log2(b / c), c)
}

#[test]
fn rules_of_second_order_converge_with_second_order() {
    for foot in [Foot::Ball, Foot::Plate] {
        for integrator in ["generalized-alpha", "energy-momentum"] {
            let (order, off) = order(foot, integrator);
            assert!((1.9..2.2).contains(&order) && off < 1e-4, "{foot:?} {integrator}: {order} {off:e}");
        }
    }
}

#[test]
fn the_rule_of_first_order_converges_with_first_order() {
    for foot in [Foot::Ball, Foot::Plate] {
        let (order, _) = order(foot, "symplectic-euler");
        assert!((0.8..1.2).contains(&order), "{foot:?}: {order}");
    }
}
