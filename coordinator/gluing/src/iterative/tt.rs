//! The T-T form: both sides take the normal force and answer their motion.
//!
//! Normal rows: e = x1 − x2, complementary to t_min ≤ T_n ≤ t_max. Tangential and moment rows: the soil's law at
//! the bodies' motion, r = T_t − F_t(X1, T_n). The linearised problem is solved to the end by an active set; the
//! step along it is accepted when the energy still falls, else shortened by a bracketed secant (Illinois).
//! As in the X-T form, the iteration runs inside against the linearised bodies and the bodies confirm.

use super::super::Outcome;
use super::super::complementarity::{BoundedProblem, BoundedSolver};
use super::super::glue::ConstraintKind;
use super::super::interface_problem::InterfaceProblem;
use super::super::memory::Recall;
use super::super::refresh::Refresh;
use super::{Limits, friction, largest_eigenvalue};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_numerics::dense::max_norm;
use terraglue_scenario::JacobianChoice;

/// Trials of one line search.
const MAX_TRIALS: u32 = 12;

/// Rounding of a gap between places of some metres, m.
const ROUNDING_M: f64 = 1e-13;

/// Iterations against the linearised bodies after which steps must pass the filter.
const FREE_ITERATIONS: u32 = 4;
/// Share of a figure of the filter that counts as smaller.
const SMALLER: f64 = 0.999;

/// Buffers.
#[derive(Debug, Default)]
pub struct TtForm {
    /// The soils' mixed Jacobian: compliance in the normal columns, stiffness in the others.
    mixed: Vec<f64>,
    /// Λ⁻¹ for all rows, row-major.
    matrix: Vec<f64>,
    /// Stiffness of the soil alone, for κ.
    k: Vec<f64>,
    e: Vec<f64>,
    d: Vec<f64>,
    base: Vec<f64>,
    work: Vec<f64>,
    /// The bodies' part of the mismatch by the linearisation, before they confirm it.
    predicted: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Residuals of earlier iterates in the laws and at the normals, N.
    filter: Vec<[f64; 2]>,
    solver: BoundedSolver,
    jacobian: Refresh,
    /// A control that neglects the coupling of the ports.
    diagonal: bool,
}

impl TtForm {
    /// With the interface Jacobian from there.
    pub fn new(jacobian: JacobianChoice) -> Self {
        Self {
            jacobian: Refresh::new(jacobian),
            diagonal: jacobian == JacobianChoice::Diagonal,
            ..Self::default()
        }
    }

    /// The Jacobian that is kept from step to step.
    pub fn remember(&self, out: &mut Vec<u64>) {
        self.jacobian.remember(out);
    }

    /// Back from a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        self.jacobian.recall(kept);
    }

    /// Iterates from `problem.t`.
    pub fn solve(
        &mut self,
        limits: &Limits,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<Outcome> {
        let (mut size, mut before) = (f64::INFINITY, f64::NAN);
        let own_start = problem.needs_linearisation();
        let soils = problem.has_grounds() && problem.at.h > 0.0;
        for iteration in 0..=limits.max_iterations {
            self.predicted.clear();
            self.predicted.extend((0..problem.n()).map(|i| problem.component(i).bodies_part()));
            problem.advance_bodies(instances)?;
            if iteration == 0 || !self.as_predicted(limits, problem) {
                self.evaluate_grounds(problem, instances)?;
            } else {
                self.residuals(problem);
            }
            let left = max_norm(&self.e);
            if own_start {
                self.jacobian.provide(left, before, problem, instances)?;
            }
            before = left;
            self.bounds(problem);
            let solved = self.newton_step(problem, instances)?;
            let last = std::mem::replace(&mut size, max_norm(&self.d));
            // where Λ is nearly singular, rounding of the places is all that is left in e, and Λ·e never ends
            let rounding = !soils && size > 0.5 * last && left <= ROUNDING_M;
            if size <= limits.threshold(problem) || rounding {
                problem.repeat_bodies_trial(instances)?;
                return Ok(self.converged(problem, size));
            }
            if !solved {
                break;
            }
            if soils && !self.diagonal {
                self.solve_linearised(limits, problem, instances)?;
            } else {
                problem.t.iter_mut().zip(&self.d).for_each(|(t, d)| *t += d);
            }
        }
        Ok(limits.give_up(problem, "T-T form: |Λ·e|", size))
    }

    /// Whether the bodies moved as their linearisation said, so that the soil's last trial, under the same T, still
    /// counts: the difference changes no force by a tenth of what is tolerated.
    fn as_predicted(&self, limits: &Limits, problem: &InterfaceProblem) -> bool {
        let (n, allowed) = (problem.n(), 0.1 * limits.threshold(problem));
        problem.has_grounds()
            && !self.diagonal
            && (0..n).all(|i| {
                let off = (problem.component(i).bodies_part() - self.predicted[i]).abs();
                let stiffness = match problem.conditions.kinds[i] {
                    ConstraintKind::Law => self.k[i * n + i],
                    _ => 1.0 / self.matrix[i * n + i],
                };
                off * stiffness <= allowed
            })
    }

    /// One Newton step from `problem.t` and no check: two evaluations of the bodies.
    pub fn one_step(
        &mut self,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<Outcome> {
        problem.advance_bodies(instances)?;
        self.evaluate_grounds(problem, instances)?;
        if problem.needs_linearisation() {
            self.jacobian.provide(max_norm(&self.e), f64::NAN, problem, instances)?;
        }
        self.bounds(problem);
        self.newton_step(problem, instances)?;
        problem.t.iter_mut().zip(&self.d).for_each(|(t, d)| *t += d);
        problem.advance_bodies(instances)?;
        self.evaluate_grounds(problem, instances)?;
        let size = max_norm(&self.d);
        Ok(self.converged(problem, size))
    }

    /// Iterates the soil alone against the bodies as `problem.predict_bodies` knows them; what is left of |Λ·e|, N.
    pub fn solve_predicted(
        &mut self,
        limits: &Limits,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<f64> {
        problem.predict_bodies();
        self.evaluate_grounds(problem, instances)?;
        self.bounds(problem);
        self.filter.clear();
        for iteration in 0..limits.max_iterations {
            let solved = self.newton_step(problem, instances)?;
            if !solved || max_norm(&self.d) <= limits.threshold(problem) {
                break;
            }
            self.step(iteration, problem, instances)?;
        }
        Ok(max_norm(&self.d))
    }

    /// Figures of the last trials of both sides; `size` is what is left, N.
    pub fn conclude(&mut self, size: f64, problem: &mut InterfaceProblem) -> Outcome {
        self.residuals(problem);
        self.converged(problem, size)
    }

    /// Newton with X1 linear in T, from the step d: evaluations of the soil only.
    fn solve_linearised(
        &mut self,
        limits: &Limits,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result {
        self.filter.clear();
        for iteration in 0..limits.max_iterations {
            self.step(iteration, problem, instances)?;
            let solved = self.newton_step(problem, instances)?;
            if !solved || max_norm(&self.d) <= 0.1 * limits.threshold(problem) {
                break;
            }
        }
        Ok(())
    }

    /// Bounds of every component; Coulomb's cone is inside its rows instead.
    fn bounds(&mut self, problem: &InterfaceProblem) {
        self.lower.clear();
        self.upper.clear();
        for port in &problem.ports {
            for (i, _) in port.components() {
                let (lower, upper) = match problem.conditions.kinds[i] {
                    ConstraintKind::Normal => (port.law.t_min, port.law.t_max),
                    ConstraintKind::Law | ConstraintKind::Joint | ConstraintKind::Coulomb => {
                        (f64::NEG_INFINITY, f64::INFINITY)
                    }
                };
                self.lower.push(lower);
                self.upper.push(upper);
            }
        }
    }

    /// One evaluation of the soils at the bodies' present motion and the residual of every row.
    fn evaluate_grounds(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result {
        if problem.has_grounds() && problem.at.h > 0.0 {
            problem.advance_grounds_under_force(instances)?;
        }
        self.residuals(problem);
        Ok(())
    }

    fn residuals(&mut self, problem: &InterfaceProblem) {
        self.e.clear();
        for port in &problem.ports {
            for (i, _) in port.components() {
                self.e.push(match problem.conditions.kinds[i] {
                    _ if problem.component(i).is_given() => 0.0,
                    ConstraintKind::Law => problem.t[i] - problem.law.last[i],
                    ConstraintKind::Normal | ConstraintKind::Joint | ConstraintKind::Coulomb => {
                        problem.component(i).mismatch()
                    }
                });
            }
        }
    }

    /// The solution of the linearised problem at the last trial; `false` if none was found.
    fn newton_step(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<bool> {
        let n = problem.n();
        if problem.at.h > 0.0 {
            problem.ground_jacobian(instances, false, &mut self.mixed)?;
        }
        self.assemble(problem);
        for port in problem.ports.iter().filter(|p| p.len() > 1) {
            if problem.conditions.kinds[port.first as usize + 1] == ConstraintKind::Coulomb {
                friction::project(port, &problem.t, &mut self.e, &mut self.matrix);
            }
        }
        if self.diagonal {
            (0..n * n).filter(|k| k / n != k % n).for_each(|k| self.matrix[k] = 0.0);
        }
        let matrix = &self.matrix;
        let bounded = BoundedProblem {
            a: |r: usize, c: usize| matrix[r * n + c],
            e: &self.e,
            t: &problem.t,
            lower: &self.lower,
            upper: &self.upper,
        };
        self.d.clear();
        self.d.resize(n, 0.0);
        let solved = self.solver.solve(&bounded, &mut self.d);
        problem.report.rank = (self.solver.rank() as u32, n as u32);
        problem.report.condition = problem.report.condition.max(self.solver.condition());
        let kappa = largest_eigenvalue(&self.k, &problem.estimate.g, &mut self.base, &mut self.work, n);
        problem.report.kappa_max = problem.report.kappa_max.max(kappa);
        Ok(solved)
    }

    /// d(e)/dT: normal rows G1 + G2 + compliance; the others I + K·G1 with the soil's own coupling to T_n.
    fn assemble(&mut self, problem: &InterfaceProblem) {
        let n = problem.n();
        let g = &problem.estimate.g;
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        self.k.clear();
        self.k.resize(n * n, 0.0);
        for port in &problem.ports {
            for (row, r) in port.components() {
                let out = &mut self.matrix[row * n..][..n];
                if problem.component(row).is_given() {
                    out[row] = 1.0;
                    continue;
                }
                let law = problem.conditions.kinds[row] == ConstraintKind::Law;
                out[row] += if law { 1.0 } else { problem.conditions.compliance[row] };
                if !law {
                    (0..n).for_each(|column| out[column] += g[column * n + row]);
                }
                if !problem.conditions.of_soil[row] {
                    continue;
                }
                for (other, c) in port.components() {
                    let entry = self.mixed[other * n + row];
                    match (r, c) {
                        (0, 0) => {
                            out[other] += entry;
                            self.k[row * n + row] = if entry > 0.0 { 1.0 / entry } else { 0.0 };
                        }
                        (0, _) => {}
                        (_, 0) => out[other] -= entry,
                        _ => {
                            (0..n).for_each(|column| out[column] += entry * g[column * n + other]);
                            self.k[other * n + row] = entry;
                        }
                    }
                }
            }
        }
    }

    /// Takes the step d: whole when the energy still falls at its end, else the first share s with
    /// |g(s)| ≤ ½|g(0)|, g(s) = dᵀ·e(T + s·d) over the normal rows and the joints.
    ///
    /// Shear laws bend where slip turns back, and Newton can jump to and fro across the bend for ever. Where an
    /// iteration lasts, a step must also pass a filter (Fletcher and Leyffer 2002): no earlier iterate had less left
    /// open in the laws and at the normals.
    fn step(&mut self, iteration: u32, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result {
        let filtered =
            iteration >= FREE_ITERATIONS && problem.conditions.kinds.contains(&ConstraintKind::Law);
        if filtered {
            self.filter.push(self.left_open(problem));
        }
        self.base.clear();
        self.base.extend_from_slice(&problem.t);
        let start = self.slope(problem);
        let (mut low, mut g_low, mut high, mut g_high) = (0.0, start, 1.0, 0.0);
        let mut share = 1.0;
        for trial in 0..MAX_TRIALS {
            for ((t, base), d) in problem.t.iter_mut().zip(&self.base).zip(&self.d) {
                *t = base + share * d;
            }
            problem.predict_bodies();
            self.evaluate_grounds(problem, instances)?;
            problem.report.evaluations_line_search += u32::from(trial > 0);
            let g = self.slope(problem);
            if start >= 0.0 || (trial == 0 && g <= 0.0) || g.abs() <= 0.5 * start.abs() {
                if !filtered || self.passes(problem) {
                    return Ok(());
                }
                (high, g_high) = (share, g);
                share = 0.5 * (low + share);
                continue;
            }
            if g > 0.0 {
                (high, g_high) = (share, g);
                g_low *= if trial > 0 { 0.5 } else { 1.0 };
            } else {
                (low, g_low) = (share, g);
                g_high *= 0.5;
            }
            share = (low * g_high - high * g_low) / (g_high - g_low);
            if !(share > low.min(high) && share < low.max(high)) {
                share = 0.5 * (low + high);
            }
        }
        Ok(())
    }

    /// Largest residual of a law and largest distance of a normal force from its complementary solution, N.
    fn left_open(&self, problem: &InterfaceProblem) -> [f64; 2] {
        let n = problem.n();
        let mut open = [0.0_f64; 2];
        for (i, t) in problem.t.iter().enumerate() {
            match problem.conditions.kinds[i] {
                ConstraintKind::Law => open[0] = open[0].max(self.e[i].abs()),
                ConstraintKind::Normal | ConstraintKind::Joint | ConstraintKind::Coulomb => {
                    let wanted = t - self.e[i] / self.matrix[i * n + i];
                    open[1] = open[1].max((t - wanted.max(self.lower[i]).min(self.upper[i])).abs());
                }
            }
        }
        open
    }

    fn passes(&self, problem: &InterfaceProblem) -> bool {
        let now = self.left_open(problem);
        self.filter.iter().all(|f| now[0] < SMALLER * f[0] || now[1] < SMALLER * f[1])
    }

    fn slope(&self, problem: &InterfaceProblem) -> f64 {
        let of = |(row, de): (&ConstraintKind, (&f64, &f64))| match row {
            ConstraintKind::Normal | ConstraintKind::Joint => de.0 * de.1,
            ConstraintKind::Law | ConstraintKind::Coulomb => 0.0,
        };
        problem.conditions.kinds.iter().zip(self.d.iter().zip(&self.e)).map(of).sum()
    }

    fn converged(&self, problem: &mut InterfaceProblem, size: f64) -> Outcome {
        let mut largest: f64 = 0.0;
        let mut complementarity: f64 = 0.0;
        for port in &problem.ports {
            let i = port.first as usize;
            if problem.conditions.kinds[i] == ConstraintKind::Joint {
                for k in port.range() {
                    largest = largest.max(problem.component(k).joint_gap());
                }
                continue;
            }
            if problem.t[i] > 0.0 {
                largest = largest.max(self.e[i].abs());
            }
            let diagonal = self.matrix[i * problem.t.len() + i];
            complementarity = complementarity.max(problem.t[i].min(self.e[i] / diagonal).abs());
        }
        let report = &mut problem.report;
        report.residual = size / problem.t_ref;
        report.max_gap_m = report.max_gap_m.max(largest);
        report.complementarity_n = report.complementarity_n.max(complementarity);
        report.converged = true;
        Outcome::Converged
    }
}
