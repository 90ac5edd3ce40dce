//! The paper's co-operational T-T strategy: one pass, no iteration.
//!
//! Rossmann, Jung and Rast (2010), section IV B: the rigid bodies offer an estimate T* of the contact force that
//! a local soil could not know; the soil answers T1, which is what it can give; the bodies are solved again
//! without the contact constraints, under T1. The coordinator never sends T2 back.

use super::exchange::Exchange;
use super::{Needs, Outcome, Strategy};
use crate::Result;
use crate::host::Instance;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = "cooperative";

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

    fn refuses(&self, exchange: &Exchange) -> Option<String> {
        super::joints_refused(NAME, exchange).or_else(|| super::body_contacts_refused(NAME, exchange))
    }

    fn solve(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<Outcome> {
        exchange.estimate_forces(instances)?;
        exchange.solve_compatibility(instances)?;
        exchange.advance_bodies(instances)?;
        // the soil was loaded with T* and the body with T1; it takes the body's motion as its own at commit
        let (report, estimate) = (&mut exchange.report, &exchange.estimate);
        let n = estimate.t_star.len();
        for i in exchange.ports.iter().map(|port| port.first as usize) {
            // whose motion is given, like that of driven feet, bears whatever the soil gives
            if estimate.g[i * n + i] == 0.0 {
                continue;
            }
            let difference = (estimate.t_star[i] - exchange.t[i]).abs();
            report.max_action_reaction_gap_n = report.max_action_reaction_gap_n.max(difference);
        }
        exchange.x2.copy_from_slice(&exchange.x1);
        report.converged = true;
        Ok(Outcome::Converged)
    }
}
