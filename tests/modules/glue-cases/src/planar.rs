//! Rigid bodies in the x-y plane with pins, integrated at position level.
//!
//! M·q̈⁺ + Φ_qᵀ·λ⁺ = Q⁺ + Jᵀ·T⁺ and Φ(q⁺) = 0 with (x, y, θ) of every centre of mass; Newton on (q̈⁺, λ⁺) until the
//! corrections are rounding. A step of h = 0 solves the same at acceleration level: Φ_q·q̈ = −(Φ_q·q̇)_q·q̇.
//! G = J·A⁻¹·Jᵀ with the upper block of the inverse KKT matrix A at the last iterate.

use crate::dense::Dense;
use crate::mechanism::{Mechanism, Point, read_mechanism};
use crate::scheme::{Coordinate, Scheme};
use std::sync::Arc;
use terraglue_subsystem::{
    BodyState, Capabilities, Causality, Config, Energy, Error, Host, Input, Kind, Law, Level, Module, Motion,
    Parameter, ParameterType, Pose, Response, Result, Scene, SceneBody, Schema, Step, Subsystem, ValuesMut,
    Variable,
};

/// Newton iterations of a trial.
const MAX_ITERATIONS: usize = 40;

/// The module.
pub struct PlanarBodies {
    scheme: Scheme,
    mechanism: Mechanism,
    now: Vec<Coordinate>,
    next: Vec<Coordinate>,
    lambda: Vec<f64>,
    lambda_now: Vec<f64>,
    saved: Vec<(Vec<Coordinate>, Vec<f64>)>,
    ports: Vec<Component>,
    kkt: Dense,
    right: Vec<f64>,
    port_work: f64,
    variables: Vec<Variable>,
}

/// A packed component: a direction at a point of a body.
#[derive(Clone, Copy)]
struct Component {
    body: usize,
    /// The material point in the body's frame.
    local: [f64; 2],
    /// Force direction in the plane; zero for a moment.
    direction: [f64; 2],
    /// Share of a moment about z.
    moment: f64,
    side: f64,
}

impl Module for PlanarBodies {
    fn schema() -> Schema {
        let list = |name: &str, help: &str| Parameter::of(name, ParameterType::Numbers, help);
        let mut parameters = vec![
            list("mass_kg", "Masses").positive(),
            list("inertia_kg_m2", "Moments of inertia about the centres of mass").positive(),
            list(
                "pose",
                "x, y (m) and angle (rad) of every centre of mass at the start, one after the other",
            ),
            list("rate", "Their rates at the start").optional(),
            list("pins", "body, body (-1: world), x, y of every pin at the start").optional(),
            list("spring", "body, x, y at the start, x, y in the world, stiffness N/m, rest length m")
                .optional(),
            list("torque", "body, constant torque N m").optional(),
        ];
        parameters.extend(Scheme::parameters());
        let help = "Rigid bodies in a plane with pins".into();
        Schema { name: "planar-bodies".into(), kind: Kind::Robot, help, parameters }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let (mechanism, now) = read_mechanism(config, host.gravity())?;
        let lambda = vec![0.0; 2 * mechanism.pins.len()];
        let state = (now.clone(), lambda.clone());
        let mut bodies = Self {
            scheme: Scheme::read(config)?,
            variables: variables(mechanism.mass.len()),
            next: now.clone(),
            lambda: lambda.clone(),
            lambda_now: lambda,
            saved: vec![state; host.slots() as usize],
            now,
            mechanism,
            ports: Vec::new(),
            kkt: Dense::default(),
            right: Vec::new(),
            port_work: 0.0,
        };
        bodies.solve(0.0, &[])?;
        bodies.now.clone_from(&bodies.next);
        bodies.lambda_now.clone_from(&bodies.lambda);
        Ok(Box::new(bodies))
    }
}

fn variables(n: usize) -> Vec<Variable> {
    let names = [("x", "m"), ("y", "m"), ("angle", "rad"), ("vx", "m/s"), ("vy", "m/s"), ("omega", "rad/s")];
    let outputs = |k: usize| {
        names.into_iter().enumerate().map(move |(j, (name, unit))| {
            let id = (6 * k + j) as u32;
            Variable::real(id, format!("b{k}.{name}"), unit, Causality::Output, "motion of a body")
        })
    };
    (0..n).flat_map(outputs).collect()
}

impl PlanarBodies {
    /// Newton for the state at t + h (or, for h = 0, the accelerations at t) under T on side 1.
    fn solve(&mut self, h: f64, t: &[f64]) -> Result {
        let n = self.now.len();
        let q1 = self.scheme.q1(h);
        let mut x: Vec<f64> = self.now.iter().map(|c| c.qdd).collect();
        self.lambda.clone_from(&self.lambda_now);
        let mut before = f64::INFINITY;
        for _ in 0..MAX_ITERATIONS {
            for (next, (now, x)) in self.next.iter_mut().zip(self.now.iter().zip(&x)) {
                *next = self.scheme.finish(now, h, *x);
            }
            self.assemble(h, q1, t, &x);
            if !self.kkt.factor() {
                return Err(Error::Failed("the constraints are dependent in this position".into()));
            }
            self.kkt.solve(&mut self.right);
            let scale = x.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
            let size = self.right[..n].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (x, d) in x.iter_mut().zip(&self.right) {
                *x += d;
            }
            for (l, d) in self.lambda.iter_mut().zip(&self.right[n..]) {
                *l += d;
            }
            let rounding = if h > 0.0 { 4e-16 / q1 } else { 0.0 };
            // the gaps of pins far from the origin are known less well: then the corrections stop shrinking
            let stuck = size <= 100.0 * rounding && size >= 0.5 * before;
            before = size;
            if size <= 1e-12 * scale + rounding || stuck {
                for (next, (now, x)) in self.next.iter_mut().zip(self.now.iter().zip(&x)) {
                    *next = self.scheme.finish(now, h, *x);
                }
                return Ok(());
            }
        }
        Err(Error::Failed(format!("the pins did not close within {MAX_ITERATIONS} iterations")))
    }

    /// KKT matrix and right-hand side −residual at the present iterate.
    fn assemble(&mut self, h: f64, q1: f64, t: &[f64], x: &[f64]) {
        let (n, m) = (self.now.len(), self.lambda.len());
        self.kkt.reset(n + m);
        self.right.clear();
        self.right.resize(n + m, 0.0);
        let next = &self.next;
        let q = |i: usize| next[i].q;
        for i in 0..n {
            let mass = self.mechanism.inertia(i);
            self.kkt.add(i, i, mass);
            self.right[i] -= mass * x[i];
        }
        self.mechanism.loads(q, q1, &mut self.kkt, &mut self.right);
        for (component, t) in self.ports.iter().zip(t) {
            let point = Point { body: component.body, local: component.local };
            let f = component.direction.map(|d| d * component.side * t);
            point.force(q, f, q1, &mut self.kkt, &mut self.right);
            self.right[3 * component.body + 2] += component.side * t * component.moment;
        }
        // constraint rows: Φ_q·Δq̈ = −Φ/q1, at acceleration level −(Φ_q·q̈ + γ)
        for (p, pin) in self.mechanism.pins.iter().enumerate() {
            let lambda = [self.lambda[2 * p], self.lambda[2 * p + 1]];
            let gap = pin.gap(q);
            let rates = pin.acceleration(|i| next[i].q, |i| next[i].v, |i| x[i]);
            for k in 0..2 {
                self.right[n + 2 * p + k] = if h > 0.0 { -gap[k] / q1 } else { -rates[k] };
            }
            pin.assemble(q, lambda, q1, n + 2 * p, &mut self.kkt, &mut self.right);
        }
    }

    fn row(&self, c: &Component, q: impl Fn(usize) -> f64) -> [f64; 3] {
        let arm = Point { body: c.body, local: c.local }.arm(q);
        let [dx, dy] = c.direction;
        [dx, dy, dy * arm[0] - dx * arm[1] + c.moment]
    }

    /// The motion at the ports over h: displacements, not differences of places, so that they are exact to
    /// rounding of themselves.
    fn answer(&self, step: &Step, h: f64, t: &[f64], out: &mut Response) {
        for (i, c) in self.ports.iter().enumerate() {
            let at = |k: usize| self.next[k].q;
            let point = Point { body: c.body, local: c.local };
            let row = self.row(c, at);
            let moved = [0, 1, 2].map(|k| {
                let j = 3 * c.body + k;
                self.scheme.displacement(&self.now[j], h, self.next[j].qdd)
            });
            let before = point.arm(|k| self.now[k].q);
            // (R(Δθ) − 1)·arm
            let (half, sine) = (libm::sin(0.5 * moved[2]), libm::sin(moved[2]));
            let shrink = -2.0 * half * half;
            let x = moved[0] + shrink * before[0] - sine * before[1];
            let y = moved[1] + shrink * before[1] + sine * before[0];
            out.x[i] = c.direction[0] * x + c.direction[1] * y + c.moment * moved[2];
            out.v[i] = (0..3).map(|k| row[k] * self.next[3 * c.body + k].v).sum();
            let arm = point.arm(at);
            let w = self.next[3 * c.body + 2].v;
            let centripetal = -w * w * (c.direction[0] * arm[0] + c.direction[1] * arm[1]);
            out.a[i] = centripetal + (0..3).map(|k| row[k] * self.next[3 * c.body + k].qdd).sum::<f64>();
            out.t[i] = t.get(i).copied().unwrap_or(0.0);
        }
        out.reached = step.t + step.h;
    }
}

impl Subsystem for PlanarBodies {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE | Capabilities::RETRY | Capabilities::DERIVATIVES | Capabilities::STATE
    }

    fn set_ports(&mut self, step: &Step, _: &mut [Law], now: &mut Response) -> Result {
        self.ports.clear();
        for port in step.ports {
            if 3 * port.body as usize >= self.now.len() {
                return Err(Error::Refused(format!("there is no body {}", port.body)));
            }
            let body = port.body as usize;
            let origin = [port.origin[0], port.origin[1]];
            let local = Point::local(body, origin, |i| self.now[i].q);
            for (_, c) in port.components() {
                let d = port.direction(c);
                let (direction, moment) = if c < 3 { ([d[0], d[1]], 0.0) } else { ([0.0; 2], d[2]) };
                self.ports.push(Component { body, local, direction, moment, side: f64::from(port.side) });
            }
        }
        self.next.clone_from(&self.now);
        self.answer(step, 0.0, &[], now);
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        let Input::Force { t, .. } = input else { return Err(Error::Unsupported) };
        self.solve(step.h, t)?;
        self.answer(step, step.h, t, out);
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        let n = step.n as usize;
        let factor = match level {
            Level::Position => self.scheme.q1(step.h),
            Level::Velocity => self.scheme.v1(step.h),
            Level::Acceleration => 1.0,
        };
        for (column, c) in self.ports.iter().enumerate() {
            self.right.fill(0.0);
            let row = self.row(c, |i| self.next[i].q);
            self.right[3 * c.body..][..3].copy_from_slice(&row);
            self.kkt.solve(&mut self.right);
            for (r, d) in self.ports.iter().enumerate() {
                let row = self.row(d, |i| self.next[i].q);
                let sum: f64 = (0..3).map(|k| row[k] * self.right[3 * d.body + k]).sum();
                out[column * n + r] = factor * sum;
            }
        }
        Ok(())
    }

    fn commit(&mut self, _: &Step, t: &[f64], _: &Motion) -> Result {
        for (c, t) in self.ports.iter().zip(t) {
            let row = self.row(c, |i| 0.5 * (self.now[i].q + self.next[i].q));
            let moved: f64 =
                (0..3).map(|k| row[k] * (self.next[3 * c.body + k].q - self.now[3 * c.body + k].q)).sum();
            self.port_work += c.side * t * moved;
        }
        self.now.clone_from(&self.next);
        self.lambda_now.clone_from(&self.lambda);
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let room = self.saved.get_mut(slot as usize).ok_or(Error::Unsupported)?;
        room.0.clone_from(&self.now);
        room.1.clone_from(&self.lambda_now);
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let kept = self.saved.get(slot as usize).ok_or(Error::Unsupported)?;
        self.now.clone_from(&kept.0);
        self.lambda_now.clone_from(&kept.1);
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::F64(out) = out else { return Err(Error::Unsupported) };
        for (id, value) in ids.iter().zip(out) {
            let (body, k) = (*id as usize / 6, *id as usize % 6);
            let c = self.now.get(3 * body + k % 3).ok_or(Error::Unsupported)?;
            *value = if k < 3 { c.q } else { c.v };
        }
        Ok(())
    }

    fn scene(&self) -> Scene {
        let body = |(k, mass): (usize, &f64)| SceneBody { name: format!("b{k}"), mass: *mass };
        Scene {
            bodies: self.mechanism.mass.iter().enumerate().map(body).collect(),
            shapes: Vec::new(),
            joints: Vec::new(),
        }
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        for (state, c) in out.iter_mut().zip(self.now.chunks_exact(3)) {
            let half = 0.5 * c[2].q;
            *state = BodyState {
                world_from_body: Pose {
                    position: [c[0].q, c[1].q, 0.0],
                    orientation: [libm::cos(half), 0.0, 0.0, libm::sin(half)],
                },
                linear_velocity: [c[0].v, c[1].v, 0.0],
                angular_velocity: [0.0, 0.0, c[2].v],
            };
        }
        Ok(())
    }

    fn energy(&self) -> Energy {
        let kinetic =
            self.now.iter().enumerate().map(|(i, c)| 0.5 * self.mechanism.inertia(i) * c.v * c.v).sum();
        let potential = self.mechanism.potential(|i| self.now[i].q);
        Energy { kinetic, potential, port_work: self.port_work, ..Energy::default() }
    }
}
