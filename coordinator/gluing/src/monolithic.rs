//! The reference: one system of equations for all subsystems, solved to rounding.
//!
//! Written apart from the other strategies, so that it can judge them: its residual is formed from trials alone, its
//! Jacobian by central differences of that residual, it starts from the forces of the step before, and it uses no
//! estimate, no interface Jacobian of a module and no active set. Dear, and meant for comparisons.
//!
//! Rows: joints x1 − x2 + T/k_c (accelerations at h = 0); normals T − clamp(T − w/s, t_min, t_max), w the gap, s its
//! scale; tangents the projection on Coulomb's disc; a soil's other rows T − F. Semi-smooth Newton, halved until
//! the residual falls (Qi and Sun 1993).

use super::interface_problem::InterfaceProblem;
use super::{ConstraintKind, Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_numerics::dense::{Lu, max_norm};
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
    /// Whether soils take the motion and answer with the wrench of their law; else they answer a force with a depth.
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

    /// Trials of all sides under `problem.t`.
    fn evaluate(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<f64> {
        problem.advance_bodies(instances)?;
        let motion = self.motion;
        if motion {
            problem.advance_grounds_under_motion(instances)?;
        } else if problem.has_grounds() {
            problem.advance_grounds_under_force(instances)?;
        }
        self.residual.clear();
        self.residual.resize(problem.n(), 0.0);
        for port in &problem.ports {
            rows(port, problem, motion, &self.scale, &mut self.residual);
        }
        Ok(max_norm(&self.residual))
    }

    /// Displacement of each component under its own force: makes all rows forces.
    fn measure_scale(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result {
        let n = problem.n();
        self.scale.clear();
        self.scale.resize(n, 1.0);
        self.base.clone_from(&problem.t);
        problem.advance_bodies(instances)?;
        for i in 0..n {
            let before = gap(problem, i);
            let delta = 1e-4 * problem.t_ref;
            problem.t[i] += delta;
            problem.advance_bodies(instances)?;
            problem.t[i] = self.base[i];
            let moved = ((gap(problem, i) - before) / delta).abs();
            problem.advance_bodies(instances)?;
            self.scale[i] = if moved > 0.0 { moved } else { 1.0 };
        }
        Ok(())
    }

    /// dr/dT, column by column.
    fn differentiate(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result {
        let n = problem.n();
        self.base.clone_from(&problem.t);
        self.jacobian.clear();
        self.jacobian.resize(n * n, 0.0);
        for column in 0..n {
            let delta = 1e-6 * self.base[column].abs().max(1e-2 * problem.t_ref);
            problem.t[column] = self.base[column] + delta;
            self.evaluate(problem, instances)?;
            self.plus.clone_from(&self.residual);
            problem.t[column] = self.base[column] - delta;
            self.evaluate(problem, instances)?;
            problem.t[column] = self.base[column];
            for row in 0..n {
                self.jacobian[column * n + row] = (self.plus[row] - self.residual[row]) / (2.0 * delta);
            }
        }
        problem.report.jacobian_refreshes += 1;
        Ok(())
    }
}

/// Distance at t + h, m; at h = 0 the difference of the accelerations.
fn gap(problem: &InterfaceProblem, i: usize) -> f64 {
    if problem.at.h == 0.0 {
        problem.first.a[i] - problem.second.a[i]
    } else {
        problem.first.x[i] - problem.second.x[i] + problem.conditions.gap[i]
    }
}

/// The residual of a port's components, N.
fn rows(port: &Port, problem: &InterfaceProblem, motion: bool, scale: &[f64], out: &mut [f64]) {
    let normal = port.first as usize;
    let mut slip = [0.0; 2];
    for (i, c) in port.components() {
        let t = problem.t[i];
        out[i] = match problem.conditions.kinds[i] {
            ConstraintKind::Joint => {
                let (k, rate) = (port.law.compliance, problem.first.v[i] - problem.second.v[i]);
                let apart = if k > 0.0 {
                    problem.first.x[i] - problem.second.x[i] + problem.conditions.gap[i]
                } else {
                    gap(problem, i)
                };
                (apart + k * (t + problem.conditions.damping[i] * rate)) / (scale[i] + k)
            }
            ConstraintKind::Normal if !motion => {
                let w = gap(problem, i) / scale[i];
                t - (t - w).max(port.law.t_min).min(port.law.t_max)
            }
            ConstraintKind::Coulomb => {
                slip[c - 1] = t - gap(problem, i) / scale[i];
                t
            }
            ConstraintKind::Normal | ConstraintKind::Law => t - problem.law.last[i],
        };
    }
    // Coulomb: T_t − projection of T_t − e_t/s on the disc of radius μ·T_n
    let (size, radius) = (slip[0].hypot(slip[1]), port.law.mu * problem.t[normal].max(0.0));
    let share = if size > radius { radius / size } else { 1.0 };
    for (i, c) in port.components().filter(|(i, _)| problem.conditions.kinds[*i] == ConstraintKind::Coulomb) {
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

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        let every = |problem: &InterfaceProblem, can| {
            problem.ground_slots().all(|s| instances[s].capabilities().has(can))
        };
        let [force, motion] = [Capabilities::FORCE, Capabilities::MOTION].map(|can| every(problem, can));
        self.motion = !force;
        let mut left = self.solve_form(problem, instances)?;
        if left.is_some() && problem.has_grounds() && force && motion {
            // at a kink of the law the depth under a force may jump where the wrench of a motion does not
            self.motion = true;
            left = self.solve_form(problem, instances)?;
        }
        Ok(match left {
            None => Outcome::Converged,
            Some(size) => Outcome::NotConverged(format!("monolithic: residual {size:.3e} N")),
        })
    }
}

impl Monolithic {
    /// Newton in the present form of the soils. Returns the residual (N) where it did not converge.
    fn solve_form(
        &mut self,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<Option<f64>> {
        problem.start_from_last();
        self.measure_scale(problem, instances)?;
        let n = problem.n();
        let mut size = self.evaluate(problem, instances)?;
        for _ in 0..self.max_iterations {
            if size <= ROUNDING * problem.t_ref.max(max_norm(&problem.t)) {
                break;
            }
            self.kept.clone_from(&self.residual);
            self.differentiate(problem, instances)?;
            let jacobian = &self.jacobian;
            let rank = self.lu.factor(n, |r, c| jacobian[c * n + r]);
            problem.report.rank = (rank as u32, n as u32);
            self.d.clear();
            self.d.extend(self.kept.iter().map(|r| -r));
            self.lu.solve(&mut self.d);
            let before = size;
            size = self.halve_until_better(before, problem, instances)?;
            if !(size < before) {
                // rounding: go back to the better one
                problem.t.clone_from(&self.base);
                size = self.evaluate(problem, instances)?;
                break;
            }
        }
        problem.report.residual = size / problem.t_ref;
        if !(size <= 1e-7 * problem.t_ref.max(max_norm(&problem.t))) {
            return Ok(Some(size));
        }
        self.measure_gap(problem);
        problem.report.converged = true;
        Ok(None)
    }

    /// Takes the step in `d` from `base`, halved until less than `before` is left; what is left.
    fn halve_until_better(
        &mut self,
        before: f64,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<f64> {
        let mut share = 1.0;
        let mut last = Ok(before);
        for _ in 0..=MAX_HALVINGS {
            for ((t, base), d) in problem.t.iter_mut().zip(&self.base).zip(&self.d) {
                *t = base + share * d;
            }
            // a body may refuse forces as wild as those of a long step: a shorter one is tried
            last = self.evaluate(problem, instances);
            if last.as_ref().is_ok_and(|size| *size < before) {
                break;
            }
            share *= 0.5;
        }
        last
    }

    /// The largest gap that is left goes to the report.
    fn measure_gap(&self, problem: &mut InterfaceProblem) {
        for port in &problem.ports {
            let i = port.first as usize;
            let apart = problem.component(i).joint_gap();
            let left = match problem.conditions.kinds[i] {
                ConstraintKind::Joint => apart,
                // the soil's surface follows the foot
                _ if self.motion => 0.0,
                // an open contact under a force of rounding misses its condition by what that force moves, not by its distance
                _ => apart.min(self.scale[i] * problem.t[i].max(0.0)),
            };
            problem.report.max_gap_m = problem.report.max_gap_m.max(left);
        }
    }
}
