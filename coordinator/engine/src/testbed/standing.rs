//! The time before the start: what touches the ground comes to rest on it, so that a run begins with a robot that stands.
//!
//! Glued subsystems and bodies without glue make steps from −`time.settle_s` to 0. Controllers and sensors make none: they stay at
//! t = 0 and hold what they ask for there. Events and faults of signals wait as well. Prints in the ground stay; what is
//! counted since the start, by the testbed and by modules that offer the action `energy.restart`, counts from t = 0 on.

use super::Testbed;
use super::run_clock::RunClock;
use super::subsystems::Subsystems;
use super::uncoupled::nothing;
use crate::signals::{Signals, StreamLink};
use std::sync::atomic::Ordering;
use terraglue_diagnostics::Result;
use terraglue_gluing::timing::Timings;
use terraglue_gluing::{Outcome, StepReport};
use terraglue_subsystem::{Energy, Input, Kind, Step};

impl Testbed {
    /// Makes the steps before t = 0 that `time.settle_s` asks for. Once; the first step does it at the latest.
    ///
    /// # Errors
    /// Errors of a step before the start; its time is negative.
    pub fn begin(&mut self) -> Result {
        if self.clock.started || self.clock.index > 0 || self.clock.t != 0.0 {
            return Ok(());
        }
        self.clock.started = true;
        let exact = self.settle_s / self.clock.step_s;
        // 1.1 s in steps of 1 ms are 1100, whatever the division leaves
        let whole = (exact - exact.round()).abs() <= 1e-6;
        let count = if whole { exact.round() } else { exact.ceil() };
        // 0.0 −, and not −: 0 s has no sign
        self.clock.t = 0.0 - count * self.clock.step_s;
        if count > 0.0 {
            self.signals.initialize(&mut self.subsystems.instances)?;
        }
        self.glued.start_joints(&self.clock, &mut self.subsystems, &mut self.timings)?;
        if count > 0.0 {
            self.stand(count as u64)?;
        }
        self.streams.forget();
        self.signals.links.streams.iter_mut().for_each(StreamLink::forget);
        self.sight.begin(&self.clock, &mut self.subsystems)?;
        self.streams
            .collect(&self.subsystems.instances, |stream, bytes| self.signals.links.feed(stream, bytes))
    }

    /// Ends the initialisation of FMUs before the first step does, so that a recording begins with their outputs of the start. From then on
    /// their parameters are fixed, so it is left to the first step where an event sets something at the start. After
    /// [`Testbed::begin`].
    ///
    /// # Errors
    /// An FMU that fails, or connected start values without a solution.
    pub fn end_initialization(&mut self) -> Result {
        let has_fmus = self.subsystems.schedules.iter().any(|turn| turn.is_fmu && !turn.glued);
        if self.settle_s > 0.0 || !has_fmus || self.signals.time_line.sets_at_start() {
            return Ok(());
        }
        end_initialization(&mut self.clock, &mut self.signals, &mut self.subsystems)
    }

    /// Steps up to t = 0 in which controllers wait; then all counts begin.
    fn stand(&mut self, count: u64) -> Result {
        let Subsystems { instances, schedules, .. } = &mut self.subsystems;
        for (turn, instance) in schedules.iter_mut().zip(instances) {
            let waits = matches!(instance.kind(), Kind::Controller | Kind::Sensor);
            turn.holds = waits || turn.step_multiple > 1;
        }
        let stood = (1..=count).rev().try_for_each(|left| self.stand_step(left));
        self.standing.store(0, Ordering::Relaxed);
        self.subsystems.schedules.iter_mut().for_each(|turn| turn.holds = false);
        stood?;
        (self.clock.t, self.clock.index, self.halvings) = (0.0, 0, 0);
        self.report = StepReport { converged: true, ..StepReport::default() };
        self.timings = Timings::default();
        self.glued.groups.iter_mut().for_each(|g| g.problem.timings = Timings::default());
        self.subsystems.restart_counts()?;
        self.clock.before = Energy::default();
        self.clock.before = self.energy();
        Ok(())
    }

    /// The step from which on `left` − 1 are left.
    fn stand_step(&mut self, left: u64) -> Result {
        if self.cancelled() {
            return Ok(());
        }
        self.standing.store(self.clock.t.to_bits(), Ordering::Relaxed);
        let end = -((left - 1) as f64) * self.clock.step_s;
        let mut longest = self.clock.step_s;
        self.halvings = 0;
        self.streams.clear();
        while self.clock.is_before(end) {
            self.signals.read(&self.subsystems.instances)?;
            self.signals.write(&mut self.subsystems.instances)?;
            let h = longest.min(end - self.clock.t);
            match self.communication_step(h, end)? {
                Outcome::Converged => self.clock.advance(h),
                Outcome::NotConverged(why) if self.halvings == self.max_halvings => {
                    return Err(self.glued.gave_up(self.clock.t, self.max_halvings, &why));
                }
                Outcome::NotConverged(_) => {
                    self.halvings += 1;
                    longest = 0.5 * h;
                }
            }
        }
        self.clock.t = end;
        Ok(())
    }
}

/// Passes connected start values on and ends the initialisation of FMUs, by a step of no length: from then on they show the outputs
/// of the start. Once.
pub(super) fn end_initialization(
    clock: &mut RunClock,
    signals: &mut Signals,
    subsystems: &mut Subsystems,
) -> Result {
    if std::mem::replace(&mut clock.initialised, true) {
        return Ok(());
    }
    let Subsystems { instances, schedules, .. } = subsystems;
    signals.initialize(instances)?;
    let fmus = instances.iter_mut().zip(schedules).filter(|(_, turn)| turn.is_fmu && !turn.glued);
    for (instance, _) in fmus {
        let none = Input::Force { t: &[], motion: None };
        instance.advance(&Step::free(clock.t, 0.0, 0), &none, &mut nothing())?;
    }
    Ok(())
}

/// Energy exchanged since a state with the ledger `before`.
pub(super) fn since(before: &Energy, now: Energy) -> Energy {
    Energy {
        dissipated: now.dissipated - before.dissipated,
        port_work: now.port_work - before.port_work,
        actuator_work: now.actuator_work - before.actuator_work,
        electrical: now.electrical - before.electrical,
        ..now
    }
}
