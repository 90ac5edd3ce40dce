//! The time before the start: what touches the ground comes to rest on it, so that a run begins with a robot that stands.
//!
//! Glued subsystems and bodies without glue make steps from −`time.settle_s` to 0. Controllers make none: they stay at
//! t = 0 and hold what they ask for there. Events and faults of signals wait as well. Prints in the ground stay; what is
//! counted since the start, by the testbed and by modules that offer [`RESTART`], counts from t = 0 on.

use super::Testbed;
use std::sync::atomic::Ordering;
use std::time::Duration;
use terraglue_diagnostics::Result;
use terraglue_gluing::timing::Timings;
use terraglue_gluing::{Outcome, StepReport};
use terraglue_subsystem::{Energy, Kind};

/// Action of a module that begins to count work and heat afresh.
const RESTART: &str = "energy.restart";

impl Testbed {
    /// Makes the steps before t = 0 that `time.settle_s` asks for. Once; the first step does it at the latest.
    ///
    /// # Errors
    /// What a step before the start runs into; its time is negative.
    pub fn begin(&mut self) -> Result {
        if self.started || self.index > 0 || self.t != 0.0 {
            return Ok(());
        }
        self.started = true;
        let exact = self.settle_s / self.step_s;
        // 1.1 s in steps of 1 ms are 1100, whatever the division leaves
        let whole = (exact - exact.round()).abs() <= 1e-6;
        let count = if whole { exact.round() } else { exact.ceil() };
        // 0.0 −, and not −: 0 s has no sign
        self.t = 0.0 - count * self.step_s;
        if count > 0.0 {
            self.initialize_signals()?;
        }
        self.start_joints()?;
        if count > 0.0 {
            self.stand(count as u64)?;
        }
        Ok(())
    }

    /// Steps up to t = 0 in which controllers wait; then all counts begin.
    fn stand(&mut self, count: u64) -> Result {
        let holds: Vec<bool> = self
            .instances
            .iter()
            .zip(&self.schedules)
            .map(|(i, turn)| i.kind() == Kind::Controller || turn.step_multiple > 1)
            .collect();
        self.schedules.iter_mut().zip(&holds).for_each(|(turn, holds)| turn.holds = *holds);
        let stood = (1..=count).rev().try_for_each(|left| self.stand_step(left));
        self.standing.store(0, Ordering::Relaxed);
        self.schedules.iter_mut().for_each(|turn| turn.holds = false);
        stood?;
        (self.t, self.index, self.halvings) = (0.0, 0, 0);
        self.restart_counts()
    }

    /// The step from which on `left` − 1 are left.
    fn stand_step(&mut self, left: u64) -> Result {
        if self.cancelled() {
            return Ok(());
        }
        self.standing.store(self.t.to_bits(), Ordering::Relaxed);
        let end = -((left - 1) as f64) * self.step_s;
        let mut longest = self.step_s;
        self.halvings = 0;
        while end - self.t > 1e-6 * self.step_s {
            self.pass_signals()?;
            let h = longest.min(end - self.t);
            match self.communication_step(h, end)? {
                Outcome::Converged => {
                    self.index += 1;
                    self.t += h;
                }
                Outcome::NotConverged(why) if self.halvings == self.max_halvings => {
                    return Err(self.gave_up(why));
                }
                Outcome::NotConverged(_) => {
                    self.halvings += 1;
                    longest = 0.5 * h;
                }
            }
        }
        self.t = end;
        Ok(())
    }

    /// Work, heat and costs count from here on.
    fn restart_counts(&mut self) -> Result {
        self.report = StepReport { converged: true, ..StepReport::default() };
        self.timings = Timings::default();
        self.groups.iter_mut().for_each(|g| g.problem.timings = Timings::default());
        self.members.iter_mut().for_each(|m| m.cost = Duration::ZERO);
        for instance in &mut self.instances {
            instance.forget_cost();
            if instance.actions().iter().any(|a| a.name == RESTART) {
                instance.act(RESTART, "{}")?;
            }
        }
        self.before = Energy::default();
        self.before = self.energy();
        Ok(())
    }
}

/// What has come in and gone out since a state whose ledger says `before`.
pub(super) fn since(before: &Energy, now: Energy) -> Energy {
    Energy {
        dissipated: now.dissipated - before.dissipated,
        port_work: now.port_work - before.port_work,
        actuator_work: now.actuator_work - before.actuator_work,
        electrical: now.electrical - before.electrical,
        ..now
    }
}
