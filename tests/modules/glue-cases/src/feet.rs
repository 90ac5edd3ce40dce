//! A rigid body above its feet: heave (down), roll and pitch, small angles; each foot feels a vertical force.
//!
//! Foot i at (x, y) from the body's origin, centre of mass at (x0, y0): row J_i = (1, y − y0, −(x − x0)), depth
//! z_i = J_i·q, M·q̈ = (m·g, 0, 0) − Jᵀ·T. One foot at the centre of mass is the falling foot.

use crate::scheme::{Coordinate, Scheme};
use std::sync::Arc;
use terraglue_subsystem::{
    BodyState, Capabilities, Causality, Config, Energy, Error, Host, Input, Kind, Law, Level, Module, Motion,
    Parameter, ParameterType, Pose, Response, Result, Scene, SceneBody, Schema, Step, Subsystem, ValuesMut,
    Variable,
};

/// The module.
pub struct TableOnFeet {
    scheme: Scheme,
    inertia: [f64; 3],
    rows: Vec<[f64; 3]>,
    places: Vec<[f64; 2]>,
    gravity: f64,
    now: [Coordinate; 3],
    next: [Coordinate; 3],
    saved: Vec<[Coordinate; 3]>,
    x_now: Vec<f64>,
    port_work: f64,
    variables: Vec<Variable>,
}

const NAMES: [(&str, &str); 6] = [
    ("heave", "m"),
    ("roll", "rad"),
    ("pitch", "rad"),
    ("heave_rate", "m/s"),
    ("roll_rate", "rad/s"),
    ("pitch_rate", "rad/s"),
];

impl Module for TableOnFeet {
    fn schema() -> Schema {
        let mut parameters = vec![
            Parameter::of("mass_kg", ParameterType::Number, "Mass").positive(),
            Parameter::number("roll_inertia_kg_m2", "kg m^2", 1.0, "Moment of inertia in roll").positive(),
            Parameter::number("pitch_inertia_kg_m2", "kg m^2", 1.0, "Moment of inertia in pitch").positive(),
            Parameter::of("feet_m", ParameterType::Numbers, "x, y of every foot").or(vec![0.0, 0.0]),
            Parameter::of("offset_m", ParameterType::Numbers, "x, y of the centre of mass").optional(),
            Parameter::of("start", ParameterType::Numbers, "Heave (m, down), roll, pitch and their rates")
                .optional(),
        ];
        parameters.extend(Scheme::parameters());
        let help = "A rigid body above its feet".into();
        Schema { name: "table-on-feet".into(), kind: Kind::Robot, help, parameters }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let places: Vec<[f64; 2]> = config.numbers("feet_m")?.chunks_exact(2).map(|f| [f[0], f[1]]).collect();
        let mut offset = config.numbers("offset_m")?;
        offset.resize(2, 0.0);
        let mut start = config.numbers("start")?;
        start.resize(6, 0.0);
        let gravity = -host.gravity()[2];
        let coordinate = |k: usize| {
            let a = if k == 0 { gravity } else { 0.0 };
            Coordinate { q: start[k], v: start[3 + k], a, qdd: a }
        };
        let now = [0, 1, 2].map(coordinate);
        let output = |(id, (name, unit)): (usize, (&str, &str))| {
            Variable::real(id as u32, name, unit, Causality::Output, "motion of the body")
        };
        Ok(Box::new(Self {
            scheme: Scheme::read(config)?,
            inertia: [
                config.number("mass_kg")?,
                config.number("roll_inertia_kg_m2")?,
                config.number("pitch_inertia_kg_m2")?,
            ],
            rows: places.iter().map(|[x, y]| [1.0, y - offset[1], -(x - offset[0])]).collect(),
            places,
            gravity,
            now,
            next: now,
            saved: vec![now; host.slots() as usize],
            x_now: Vec::new(),
            port_work: 0.0,
            variables: NAMES.into_iter().enumerate().map(output).collect(),
        }))
    }
}

impl TableOnFeet {
    fn depth(&self, foot: usize, of: impl Fn(&Coordinate) -> f64, state: &[Coordinate; 3]) -> f64 {
        self.rows[foot].iter().zip(state).map(|(r, c)| r * of(c)).sum()
    }

    /// Motion upwards along the ports' directions.
    fn answer(&self, step: &Step, t: &[f64], out: &mut Response) {
        for port in step.ports {
            let foot = port.body as usize;
            for (i, c) in port.components() {
                let up = if c < 3 { port.direction(c)[2] } else { 0.0 };
                out.x[i] = -up * (self.depth(foot, |c| c.q, &self.next) + port.origin[2]);
                out.v[i] = -up * self.depth(foot, |c| c.v, &self.next);
                out.a[i] = -up * self.depth(foot, |c| c.qdd, &self.next);
                out.t[i] = t.get(i).copied().unwrap_or(0.0);
            }
        }
        out.reached = step.t + step.h;
    }
}

impl Subsystem for TableOnFeet {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE | Capabilities::RETRY | Capabilities::DERIVATIVES | Capabilities::STATE
    }

    fn set_ports(&mut self, step: &Step, _: &mut [Law], now: &mut Response) -> Result {
        self.next = self.now;
        self.answer(step, &[], now);
        self.x_now.clear();
        self.x_now.extend_from_slice(now.x);
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        let Input::Force { t, .. } = input else { return Err(Error::Unsupported) };
        let mut load = [self.inertia[0] * self.gravity, 0.0, 0.0];
        for port in step.ports {
            for (i, c) in port.components().filter(|(_, c)| *c < 3) {
                let up = port.direction(c)[2] * f64::from(port.side) * t[i];
                for (sum, r) in load.iter_mut().zip(&self.rows[port.body as usize]) {
                    *sum -= r * up;
                }
            }
        }
        for k in 0..3 {
            self.next[k] = self.scheme.finish(&self.now[k], step.h, load[k] / self.inertia[k]);
        }
        self.answer(step, t, out);
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        let n = step.n as usize;
        let factor = match level {
            Level::Position => self.scheme.q1(step.h),
            Level::Velocity => self.scheme.v1(step.h),
            Level::Acceleration => 1.0,
        };
        let each = || step.ports.iter().flat_map(|p| p.components().map(move |(i, c)| (p, i, c)));
        for (p, i, c) in each() {
            for (q, j, d) in each() {
                let (up_i, up_j) = (
                    if c < 3 { p.direction(c)[2] } else { 0.0 },
                    if d < 3 { q.direction(d)[2] } else { 0.0 },
                );
                let (a, b) = (&self.rows[p.body as usize], &self.rows[q.body as usize]);
                let sum: f64 = (0..3).map(|k| a[k] * b[k] / self.inertia[k]).sum();
                out[j * n + i] = factor * up_i * up_j * sum;
            }
        }
        Ok(())
    }

    fn commit(&mut self, step: &Step, t: &[f64], _: &Motion) -> Result {
        for port in step.ports {
            for (i, c) in port.components().filter(|(_, c)| *c < 3) {
                let moved = self.depth(port.body as usize, |c| c.q, &self.next)
                    - self.depth(port.body as usize, |c| c.q, &self.now);
                self.port_work -= f64::from(port.side) * t[i] * port.direction(c)[2] * moved;
            }
        }
        self.now = self.next;
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        *self.saved.get_mut(slot as usize).ok_or(Error::Unsupported)? = self.now;
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.now = *self.saved.get(slot as usize).ok_or(Error::Unsupported)?;
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::F64(out) = out else { return Err(Error::Unsupported) };
        for (id, value) in ids.iter().zip(out) {
            let c = self.now.get(*id as usize % 3).ok_or(Error::Unsupported)?;
            *value = if *id < 3 { c.q } else { c.v };
        }
        Ok(())
    }

    fn scene(&self) -> Scene {
        let share = self.inertia[0] / self.rows.len().max(1) as f64;
        let body = |k| SceneBody { name: format!("foot{k}"), mass: share };
        Scene { bodies: (0..self.rows.len()).map(body).collect(), shapes: Vec::new(), joints: Vec::new() }
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        for (k, (state, [x, y])) in out.iter_mut().zip(&self.places).enumerate() {
            let z = -self.depth(k, |c| c.q, &self.now);
            let v = -self.depth(k, |c| c.v, &self.now);
            let world_from_body = Pose { position: [*x, *y, z], ..Pose::IDENTITY };
            *state = BodyState { world_from_body, linear_velocity: [0.0, 0.0, v], ..BodyState::REST };
        }
        Ok(())
    }

    fn energy(&self) -> Energy {
        let kinetic = self.now.iter().zip(&self.inertia).map(|(c, m)| 0.5 * m * c.v * c.v).sum();
        let potential = -self.inertia[0] * self.gravity * self.now[0].q;
        Energy { kinetic, potential, port_work: self.port_work, ..Energy::default() }
    }
}
