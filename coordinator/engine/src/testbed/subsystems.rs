//! The subsystems of a run: their instances, when each makes a step, and what the coordinator keeps of each.

use super::schedule::StepSchedule;
use std::time::Duration;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::BodyState;

/// Action of a module that begins to count work and heat afresh.
const RESTART: &str = "energy.restart";

/// Data of the coordinator on an instance beside the instance itself.
#[derive(Debug)]
pub(super) struct Member {
    /// Committed states of its bodies.
    pub states: Vec<BodyState>,
    /// Cost of its trials without glue, sampled, and of what it observes, s.
    pub cost: Duration,
}

/// All subsystems in the order of their names, in three lists of one length.
pub(super) struct Subsystems {
    pub instances: Vec<Instance>,
    /// When each makes a step by itself.
    pub schedules: Vec<StepSchedule>,
    pub members: Vec<Member>,
}

impl Subsystems {
    /// Takes the committed states of all bodies.
    pub fn read_states(&mut self) -> Result {
        for (slot, _) in self.schedules.iter().enumerate().filter(|(_, turn)| turn.has_bodies) {
            self.instances[slot].body_states(&mut self.members[slot].states)?;
        }
        Ok(())
    }

    /// Cost of the steps of a subsystem. Without glue: the steps that were watched, times the steps that each stands
    /// for; with glue: all calls in a step.
    pub fn cost(&self, slot: usize) -> Duration {
        match self.schedules[slot].glued {
            true => self.instances[slot].cost(),
            false => self.members[slot].cost,
        }
    }

    /// Work, heat and costs count from here on.
    pub fn restart_counts(&mut self) -> Result {
        self.members.iter_mut().for_each(|m| m.cost = Duration::ZERO);
        for instance in &mut self.instances {
            instance.forget_cost();
            if instance.actions().iter().any(|a| a.name == RESTART) {
                instance.act(RESTART, "{}")?;
            }
        }
        Ok(())
    }
}
