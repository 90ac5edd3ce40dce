//! The reference: one system of equations for all subsystems, solved to rounding.
//!
//! Written apart from the other strategies, so that it can judge them: its residual is formed from trials alone, its
//! Jacobian by central differences of that residual, it starts from the forces of the step before, and it uses no
//! estimate, no interface Jacobian of a module and no active set. Dear, and meant for comparisons.
//!
//! Rows: joints x1 − x2 + T/k_c (accelerations at h = 0); normals T − clamp(T − w/s, t_min, t_max), w the gap, s its
//! scale; tangents the projection on Coulomb's disc; a soil's other rows T − F. Semi-smooth Newton, halved until
//! the residual falls (Qi and Sun 1993).

use super::exchange::Exchange;
use super::linear::{Lu, max_norm};
use super::{Needs, Outcome, Row, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::GluingSpec;
use terraglue_subsystem::{Capabilities, Port};

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::Monolithic.name();

const MAX_HALVINGS: u32 = 12;
/// The residual counts as rounding below this share of the largest force.
const ROUNDING: f64 = 1e-12;

/// The strategy with its buffers.
#[derive(Debug)]
pub struct Monolithic {
    max_iterations: u32,
    /// Metres per newton that make gaps forces, by component.
    scale: Vec<f64>,
    residual: Vec<f64>,
    kept: Vec<f64>,
    plus: Vec<f64>,
    jacobian: Vec<f64>,
    base: Vec<f64>,
    d: Vec<f64>,
    lu: Lu,
    /// Whether soils are told the motion and answer with the wrench of their law; else they answer a force with a depth.
    motion: bool,
}

impl Monolithic {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        Self {
            max_iterations: spec.max_iterations.max(50),
            scale: Vec::new(),
            residual: Vec::new(),
            kept: Vec::new(),
            plus: Vec::new(),
            jacobian: Vec::new(),
            base: Vec::new(),
            d: Vec::new(),
            lu: Lu::default(),
            motion: false,
        }
    }

    /// Trials of all sides under `exchange.t`.
    fn evaluate(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<f64> {
        exchange.advance_bodies(instances)?;
        let motion = self.motion;
        if motion {
            exchange.advance_grounds_under_motion(instances)?;
        } else if exchange.has_grounds() {
            exchange.advance_grounds_under_force(instances)?;
        }
        self.residual.clear();
        self.residual.resize(exchange.n(), 0.0);
        for port in &exchange.ports {
            rows(port, exchange, motion, &self.scale, &mut self.residual);
        }
        Ok(max_norm(&self.residual))
    }

    /// How far each component moves under its own force: makes all rows forces.
    fn measure_scale(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result {
        let n = exchange.n();
        self.scale.clear();
        self.scale.resize(n, 1.0);
        self.base.clone_from(&exchange.t);
        exchange.advance_bodies(instances)?;
        for i in 0..n {
            let before = gap(exchange, i);
            let delta = 1e-4 * exchange.t_ref;
            exchange.t[i] += delta;
            exchange.advance_bodies(instances)?;
            exchange.t[i] = self.base[i];
            let moved = ((gap(exchange, i) - before) / delta).abs();
            exchange.advance_bodies(instances)?;
            self.scale[i] = if moved > 0.0 { moved } else { 1.0 };
        }
        Ok(())
    }

    /// dr/dT, column by column.
    fn differentiate(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result {
        let n = exchange.n();
        self.base.clone_from(&exchange.t);
        self.jacobian.clear();
        self.jacobian.resize(n * n, 0.0);
        for column in 0..n {
            let delta = 1e-6 * self.base[column].abs().max(1e-2 * exchange.t_ref);
            exchange.t[column] = self.base[column] + delta;
            self.evaluate(exchange, instances)?;
            self.plus.clone_from(&self.residual);
            exchange.t[column] = self.base[column] - delta;
            self.evaluate(exchange, instances)?;
            exchange.t[column] = self.base[column];
            for row in 0..n {
                self.jacobian[column * n + row] = (self.plus[row] - self.residual[row]) / (2.0 * delta);
            }
        }
        exchange.report.jacobian_refreshes += 1;
        Ok(())
    }
}

/// Distance at t + h, m; at h = 0 the difference of the accelerations.
fn gap(exchange: &Exchange, i: usize) -> f64 {
    if exchange.at.h == 0.0 {
        exchange.a1[i] - exchange.a2[i]
    } else {
        exchange.x1[i] - exchange.x2[i] + exchange.gap[i]
    }
}

/// The residual of a port's components, N.
fn rows(port: &Port, exchange: &Exchange, motion: bool, scale: &[f64], out: &mut [f64]) {
    let normal = port.first as usize;
    let mut slip = [0.0; 2];
    for (i, c) in port.components() {
        let t = exchange.t[i];
        out[i] = match exchange.rows[i] {
            Row::Joint => {
                let (k, rate) = (port.law.compliance, exchange.v1[i] - exchange.v2[i]);
                let apart = if k > 0.0 {
                    exchange.x1[i] - exchange.x2[i] + exchange.gap[i]
                } else {
                    gap(exchange, i)
                };
                (apart + k * (t + exchange.damping[i] * rate)) / (scale[i] + k)
            }
            Row::Normal if !motion => {
                let w = gap(exchange, i) / scale[i];
                t - (t - w).max(port.law.t_min).min(port.law.t_max)
            }
            Row::Coulomb => {
                slip[c - 1] = t - gap(exchange, i) / scale[i];
                t
            }
            Row::Normal | Row::Law => t - exchange.f[i],
        };
    }
    // Coulomb: T_t − projection of T_t − e_t/s on the disc of radius μ·T_n
    let (size, radius) = (slip[0].hypot(slip[1]), port.law.mu * exchange.t[normal].max(0.0));
    let share = if size > radius { radius / size } else { 1.0 };
    for (i, c) in port.components().filter(|(i, _)| exchange.rows[*i] == Row::Coulomb) {
        out[i] -= share * slip[c - 1];
    }
}

impl Strategy for Monolithic {
    fn name(&self) -> &'static str {
        NAME
    }

    fn needs(&self) -> Needs {
        let bodies = Capabilities::FORCE | Capabilities::RETRY;
        Needs { first: bodies, second: bodies, grounds: Capabilities::RETRY }
    }

    fn solve(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<Outcome> {
        let every =
            |exchange: &Exchange, can| exchange.ground_slots().all(|s| instances[s].capabilities().has(can));
        let [force, motion] = [Capabilities::FORCE, Capabilities::MOTION].map(|can| every(exchange, can));
        self.motion = !force;
        let found = self.solve_form(exchange, instances)?;
        if matches!(found, Outcome::Converged) || !exchange.has_grounds() || !(force && motion) {
            return Ok(found);
        }
        // at a kink of the law the depth under a force may jump where the wrench of a motion does not
        self.motion = true;
        self.solve_form(exchange, instances)
    }
}

impl Monolithic {
    /// Newton in the present form of the soils.
    fn solve_form(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<Outcome> {
        exchange.start_from_last();
        self.measure_scale(exchange, instances)?;
        let n = exchange.n();
        let mut size = self.evaluate(exchange, instances)?;
        for _ in 0..self.max_iterations {
            if size <= ROUNDING * exchange.t_ref.max(max_norm(&exchange.t)) {
                break;
            }
            self.kept.clone_from(&self.residual);
            self.differentiate(exchange, instances)?;
            let jacobian = &self.jacobian;
            let rank = self.lu.factor(n, |r, c| jacobian[c * n + r]);
            exchange.report.rank = (rank as u32, n as u32);
            self.d.clear();
            self.d.extend(self.kept.iter().map(|r| -r));
            self.lu.solve(&mut self.d);
            let before = size;
            let mut share = 1.0;
            let mut refused = None;
            for _ in 0..=MAX_HALVINGS {
                for ((t, base), d) in exchange.t.iter_mut().zip(&self.base).zip(&self.d) {
                    *t = base + share * d;
                }
                // A body may refuse forces as wild as those of a long step: a shorter one is tried.
                let trial = self.evaluate(exchange, instances);
                size = *trial.as_ref().unwrap_or(&f64::INFINITY);
                refused = trial.err();
                if size < before {
                    break;
                }
                share *= 0.5;
            }
            if let Some(error) = refused {
                return Err(error);
            }
            if !(size < before) {
                // rounding: go back to the better one
                exchange.t.clone_from(&self.base);
                size = self.evaluate(exchange, instances)?;
                break;
            }
        }
        exchange.report.residual = size / exchange.t_ref;
        if !(size <= 1e-7 * exchange.t_ref.max(max_norm(&exchange.t))) {
            return Ok(Outcome::NotConverged(format!("monolithic: residual {size:.3e} N")));
        }
        for port in &exchange.ports {
            let i = port.first as usize;
            let apart = exchange.joint_gap(i);
            let left = match exchange.rows[i] {
                Row::Joint => apart,
                // the soil's surface follows the foot
                _ if self.motion => 0.0,
                // an open contact under a force of rounding misses its condition by what that force moves, not by its distance
                _ => apart.min(self.scale[i] * exchange.t[i].max(0.0)),
            };
            exchange.report.max_gap_m = exchange.report.max_gap_m.max(left);
        }
        exchange.report.converged = true;
        Ok(Outcome::Converged)
    }
}
