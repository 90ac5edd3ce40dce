//! The paper's co-operational T-T strategy: one pass, no iteration.
//!
//! Rossmann, Jung and Rast (2010), section IV B: the rigid bodies offer an estimate T* of the contact force that
//! a local soil could not know; the soil answers T1, which is what it can give; the bodies are solved again
//! without the contact constraints, under T1. The coordinator never sends T2 back.
//!
//! The estimate also says where the bodies would be without the soil and how they yield, so a soil that solves the
//! compatibility of both on its own answers with the wrench of its law at the motion that the bodies then make. It takes that
//! motion as its own at commit, and action equals reaction as far as the bodies are linear within the step. They are not where
//! a motor is at its limit under T* and not under T1: then the estimate is taken again about T1.

use super::follow::{PASSES, can_repeat, followed};
use super::interface_problem::InterfaceProblem;
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::Cooperative.name();

/// The single pass. It keeps nothing from step to step.
#[derive(Debug, Default)]
pub struct Cooperative {}

impl Strategy for Cooperative {
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
        super::joints_refused(NAME, problem).or_else(|| super::body_contacts_refused(NAME, problem))
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        problem.estimate_forces(instances)?;
        for pass in 1..=PASSES {
            problem.solve_compatibility(false, instances)?;
            problem.advance_bodies(instances)?;
            if pass == PASSES
                || problem.report.evaluations_soil == 0
                || followed(problem, &problem.second.x)
                || !can_repeat(problem, instances)
            {
                break;
            }
            problem.estimate_again(instances)?;
        }
        problem.second.x.copy_from_slice(&problem.first.x);
        problem.report.converged = true;
        Ok(Outcome::Converged)
    }
}
