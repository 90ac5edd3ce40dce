//! The forces of joints and the accelerations at the start: a step of h = 0, the same for all strategies.
//!
//! The force of a soil follows from places and rates, so at t it is what `set_ports` answered, and soils are not asked.

use super::interface_problem::InterfaceProblem;
use super::iterative::Iterative;
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::GluingSpec;

/// The solver of the start.
#[derive(Debug)]
pub struct Start {
    solver: Iterative,
    scale: f64,
}

impl Start {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        let analytic = GluingSpec { jacobian: terraglue_scenario::JacobianChoice::Analytic, ..spec.clone() };
        Self { solver: Iterative::new(&analytic), scale: spec.start_scale }
    }
}

impl Strategy for Start {
    fn name(&self) -> &'static str {
        self.solver.name()
    }

    fn needs(&self) -> Needs {
        self.solver.needs()
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        let outcome = self.solver.solve(problem, instances)?;
        if outcome == Outcome::Converged && self.scale != 1.0 {
            problem.t.iter_mut().for_each(|t| *t *= self.scale);
            problem.advance_bodies(instances)?;
        }
        Ok(outcome)
    }
}
