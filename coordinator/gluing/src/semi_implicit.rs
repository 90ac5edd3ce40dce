//! One Newton step of the T-T form and no check: T1 = T0 − Λ·e(T0), Λ = (G1 + G2 + 1/k_c)⁻¹.
//!
//! Two evaluations per step; the gap it leaves at smooth joints is of order h⁶. T0 is the force of the step before.
//! Contacts are refused: they open, close and bend within a step, and one unchecked Newton step left gaps of 5 cm
//! between walking feet and soil.

use super::interface_problem::InterfaceProblem;
use super::iterative::TtForm;
use super::memory::Recall;
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::GluingSpec;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::SemiImplicit.name();

/// The strategy with its buffers.
#[derive(Debug)]
pub struct SemiImplicit {
    tt: TtForm,
}

impl SemiImplicit {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        Self { tt: TtForm::new(spec.jacobian) }
    }
}

impl Strategy for SemiImplicit {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_single_pass(&self) -> bool {
        true
    }

    fn needs(&self) -> Needs {
        let both = Capabilities::FORCE | Capabilities::RETRY;
        Needs { first: both, second: both, grounds: both }
    }

    fn refuses(&self, problem: &InterfaceProblem) -> Option<String> {
        (problem.has_grounds() || problem.glue.contact().is_some()).then(|| {
            format!(
                "`{NAME}` takes one Newton step and does not check it: a contact opens, closes and yields within the step"
            )
        })
    }

    fn remember(&self, out: &mut Vec<u64>) {
        self.tt.remember(out);
    }

    fn recall(&mut self, kept: &mut Recall) {
        self.tt.recall(kept);
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        problem.start_from_last();
        self.tt.one_step(problem, instances)
    }
}
