//! Explicit, all subsystems at once, as co-simulation masters do: the baseline.
//!
//! Springs: both sides step under T = k_c·(x2 − x1) of t. Contacts: the bodies step under the force that the soil
//! gave at the motion known one step earlier, F(x1 of t − h), because the soil steps at the same time.

use super::interface_problem::InterfaceProblem;
use super::memory::{Recall, Remember};
use super::{ConstraintKind, Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::Jacobi.name();

/// The explicit pass with the soil's force of the step before, by port.
#[derive(Debug, Default)]
pub struct Jacobi {
    delayed: Vec<(u64, [f64; 6])>,
    next: Vec<(u64, [f64; 6])>,
}

impl Strategy for Jacobi {
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

    fn remember(&self, out: &mut Vec<u64>) {
        out.put_wrenches(&self.delayed);
    }

    fn recall(&mut self, kept: &mut Recall) {
        kept.wrenches(&mut self.delayed);
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        problem.explicit_forces();
        self.next.clear();
        for k in 0..problem.ports.len() {
            let port = problem.ports[k];
            if problem.conditions.kinds[port.first as usize] == ConstraintKind::Joint {
                continue;
            }
            let mut now = [0.0; 6];
            now[..port.len()].copy_from_slice(&problem.t[port.range()]);
            self.next.push((port.key, now));
            let before = self.delayed.iter().find(|(key, _)| *key == port.key).map_or([0.0; 6], |d| d.1);
            problem.t[port.range()].copy_from_slice(&before[..port.len()]);
        }
        std::mem::swap(&mut self.delayed, &mut self.next);
        problem.advance_bodies(instances)?;
        problem.second.follow(&problem.first, &problem.conditions.kinds);
        Ok(super::single_pass(problem))
    }
}
