//! The X-T fixed point T ← F(X1(T)), relaxed: for black boxes without derivatives.
//!
//! Side 1 steps under T, side 2 follows its motion and answers F; r = F − T, accelerated as `gluing.relaxation` says
//! ([`super::acceleration`]); `none` contracts by κ = K·G1 and diverges for κ > 1.

use super::acceleration::Acceleration;
use super::interface_problem::InterfaceProblem;
use super::iterative::Limits;
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::{GluingSpec, Relaxation};
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::Relaxed.name();

/// First relaxation factor.
const OMEGA: f64 = 0.1;
/// The residual may grow by this factor before the iteration is given up.
const GROWTH: f64 = 1e6;

/// The strategy with its buffers.
#[derive(Debug)]
pub struct Relaxed {
    kind: Relaxation,
    limits: Limits,
    acceleration: Acceleration,
}

impl Relaxed {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        let kind = spec.relaxation;
        Self { kind, limits: Limits::read(spec), acceleration: Acceleration::new(kind, OMEGA) }
    }
}

impl Strategy for Relaxed {
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
        self.acceleration.begin();
        problem.report.xt_form = true;
        let (mut size, mut at_start) = (f64::INFINITY, f64::INFINITY);
        for iteration in 0..self.limits.max_iterations {
            problem.advance_half(false, instances)?;
            problem.advance_second_under_motion(instances)?;
            size = problem.force_residual(self.acceleration.residual(), size);
            if iteration == 0 {
                at_start = size;
            }
            if size <= self.limits.threshold(problem) {
                problem.report.converged = true;
                return Ok(Outcome::Converged);
            }
            if !(size <= GROWTH * at_start) {
                return Ok(Outcome::NotConverged(format!(
                    "X-T fixed point ({:?}): diverged, |F - T| grew from {at_start:.3e} N to {size:.3e} N in {iteration} iterations",
                    self.kind
                )));
            }
            let step = self.acceleration.step(&problem.t);
            problem.t.iter_mut().zip(step).for_each(|(t, d)| *t += d);
        }
        Ok(Outcome::NotConverged(format!(
            "X-T fixed point ({:?}): not converged within {} iterations, |F - T| = {size:.3e} N, last contraction {:.4}",
            self.kind, self.limits.max_iterations, problem.report.contraction
        )))
    }
}
