//! Gluing: how subsystems that share ports find one wrench per port and step. One file per strategy.
//!
//! - [`cooperative`]: the paper's single pass. The bodies estimate, the soil answers, the bodies re-solve.
//! - [`cooperative_compliant`]: the same, exact for soils that yield: the soil iterates against the estimate.
//! - [`iterative`]: the generic T-T strategy with its X-T form; repeats trials until both sides agree.
//! - [`semi_implicit`]: one Newton step of it, no check.
//! - [`xt_newton`], [`relaxed`]: motion in, force out on side 2; with and without derivatives.
//! - [`jacobi`], [`gauss_seidel`]: explicit, the baseline.
//! - [`monolithic`]: the reference.
//!
//! All work on an [`InterfaceProblem`], where the paper's calls stand by name, and fill one [`StepReport`].

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod acceleration;
mod complementarity;
mod component;
mod conditions;
pub mod contact;
pub mod cooperative;
pub mod cooperative_compliant;
mod derivatives;
mod differences;
mod estimate;
mod follow;
pub mod gauss_seidel;
pub mod glue;
mod group_estimate;
mod halves;
mod interface_problem;
pub mod iterative;
pub mod jacobi;
pub mod memory;
pub mod monolithic;
mod participant;
mod refresh;
mod refusal;
pub mod relaxed;
mod report;
pub mod semi_implicit;
mod start;
pub mod step_control;
#[cfg(test)]
mod tests;
pub mod timing;
mod trials;
pub mod xt_newton;

pub use component::{Component, PassedEnergy};
pub use conditions::Conditions;
pub use derivatives::Derivatives;
pub use glue::{ConstraintKind, Glue};
pub use group_estimate::GroupEstimate;
pub use interface_problem::InterfaceProblem;
pub use participant::StepContext;
pub use refusal::{Refusal, refusal};
use refusal::{body_contacts_refused, joints_refused, rigid_refused, second_refused};
pub use report::{PortReport, StepReport};
pub use trials::{LawWrenches, SideMotion};

use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::{GluingSpec, StrategyKind};
use terraglue_subsystem::Capabilities;

/// Outcome of a step of a strategy. Nothing is committed unless it is `Converged`.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// `t`, `first` and `second` of the [`InterfaceProblem`] are to be committed.
    Converged,
    /// The step may be repeated with half the length.
    NotConverged(String),
}

/// Capabilities that the members of a group need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Bodies on side 1.
    pub first: Capabilities,
    /// Bodies that are side 2 of all their glue.
    pub second: Capabilities,
    /// Soils.
    pub grounds: Capabilities,
}

/// A way to find the wrenches of one step (paper, steps 2 to 4; 1 and 5 are the same for all).
pub trait Strategy: Send {
    /// Name in the scenario.
    fn name(&self) -> &'static str;

    /// Capabilities that the members need.
    fn needs(&self) -> Needs;

    /// Why it cannot glue this group, whatever its members can do.
    fn refuses(&self, _problem: &InterfaceProblem) -> Option<String> {
        None
    }

    /// Whether it ends without asking whether both sides agree: it has no tolerance, and no gap at contacts with soil.
    fn is_single_pass(&self) -> bool {
        false
    }

    /// Appends the state on which later steps depend, for a snapshot.
    fn remember(&self, _out: &mut Vec<u64>) {}

    /// Back to what [`Strategy::remember`] wrote.
    fn recall(&mut self, _kept: &mut memory::Recall) {}

    /// Finds the wrenches of the step.
    ///
    /// # Errors
    /// A member that fails. [`Error::Early`](terraglue_diagnostics::Error::Early): a member ended its step early; the testbed
    /// repeats a shorter one.
    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome>;
}

/// The strategy of a scenario.
pub fn strategy(spec: &GluingSpec) -> Box<dyn Strategy> {
    match spec.strategy {
        StrategyKind::Cooperative => Box::new(cooperative::Cooperative::default()),
        StrategyKind::CooperativeCompliant => {
            Box::new(cooperative_compliant::CooperativeCompliant::new(spec))
        }
        StrategyKind::Iterative => Box::new(iterative::Iterative::new(spec)),
        StrategyKind::SemiImplicit => Box::new(semi_implicit::SemiImplicit::new(spec)),
        StrategyKind::XtNewton => Box::new(xt_newton::XtNewton::new(spec)),
        StrategyKind::Relaxed => Box::new(relaxed::Relaxed::new(spec)),
        StrategyKind::Jacobi => Box::new(jacobi::Jacobi::default()),
        StrategyKind::GaussSeidel => Box::new(gauss_seidel::GaussSeidel::default()),
        StrategyKind::Monolithic => Box::new(monolithic::Monolithic::new(spec)),
    }
}

/// Strategy for the forces of joints in a step of h = 0 before the first: the same for all strategies.
pub fn start(spec: &GluingSpec) -> Box<dyn Strategy> {
    Box::new(start::Start::new(spec))
}

/// The end of a pass that does not ask whether it converged.
fn single_pass(problem: &mut InterfaceProblem) -> Outcome {
    problem.report.converged = true;
    for i in (0..problem.n()).filter(|i| problem.conditions.kinds[*i] == ConstraintKind::Joint) {
        problem.report.max_gap_m = problem.report.max_gap_m.max(problem.component(i).joint_gap());
    }
    Outcome::Converged
}
