//! Force in on side 1, motion in on side 2: r(T) = T − F(X1(T)), Newton with J = I + K·G1, K = −dF/dX1.
//!
//! Side 2 is a soil, or a body that takes motion; unilateral and yielding laws are inside F. Unlike the X-T form of
//! [`super::iterative`] every iteration evaluates both sides, as it is written in the literature.

use super::interface_problem::InterfaceProblem;
use super::iterative::Limits;
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_numerics::dense::{Lu, multiply_add};
use terraglue_scenario::GluingSpec;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::XtNewton.name();

/// The strategy with its buffers.
#[derive(Debug)]
pub struct XtNewton {
    limits: Limits,
    k: Vec<f64>,
    kg: Vec<f64>,
    d: Vec<f64>,
    lu: Lu,
}

impl XtNewton {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        let limits = Limits::read(spec);
        Self { limits, k: Vec::new(), kg: Vec::new(), d: Vec::new(), lu: Lu::default() }
    }

    /// d = −(I + K·G1)⁻¹·r at the last trials.
    fn newton_step(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result {
        let n = problem.n();
        problem.linearise_first(instances)?;
        problem.second_stiffness(instances, &mut self.k)?;
        self.kg.clear();
        self.kg.resize(n * n, 0.0);
        for column in 0..n {
            let out = &mut self.kg[column * n..][..n];
            multiply_add(&self.k, &problem.estimate.g[column * n..][..n], out);
        }
        let kg = &self.kg;
        let rank = self.lu.factor(n, |r, c| kg[c * n + r] + if r == c { 1.0 } else { 0.0 });
        problem.report.rank = (rank as u32, n as u32);
        problem.report.condition = problem.report.condition.max(1.0 / self.lu.weakest());
        self.lu.solve(&mut self.d);
        Ok(())
    }
}

impl Strategy for XtNewton {
    fn name(&self) -> &'static str {
        NAME
    }

    fn needs(&self) -> Needs {
        let motion = Capabilities::MOTION | Capabilities::RETRY;
        Needs { first: Capabilities::FORCE | Capabilities::RETRY, second: motion, grounds: motion }
    }

    fn refuses(&self, problem: &InterfaceProblem) -> Option<String> {
        super::second_refused(NAME, problem)
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        problem.start_from_last();
        problem.report.xt_form = true;
        let mut size = f64::INFINITY;
        for _ in 0..=self.limits.max_iterations {
            problem.advance_half(false, instances)?;
            problem.advance_second_under_motion(instances)?;
            size = problem.force_residual(&mut self.d, size);
            if size <= self.limits.threshold(problem) {
                problem.report.converged = true;
                return Ok(Outcome::Converged);
            }
            if !size.is_finite() {
                break;
            }
            self.newton_step(problem, instances)?;
            problem.t.iter_mut().zip(&self.d).for_each(|(t, d)| *t += d);
        }
        Ok(self.limits.give_up(problem, "X-T Newton: |T - F|", size))
    }
}
