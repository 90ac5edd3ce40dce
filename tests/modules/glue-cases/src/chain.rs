//! Masses on springs along x: M·q̈ + C·q̇ + K·q = Bᵀ·T.
//!
//! One mass is a half of the two-mass oscillator of Schüller et al. (2022); two with a spring between them are the
//! oscillator uncut. Linear, so every kind of input has a closed answer.

use crate::dense::Dense;
use crate::scheme::{Coordinate, Scheme};
use std::sync::Arc;
use terraglue_subsystem::{
    BodyState, Capabilities, Causality, Config, Energy, Error, Host, Input, Kind, Law, Level, Module, Motion,
    Parameter, ParameterType, Pose, Response, Result, Scene, SceneBody, Schema, Step, Subsystem, ValuesMut,
    Variable,
};

/// The module.
pub struct MassChain {
    scheme: Scheme,
    mass: Vec<f64>,
    spring: Vec<f64>,
    damper: Vec<f64>,
    coupling: (f64, f64),
    now: Vec<Coordinate>,
    next: Vec<Coordinate>,
    saved: Vec<Vec<Coordinate>>,
    /// Force on itself by port at the last trial.
    force: Vec<f64>,
    load: Vec<f64>,
    work: Vec<f64>,
    free: Vec<f64>,
    system: Dense,
    /// G of the step, row-major over components, and its factors.
    g: Vec<f64>,
    square: Dense,
    under_motion: bool,
    port_work: f64,
    variables: Vec<Variable>,
}

impl Module for MassChain {
    fn schema() -> Schema {
        let list = |name: &str, help: &str| Parameter::of(name, ParameterType::Numbers, help).optional();
        let mut parameters = vec![
            Parameter::of("mass_kg", ParameterType::Numbers, "Masses").positive(),
            list("spring_n_m", "Spring of each mass to the ground, N/m"),
            list("damper_n_s_m", "Damper of each mass to the ground, N s/m"),
            Parameter::number("coupling_n_m", "N/m", 0.0, "Spring between neighbours"),
            Parameter::number("coupling_n_s_m", "N s/m", 0.0, "Damper between neighbours"),
            list("position_m", "Positions at the start"),
            list("velocity_m_s", "Velocities at the start"),
        ];
        parameters.extend(Scheme::parameters());
        let help = "Masses on springs along x".into();
        Schema { name: "mass-chain".into(), kind: Kind::Robot, help, parameters }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let mass = config.numbers("mass_kg")?;
        let n = mass.len();
        let list = |name| {
            let mut values = config.numbers(name)?;
            values.resize(n, 0.0);
            Ok::<_, Error>(values)
        };
        let (q, v) = (list("position_m")?, list("velocity_m_s")?);
        let start = |(q, v): (&f64, &f64)| Coordinate { q: *q, v: *v, ..Coordinate::default() };
        let now: Vec<Coordinate> = q.iter().zip(&v).map(start).collect();
        let mut chain = Self {
            scheme: Scheme::read(config)?,
            spring: list("spring_n_m")?,
            damper: list("damper_n_s_m")?,
            coupling: (config.number("coupling_n_m")?, config.number("coupling_n_s_m")?),
            next: now.clone(),
            saved: vec![now.clone(); host.slots() as usize],
            now,
            force: Vec::new(),
            load: vec![0.0; n],
            work: Vec::new(),
            free: Vec::new(),
            system: Dense::default(),
            g: Vec::new(),
            square: Dense::default(),
            under_motion: false,
            port_work: 0.0,
            variables: variables(n),
            mass,
        };
        // accelerations without any port; a step of h = 0 sets those with the ports' forces
        chain.assemble(0.0);
        chain.solve(0.0);
        chain.now.clone_from(&chain.next);
        Ok(Box::new(chain))
    }
}

fn variables(n: usize) -> Vec<Variable> {
    let outputs = |k: usize| {
        [("x", "m"), ("v", "m/s"), ("a", "m/s^2")].into_iter().enumerate().map(move |(j, (name, unit))| {
            let id = (3 * k + j) as u32;
            Variable::real(id, format!("m{k}.{name}"), unit, Causality::Output, "motion of a mass")
        })
    };
    (0..n).flat_map(outputs).collect()
}

impl MassChain {
    /// Spring and damper force on mass k at a state.
    fn inner(&self, k: usize, q: impl Fn(usize) -> f64, v: impl Fn(usize) -> f64) -> f64 {
        let mut sum = -self.spring[k] * q(k) - self.damper[k] * v(k);
        let mut pull = |j: usize| sum += self.coupling.0 * (q(j) - q(k)) + self.coupling.1 * (v(j) - v(k));
        if k > 0 {
            pull(k - 1);
        }
        if k + 1 < self.mass.len() {
            pull(k + 1);
        }
        sum
    }

    /// Factors M + v1·C + q1·K.
    fn assemble(&mut self, h: f64) {
        let (n, q1, v1) = (self.mass.len(), self.scheme.q1(h), self.scheme.v1(h));
        self.system.reset(n);
        for k in 0..n {
            self.system.add(k, k, self.mass[k] + v1 * self.damper[k] + q1 * self.spring[k]);
            let c = q1 * self.coupling.0 + v1 * self.coupling.1;
            for j in [k.wrapping_sub(1), k + 1].into_iter().filter(|j| *j < n) {
                self.system.add(k, k, c);
                self.system.add(k, j, -c);
            }
        }
        self.system.factor();
    }

    /// The state at t + h under `load`, the port forces by mass.
    fn solve(&mut self, h: f64) {
        let mut x = std::mem::take(&mut self.work);
        let at = |k: usize| self.scheme.predict(&self.now[k], h);
        x.clear();
        x.extend((0..self.mass.len()).map(|k| self.load[k] + self.inner(k, |j| at(j).q0, |j| at(j).v0)));
        self.system.solve(&mut x);
        for (k, qdd) in x.iter().enumerate() {
            self.next[k] = self.scheme.finish(&self.now[k], h, *qdd);
        }
        self.work = x;
    }

    /// A free mass under a force that holds over the step.
    fn solve_exactly(&mut self, h: f64) {
        for k in 0..self.mass.len() {
            let (now, m, f) = (self.now[k], self.mass[k], self.load[k]);
            self.next[k] = Coordinate {
                q: now.q + h * now.v + 0.5 * h * h * f / m,
                v: now.v + h * f / m,
                a: f / m,
                qdd: f / m,
            };
        }
    }

    /// x components of the ports: (packed index, mass, direction along x).
    fn components<'a>(step: &'a Step) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
        step.ports.iter().flat_map(|p| {
            p.components()
                .map(move |(i, c)| (i, p.body as usize, if c < 3 { p.direction(c)[0] } else { 0.0 }))
        })
    }

    /// Applies `force` (on itself, packed) and moves.
    fn advance_under(&mut self, step: &Step) {
        self.load.fill(0.0);
        for (i, k, d) in Self::components(step) {
            self.load[k] += d * self.force[i];
        }
        match self.scheme.exact {
            true => self.solve_exactly(step.h),
            false => self.solve(step.h),
        }
    }

    /// G at a level per unit force on itself.
    fn compliance(&mut self, step: &Step, level: Level) {
        let n = step.n as usize;
        self.g.clear();
        self.g.resize(n * n, 0.0);
        let factor = match level {
            Level::Position if self.scheme.exact => 0.5 * step.h * step.h,
            Level::Velocity if self.scheme.exact => step.h,
            Level::Position => self.scheme.q1(step.h),
            Level::Velocity => self.scheme.v1(step.h),
            Level::Acceleration => 1.0,
        };
        let mut x = std::mem::take(&mut self.work);
        for (i, k, d) in Self::components(step) {
            x.clear();
            x.resize(self.mass.len(), 0.0);
            x[k] = d;
            if self.scheme.exact {
                x[k] /= self.mass[k]
            } else {
                self.system.solve(&mut x)
            }
            for (j, l, e) in Self::components(step) {
                self.g[j * n + i] = factor * e * x[l];
            }
        }
        self.work = x;
    }

    fn answer(&self, step: &Step, out: &mut Response) {
        for port in step.ports {
            for (i, c) in port.components() {
                let (d, k) = (port.direction(c), port.body as usize);
                let along = if c < 3 { d[0] } else { 0.0 };
                out.x[i] = along * (self.next[k].q - port.origin[0]);
                out.v[i] = along * self.next[k].v;
                out.a[i] = along * self.next[k].qdd;
                out.t[i] = f64::from(port.side) * self.force[i];
            }
        }
        out.reached = step.t + step.h;
    }

    /// The force on itself that gives the prescribed X, from the free motion.
    fn solve_for_force(&mut self, step: &Step, x: &[f64]) -> Result {
        let n = step.n as usize;
        self.force.clear();
        self.force.resize(n, 0.0);
        self.advance_under(step);
        let mut free = std::mem::take(&mut self.free);
        free.clear();
        free.resize(n, 0.0);
        for port in step.ports {
            for (i, c) in port.components() {
                free[i] = port.direction(c)[0] * (self.next[port.body as usize].q - port.origin[0]);
            }
        }
        self.compliance(step, Level::Position);
        self.square.reset(n);
        for r in 0..n {
            for c in 0..n {
                self.square.add(r, c, self.g[r * n + c]);
            }
        }
        if !self.square.factor() {
            return Err(Error::Failed("a component is not free to move along x".into()));
        }
        (0..n).for_each(|i| self.force[i] = x[i] - free[i]);
        self.square.solve(&mut self.force);
        self.free = free;
        self.advance_under(step);
        Ok(())
    }
}

fn side_of(step: &Step, component: usize) -> i32 {
    step.ports.iter().find(|p| p.range().contains(&component)).map_or(1, |p| p.side)
}

impl Subsystem for MassChain {
    fn capabilities(&self) -> Capabilities {
        let all = Capabilities::FORCE | Capabilities::RETRY | Capabilities::DERIVATIVES | Capabilities::STATE;
        if self.scheme.exact {
            return all | Capabilities::SUBCYCLES;
        }
        all | Capabilities::MOTION
    }

    fn set_ports(&mut self, step: &Step, _: &mut [Law], now: &mut Response) -> Result {
        self.force.resize(step.n as usize, 0.0);
        self.next.clone_from(&self.now);
        self.answer(step, now);
        self.assemble(step.h);
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        self.assemble(step.h);
        self.under_motion = false;
        match input {
            Input::Force { t, .. } => {
                self.force.clear();
                self.force.extend((0..step.n as usize).map(|i| f64::from(side_of(step, i)) * t[i]));
                self.advance_under(step);
            }
            Input::Motion(m) if !self.scheme.exact => {
                self.solve_for_force(step, m.x)?;
                self.under_motion = true;
            }
            _ => return Err(Error::Unsupported),
        }
        self.answer(step, out);
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        let n = step.n as usize;
        self.compliance(step, level);
        if !self.under_motion {
            (0..n * n).for_each(|k| out[k] = self.g[(k % n) * n + k / n]);
            return Ok(());
        }
        // K = G⁻¹
        self.square.reset(n);
        (0..n * n).for_each(|k| self.square.add(k / n, k % n, self.g[k]));
        self.square.factor();
        for column in out.chunks_exact_mut(n).enumerate() {
            column.1.fill(0.0);
            column.1[column.0] = 1.0;
            self.square.solve(column.1);
        }
        Ok(())
    }

    fn commit(&mut self, step: &Step, _: &[f64], _: &Motion) -> Result {
        for (i, k, d) in Self::components(step) {
            self.port_work += d * self.force[i] * (self.next[k].q - self.now[k].q);
        }
        self.now.clone_from(&self.next);
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let room = self.saved.get_mut(slot as usize).ok_or(Error::Unsupported)?;
        room.clone_from(&self.now);
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let kept = self.saved.get(slot as usize).ok_or(Error::Unsupported)?;
        self.now.clone_from(kept);
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::F64(out) = out else { return Err(Error::Unsupported) };
        for (id, value) in ids.iter().zip(out) {
            let c = self.now.get(*id as usize / 3).ok_or(Error::Unsupported)?;
            *value = [c.q, c.v, c.qdd][*id as usize % 3];
        }
        Ok(())
    }

    fn scene(&self) -> Scene {
        let body = |(k, mass): (usize, &f64)| SceneBody { name: format!("m{k}"), mass: *mass };
        Scene {
            bodies: self.mass.iter().enumerate().map(body).collect(),
            shapes: Vec::new(),
            joints: Vec::new(),
        }
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        for (state, c) in out.iter_mut().zip(&self.now) {
            let world_from_body = Pose { position: [c.q, 0.0, 0.0], ..Pose::IDENTITY };
            *state = BodyState { world_from_body, linear_velocity: [c.v, 0.0, 0.0], ..BodyState::REST };
        }
        Ok(())
    }

    fn energy(&self) -> Energy {
        let kinetic = self.now.iter().zip(&self.mass).map(|(c, m)| 0.5 * m * c.v * c.v).sum();
        let springs: f64 = self.now.iter().zip(&self.spring).map(|(c, k)| 0.5 * k * c.q * c.q).sum();
        let between: f64 =
            self.now.windows(2).map(|w| 0.5 * self.coupling.0 * (w[1].q - w[0].q) * (w[1].q - w[0].q)).sum();
        Energy { kinetic, potential: springs + between, port_work: self.port_work, ..Energy::default() }
    }
}
