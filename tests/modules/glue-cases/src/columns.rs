//! Independent soil columns, one per port: T = K·zⁿ on first loading, else max(0, F_m − k_u·(z_m − z)); no tension.
//!
//! z_m is the largest depth so far, F_m = K·z_mⁿ. A column may carry a lumped mass that moves with its foot, or be
//! rigid and yield at a cap. Depths are measured down from z = 0 of the world.

use std::sync::Arc;
use terraglue_subsystem::{
    BodyState, Capabilities, Causality, Config, Energy, Error, Estimate, Host, Input, Kind, Law, Level,
    Module, Motion, Parameter, ParameterType, Pose, Response, Result, Scene, SceneBody, Schema, Step,
    Subsystem, ValuesMut, Variable,
};

/// At this force a power law with n < 1 is given a finite tangent at z = 0, N.
const REGULAR_N: f64 = 1e-3;

/// Outputs.
const OUTPUTS: [(&str, &str); 2] =
    [("max_sinkage", "Deepest that any column was"), ("print", "Deepest column when it is free of force")];

/// The module.
pub struct PowerColumns {
    columns: Vec<Column>,
    rigid: bool,
    echo: bool,
    saved: Vec<Vec<Column>>,
    /// Per port: depth and slope at the last trial.
    trials: Vec<Trial>,
    under_motion: bool,
    dissipated: f64,
    port_work: f64,
    variables: Vec<Variable>,
}

#[derive(Clone, Copy, Debug)]
struct Column {
    k: f64,
    n: f64,
    k_u: f64,
    cap: f64,
    mass: f64,
    z: f64,
    z_max: f64,
    v: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Trial {
    z: f64,
    slope: f64,
}

impl Column {
    fn virgin(&self, z: f64) -> f64 {
        self.k * libm::pow(z.max(0.0), self.n)
    }

    fn peak(&self) -> f64 {
        self.virgin(self.z_max)
    }

    /// Force and slope at a depth.
    fn force(&self, z: f64) -> (f64, f64) {
        if z < self.z_max {
            let f = self.peak() - self.k_u * (self.z_max - z);
            return if f > 0.0 { (f, self.k_u) } else { (0.0, 0.0) };
        }
        let regular = libm::pow(REGULAR_N / self.k, 1.0 / self.n);
        let slope = if z <= 0.0 { 0.0 } else { self.k * self.n * libm::pow(z.max(regular), self.n - 1.0) };
        (self.virgin(z), slope)
    }

    /// Depth and dz/dT under a force.
    fn depth(&self, t: f64) -> (f64, f64) {
        let peak = self.peak();
        if t < peak {
            return (self.z_max - (peak - t) / self.k_u, 1.0 / self.k_u);
        }
        let z = libm::pow(t.max(0.0) / self.k, 1.0 / self.n);
        let at = libm::pow(t.max(REGULAR_N) / self.k, 1.0 / self.n);
        (z, at / (self.n * t.max(REGULAR_N)))
    }

    /// Depth at which the column is free of force.
    fn free(&self) -> f64 {
        if self.z_max > 0.0 { self.z_max - self.peak() / self.k_u } else { 0.0 }
    }

    /// The same with the lumped mass: m_s·(z − z_n − h·v_n)/h² + F(z) = T, by a safeguarded Newton on the way u from
    /// where the mass would go by itself, so that a heavy mass does not lose digits.
    fn depth_with_mass(&self, t: f64, h: f64) -> (f64, f64) {
        let m = self.mass / (h * h);
        let base = self.z + h * self.v;
        let residual = |u: f64| m * u + self.force(base + u).0 - t;
        let reach = (self.depth(t.max(0.0)).0 - base).abs() + t.abs() / m + self.force(base).0 / m;
        let (mut low, mut high) = (-reach - 1e-9, reach + 1e-9);
        let mut u = 0.0;
        for _ in 0..200 {
            let r = residual(u);
            if r > 0.0 {
                high = u
            } else {
                low = u
            }
            let newton = u - r / (m + self.force(base + u).1);
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let change = (next - u).abs();
            u = next;
            if change <= 1e-24 + 2e-16 * u.abs() {
                break;
            }
        }
        (base + u, 1.0 / (m + self.force(base + u).1))
    }
}

impl Module for PowerColumns {
    fn schema() -> Schema {
        let list = |name: &str, help: &str| Parameter::of(name, ParameterType::Numbers, help);
        Schema {
            name: "power-columns".into(),
            kind: Kind::Soil,
            help: "Independent soil columns".into(),
            parameters: vec![
                list("K", "Stiffness of first loading of every column, N/m^n").positive(),
                list("n", "Exponent of every column; one value holds for all").or(vec![1.0]).positive(),
                list("k_u", "Stiffness of unloading, N/m; default 40 K").optional(),
                list("cap", "Force at which a column yields, N").optional(),
                list("soil_mass_kg", "Mass that moves with the foot").optional(),
                list("z_start", "Depth that every column has been pressed to, m").optional(),
                list("v_start", "Rate of the columns' mass at the start, m/s").optional(),
                Parameter::of(
                    "echo_estimate",
                    ParameterType::Bool,
                    "Answer T* itself: a control, which never sinks",
                )
                .or(false),
                Parameter::of("rigid", ParameterType::Bool, "No compliance below the cap").or(false),
            ],
        }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let k = config.numbers("K")?;
        let list = |name: &str, default: &dyn Fn(usize) -> f64| {
            let values = config.numbers(name)?;
            let value = |i: usize| values.get(i).or(values.first()).copied().unwrap_or_else(|| default(i));
            Ok::<Vec<f64>, Error>((0..k.len()).map(value).collect())
        };
        let n = list("n", &|_| 1.0)?;
        let k_u = list("k_u", &|i| 40.0 * k[i])?;
        let (cap, mass) = (list("cap", &|_| f64::INFINITY)?, list("soil_mass_kg", &|_| 0.0)?);
        let (z, v) = (list("z_start", &|_| 0.0)?, list("v_start", &|_| 0.0)?);
        let column = |i: usize| Column {
            k: k[i],
            n: n[i],
            k_u: k_u[i],
            cap: cap[i],
            mass: mass[i],
            z: z[i],
            z_max: z[i],
            v: v[i],
        };
        let columns: Vec<Column> = (0..k.len()).map(column).collect();
        Ok(Box::new(Self {
            rigid: config.flag("rigid")?,
            saved: vec![columns.clone(); host.slots() as usize],
            columns,
            trials: Vec::new(),
            under_motion: false,
            dissipated: 0.0,
            port_work: 0.0,
            variables: OUTPUTS
                .iter()
                .enumerate()
                .map(|(id, (name, help))| Variable::real(id as u32, *name, "m", Causality::Output, help))
                .collect(),
            echo: config.flag("echo_estimate")?,
        }))
    }
}

impl PowerColumns {
    /// Depth at X = 0 of a port.
    fn at_origin(port: &terraglue_subsystem::Port) -> f64 {
        -port.origin[2]
    }

    fn under_force(&self, column: &Column, t: f64, h: f64) -> Trial {
        if self.rigid {
            return Trial { z: column.z_max, slope: 0.0 };
        }
        let (z, slope) =
            if column.mass > 0.0 && h > 0.0 { column.depth_with_mass(t, h) } else { column.depth(t) };
        Trial { z, slope }
    }

    fn under_motion(&self, column: &Column, z: f64, h: f64) -> (f64, f64) {
        let (f, slope) = column.force(z);
        if column.mass > 0.0 && h > 0.0 {
            let m = column.mass / (h * h);
            return (m * (z - column.z - h * column.v) + f, m + slope);
        }
        (f, slope)
    }
}

impl Subsystem for PowerColumns {
    fn capabilities(&self) -> Capabilities {
        let all = Capabilities::FORCE | Capabilities::DERIVATIVES | Capabilities::RETRY | Capabilities::STATE;
        let all = if self.echo { all | Capabilities::SOLVE } else { all };
        if self.rigid { all } else { all | Capabilities::MOTION }
    }

    fn solve_compatibility(&mut self, step: &Step, estimate: &Estimate, out: &mut Response) -> Result {
        for v in [&mut *out.x, &mut *out.v, &mut *out.a] {
            v.fill(0.0);
        }
        out.t.copy_from_slice(estimate.t_star);
        out.reached = step.t + step.h;
        Ok(())
    }

    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        now.x.fill(0.0);
        now.v.fill(0.0);
        now.a.fill(0.0);
        now.t.fill(0.0);
        self.trials.clear();
        self.trials.resize(step.ports.len(), Trial::default());
        for (port, law) in step.ports.iter().zip(laws) {
            let column =
                self.columns.get(port.body as usize).ok_or(Error::Refused("no such column".into()))?;
            let (i, z) = (port.first as usize, Self::at_origin(port));
            law.t_max = law.t_max.min(column.cap);
            let surface = if self.rigid { column.z_max } else { column.free() };
            now.x[i] = (z - surface).min(0.0);
            now.t[i] = if self.rigid { 0.0 } else { column.force(z).0 };
        }
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        for v in [&mut *out.x, &mut *out.v, &mut *out.a, &mut *out.t] {
            v.fill(0.0);
        }
        self.under_motion = matches!(input, Input::Motion(_));
        for (p, port) in step.ports.iter().enumerate() {
            let (i, z0) = (port.first as usize, Self::at_origin(port));
            let column = self.columns[port.body as usize];
            match input {
                Input::Force { t, .. } => {
                    self.trials[p] = self.under_force(&column, t[i], step.h);
                    (out.x[i], out.t[i]) = (z0 - self.trials[p].z, t[i]);
                }
                Input::Motion(m) if !self.rigid => {
                    let z = z0 - m.x[i];
                    let (f, slope) = self.under_motion(&column, z, step.h);
                    self.trials[p] = Trial { z, slope };
                    (out.x[i], out.t[i]) = (m.x[i], f);
                }
                _ => return Err(Error::Unsupported),
            }
        }
        out.reached = step.t + step.h;
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        out.fill(0.0);
        if level != Level::Position {
            return Ok(());
        }
        for (port, trial) in step.ports.iter().zip(&self.trials) {
            out[port.first as usize * (step.n as usize + 1)] = trial.slope;
        }
        Ok(())
    }

    fn commit(&mut self, step: &Step, _: &[f64], partner: &Motion) -> Result {
        for port in step.ports {
            let z = Self::at_origin(port) - partner.x[port.first as usize];
            let column = &mut self.columns[port.body as usize];
            let before = column.z_max;
            if step.h > 0.0 {
                column.v = (z - column.z) / step.h;
            }
            column.z = z;
            self.port_work -= column.force(z).0 * partner.x[port.first as usize];
            column.z_max = column.z_max.max(z);
            let stored = |z: f64| {
                let work = column.k * libm::pow(z.max(0.0), column.n + 1.0) / (column.n + 1.0);
                let peak = column.virgin(z);
                work - 0.5 * peak * peak / column.k_u
            };
            if !self.rigid {
                self.dissipated += stored(column.z_max) - stored(before);
            }
        }
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.saved.get_mut(slot as usize).ok_or(Error::Unsupported)?.clone_from(&self.columns);
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.columns.clone_from(self.saved.get(slot as usize).ok_or(Error::Unsupported)?);
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::F64(out) = out else { return Err(Error::Unsupported) };
        for (id, value) in ids.iter().zip(out) {
            let of = |c: &Column| if *id == 0 { c.z_max } else { c.free() };
            *value = self.columns.iter().fold(0.0, |m, c| m.max(of(c)));
        }
        Ok(())
    }

    fn scene(&self) -> Scene {
        let body = |k| SceneBody { name: format!("c{k}"), mass: 0.0 };
        Scene { bodies: (0..self.columns.len()).map(body).collect(), shapes: Vec::new(), joints: Vec::new() }
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        for (state, c) in out.iter_mut().zip(&self.columns) {
            let world_from_body = Pose { position: [0.0, 0.0, -c.z_max], ..Pose::IDENTITY };
            *state = BodyState { world_from_body, ..BodyState::REST };
        }
        Ok(())
    }

    fn energy(&self) -> Energy {
        let elastic = |c: &Column| {
            let f = c.force(c.z).0;
            0.5 * f * f / c.k_u
        };
        let potential = if self.rigid { 0.0 } else { self.columns.iter().map(elastic).sum() };
        Energy { potential, dissipated: self.dissipated, port_work: self.port_work, ..Energy::default() }
    }
}
