//! The X-T form: the soil takes the motion of the bodies and answers the wrench of its law.
//!
//! r(T) = T − F(X1(T)), Newton with J = I + K·G1, K = −dF/dX1 of the soil at the last trial. Unilateral and
//! yielding laws are inside F, so no active set is needed. At the kink of unloading the step is halved until
//! |r| falls.
//!
//! Bodies are linear within a step but for motors that reach their limit, and dear. So the iteration runs inside
//! against X1 + G1·ΔT and asks the bodies only to confirm: two evaluations of the bodies at any κ.

use super::super::Outcome;
use super::super::interface_problem::InterfaceProblem;
use super::{Limits, largest_eigenvalue};
use std::ops::Range;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_numerics::dense::{Lu, make_room, max_norm, multiply_add};

/// Halvings of one Newton step before it is taken as it is.
const MAX_HALVINGS: u32 = 8;

/// Buffers.
#[derive(Debug, Default)]
pub struct XtForm {
    k: Vec<f64>,
    kg: Vec<f64>,
    residual: Vec<f64>,
    d: Vec<f64>,
    base: Vec<f64>,
    work: Vec<f64>,
    /// X1 by the linearisation, before the bodies confirm it.
    predicted: Vec<f64>,
    lu: Lu,
}

impl XtForm {
    /// Room for n components, so that a step that changes to this form does not allocate.
    pub fn reserve(&mut self, n: usize) {
        for matrix in [&mut self.k, &mut self.kg] {
            make_room(matrix, n * n);
        }
        for vector in [&mut self.residual, &mut self.d, &mut self.base, &mut self.work, &mut self.predicted] {
            make_room(vector, n);
        }
        self.lu.reserve(n);
    }

    /// Iterates from `problem.t`: inside against the linearised bodies, outside against the bodies themselves.
    pub fn solve(
        &mut self,
        limits: &Limits,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<Outcome> {
        let mut norm = self.evaluate(problem, instances)?;
        for _ in 0..limits.max_iterations {
            if norm <= limits.threshold(problem) {
                return Ok(self.converged(problem, norm));
            }
            let inner = self.solve_linearised(limits, norm, problem, instances)?;
            norm = self.confirm(inner, limits, problem, instances)?;
        }
        if norm <= limits.threshold(problem) {
            return Ok(self.converged(problem, norm));
        }
        Ok(limits.give_up(problem, "X-T form: |T - F|", norm))
    }

    /// Iterates the soil alone against the bodies as `problem.predict_bodies` knows them; what is left of |T − F|, N.
    pub fn solve_predicted(
        &mut self,
        limits: &Limits,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<f64> {
        problem.predict_bodies();
        let mut norm = self.evaluate_grounds(problem, instances)?;
        for _ in 0..limits.max_iterations {
            if norm <= limits.threshold(problem) {
                break;
            }
            self.newton_step(problem, instances)?;
            norm = self.step(norm, problem, instances)?;
        }
        Ok(norm)
    }

    /// Figures of the last trials of both sides; `norm` is what is left, N.
    pub fn conclude(&self, norm: f64, problem: &mut InterfaceProblem) -> Outcome {
        self.converged(problem, norm)
    }

    /// Newton on T − F(X1(T)) = 0 with X1 linear in T: evaluations of the soil only.
    fn solve_linearised(
        &mut self,
        limits: &Limits,
        mut norm: f64,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<f64> {
        for _ in 0..limits.max_iterations {
            self.newton_step(problem, instances)?;
            norm = self.step(norm, problem, instances)?;
            if norm <= 0.1 * limits.threshold(problem) {
                break;
            }
        }
        Ok(norm)
    }

    /// The bodies under T. The soil's last trial still counts where they moved as their linearisation said: the
    /// difference changes no force by a tenth of what is tolerated.
    fn confirm(
        &mut self,
        inner: f64,
        limits: &Limits,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<f64> {
        self.predicted.clone_from(&problem.first.x);
        problem.advance_bodies(instances)?;
        let (n, allowed) = (problem.n(), 0.1 * limits.threshold(problem));
        let off = |c: usize| (problem.first.x[c] - self.predicted[c]).abs();
        let as_predicted =
            (0..n).all(|r| (0..n).map(|c| self.k[c * n + r].abs() * off(c)).sum::<f64>() <= allowed);
        if as_predicted { Ok(inner) } else { self.evaluate_grounds(problem, instances) }
    }

    /// One evaluation of both sides; |r|∞.
    fn evaluate(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<f64> {
        problem.advance_bodies(instances)?;
        self.evaluate_grounds(problem, instances)
    }

    fn evaluate_grounds(
        &mut self,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result<f64> {
        problem.advance_grounds_under_motion(instances)?;
        self.residual.clear();
        self.residual.extend(problem.t.iter().zip(&problem.law.last).map(|(t, f)| t - f));
        Ok(max_norm(&self.residual))
    }

    /// d = −(I + K·G1)⁻¹·r at the last trial.
    fn newton_step(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result {
        let n = problem.n();
        problem.ground_jacobian(instances, true, &mut self.k)?;
        let (k, g) = (&self.k, &problem.estimate.g);
        self.kg.clear();
        self.kg.resize(n * n, 0.0);
        let apart = problem.ports.iter().all(|port| stands_alone(k, n, port.range()));
        for (out, g) in self.kg.chunks_exact_mut(n.max(1)).zip(g.chunks_exact(n.max(1))) {
            if !apart {
                multiply_add(k, g, out);
                continue;
            }
            for port in &problem.ports {
                add_block(k, n, port.range(), g, out);
            }
        }
        let kg = &self.kg;
        let rank = self.lu.factor(n, |r, c| kg[c * n + r] + if r == c { 1.0 } else { 0.0 });
        self.d.clear();
        self.d.extend(self.residual.iter().map(|r| -r));
        self.lu.solve(&mut self.d);
        let kappa = largest_eigenvalue(k, g, &mut self.base, &mut self.work, n);
        problem.report.kappa_max = problem.report.kappa_max.max(kappa);
        problem.report.rank = (rank as u32, n as u32);
        problem.report.condition = problem.report.condition.max(1.0 / self.lu.weakest());
        Ok(())
    }

    /// Takes the Newton step, halved until the residual falls; the new |r|∞.
    fn step(&mut self, norm: f64, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<f64> {
        self.base.clear();
        self.base.extend_from_slice(&problem.t);
        let mut share = 1.0;
        for halving in 0..=MAX_HALVINGS {
            for ((t, base), d) in problem.t.iter_mut().zip(&self.base).zip(&self.d) {
                *t = base + share * d;
            }
            problem.predict_bodies();
            let new = self.evaluate_grounds(problem, instances)?;
            problem.report.evaluations_line_search += u32::from(halving > 0);
            if new < norm || halving == MAX_HALVINGS {
                return Ok(new);
            }
            share *= 0.5;
        }
        Ok(norm)
    }

    fn converged(&self, problem: &mut InterfaceProblem, norm: f64) -> Outcome {
        let report = &mut problem.report;
        report.residual = norm / problem.t_ref;
        for port in &problem.ports {
            let r = self.residual[port.first as usize].abs();
            report.max_action_reaction_gap_n = report.max_action_reaction_gap_n.max(r);
        }
        report.converged = true;
        // motion was imposed on the soil: its surface is where the body is
        problem.second.x.copy_from_slice(&problem.first.x);
        Outcome::Converged
    }
}

/// Whether the columns `range` of the n × n matrix k are zero outside the rows of that range: a port answers to itself alone.
fn stands_alone(k: &[f64], n: usize, range: Range<usize>) -> bool {
    k[range.start * n..range.end * n].chunks_exact(n.max(1)).all(|column| {
        let none = |entries: &[f64]| entries.iter().all(|k| *k == 0.0);
        none(&column[..range.start]) && none(&column[range.end..])
    })
}

/// y += K·x for the components of one port.
#[inline]
fn add_block(k: &[f64], n: usize, range: Range<usize>, x: &[f64], y: &mut [f64]) {
    let (first, y) = (range.start, &mut y[range.clone()]);
    if let Ok(y) = <&mut [f64; 6]>::try_from(&mut *y) {
        let mut sum = *y;
        for c in range {
            let Some(column) = k[c * n + first..].first_chunk::<6>() else { return };
            for (s, k) in sum.iter_mut().zip(column) {
                *s += k * x[c];
            }
        }
        *y = sum;
        return;
    }
    for c in range.clone() {
        y.iter_mut().zip(&k[c * n + first..]).for_each(|(y, k)| *y += k * x[c]);
    }
}
