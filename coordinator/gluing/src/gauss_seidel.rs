//! Explicit, one side after the other, as co-simulation masters do: the baseline.
//!
//! Springs: side 2 steps under T = k_c·(x2 − x1) of t, then side 1 under k_c·(x2⁺ − x1). Contacts: the bodies step
//! under the soil's force of t, then the soil follows their motion; stable while κ + 2·c·h/m < 4. Never asks for
//! a derivative and never repeats a step.

use super::interface_problem::InterfaceProblem;
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::GaussSeidel.name();

/// The explicit pass. It keeps nothing from step to step.
#[derive(Debug, Default)]
pub struct GaussSeidel {}

impl Strategy for GaussSeidel {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_single_pass(&self) -> bool {
        true
    }

    fn needs(&self) -> Needs {
        Needs { first: Capabilities::FORCE, second: Capabilities::FORCE, grounds: Capabilities::default() }
    }

    fn refuses(&self, problem: &InterfaceProblem) -> Option<String> {
        super::rigid_refused(NAME, problem)
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        problem.explicit_forces();
        if problem.conditions.has_joints() {
            problem.advance_half(true, instances)?;
            problem.t_second.clone_from(&problem.t);
            problem.spring_forces();
            problem.advance_half(false, instances)?;
        } else {
            problem.advance_bodies(instances)?;
        }
        problem.second.follow(&problem.first, &problem.conditions.kinds);
        Ok(super::single_pass(problem))
    }
}
