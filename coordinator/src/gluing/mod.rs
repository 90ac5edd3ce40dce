//! Gluing: how subsystems that share ports find one wrench per port and step. One file per strategy.
//!
//! - [`cooperative`]: the paper's single pass. The bodies estimate, the soil answers, the bodies re-solve.
//! - [`iterative`]: the generic T-T strategy with its X-T form; repeats trials until both sides agree.
//!
//! Both work on an [`Exchange`], where the paper's calls stand by name, and fill one [`StepReport`].

mod complementarity;
pub mod cooperative;
mod estimate;
mod exchange;
pub mod glue;
mod group_estimate;
pub mod iterative;
mod linear;
mod refresh;
mod report;
mod side;
#[cfg(test)]
mod tests;

pub use exchange::{Derivatives, Exchange};
pub use glue::{Glue, Row};
pub use group_estimate::GroupEstimate;
pub use report::{PortReport, StepReport};
pub use side::Instant;
/// How wrenches run inside a step: only their end value counts for the integrators in use.
pub(crate) const HOLD: terraglue_subsystem::Hold = terraglue_subsystem::Hold::End;

use crate::Result;
use crate::host::Instance;
use crate::scenario::GluingSpec;
use terraglue_subsystem::Capabilities;

/// How a strategy ended a step. Nothing is committed before it says `Converged`.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// `Exchange::t`, `x1` and `x2` hold what is to be committed.
    Converged,
    /// The step may be repeated with half the length.
    NotConverged(String),
}

/// A way to find the wrenches of one step (paper, steps 2 to 4; 1 and 5 are the same for all).
pub trait Strategy: Send {
    /// Name in the scenario.
    fn name(&self) -> &'static str;

    /// What a member on the side of the bodies and one on the side of the grounds must be able to do.
    fn needs(&self) -> (Capabilities, Capabilities);

    /// Whether it solves a step of h = 0 for the forces of joints at the start.
    fn starts_joints(&self) -> bool {
        false
    }

    /// Why it cannot glue this group, whatever its members can do.
    fn refuses(&self, _exchange: &Exchange) -> Option<String> {
        None
    }

    /// Finds the wrenches of the step.
    fn solve(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<Outcome>;
}

/// Names of all strategies, in the order of the documentation.
pub const STRATEGIES: [&str; 2] = [cooperative::NAME, iterative::NAME];

/// The strategy of a scenario; its name has been checked.
pub fn strategy(spec: &GluingSpec) -> Box<dyn Strategy> {
    if spec.strategy == iterative::NAME {
        Box::new(iterative::Iterative::new(spec))
    } else {
        Box::new(cooperative::Cooperative::default())
    }
}

/// Why `strategy` cannot glue these members, and which strategy could; `None`: it can.
pub fn refusal(strategy: &dyn Strategy, exchange: &Exchange, instances: &[Instance]) -> Option<String> {
    let (bodies, grounds) = strategy.needs();
    let lacks = |slot: usize, needs: Capabilities| {
        let have = instances[slot].capabilities();
        let missing = Capabilities(needs.0 & !have.0);
        (missing.0 != 0).then(|| {
            let names: Vec<_> = missing.names().collect();
            format!(
                "strategy `{}` needs {} of `{}` (module {}), which does not offer it",
                strategy.name(),
                names.join(", "),
                instances[slot].name(),
                instances[slot].module()
            )
        })
    };
    exchange
        .body_slots()
        .find_map(|s| lacks(s, bodies))
        .or_else(|| exchange.ground_slots().find_map(|s| lacks(s, grounds)))
}
