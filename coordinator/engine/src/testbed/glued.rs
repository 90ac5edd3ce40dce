//! Glue of a run: contact detection, the groups with their strategies, and the control of the length of steps.

use super::group::Group;
use super::run_clock::RunClock;
use super::subsystems::Subsystems;
use std::time::Instant as Clock;
use terraglue_diagnostics::{Error, Result};
use terraglue_gluing as gluing;
use terraglue_gluing::contact::{ContactDetector, Now, PortSet};
use terraglue_gluing::memory::Recall;
use terraglue_gluing::step_control::StepControl;
use terraglue_gluing::timing::{Part, Timings};
use terraglue_gluing::{Outcome, StepReport};
use terraglue_scenario::GluingSpec;

/// All groups of glued subsystems with what finds their ports.
pub(super) struct GluedGroups {
    /// Subsystems that are glued to each other, in the order of their first member.
    pub groups: Vec<Group>,
    /// Finds where bodies may touch ground.
    pub detector: ContactDetector,
    /// Ports of groups without ground.
    pub no_ports: PortSet,
    /// Sets the length of steps, where the scenario asks for it.
    pub control: Option<StepControl>,
    /// The strategy that did not converge in the last step; none: what is not glued stopped it.
    pub failed: Option<&'static str>,
    /// Gravity of the world, m/s².
    pub gravity: [f64; 3],
    /// Distance before contact at which a port is made, m.
    pub contact_margin_m: f64,
}

impl GluedGroups {
    /// Length of the next communication step: as long as is left, unless halving or the control asks for less.
    pub fn next_length(
        &mut self,
        (longest, left): (f64, f64),
        clock: &RunClock,
        subsystems: &mut Subsystems,
    ) -> Result<f64> {
        let Some(mut control) = self.control else { return Ok(longest.min(left)) };
        if let Some(residual) = self.energy_residual(control.h, clock, subsystems)? {
            control.learn(residual, control.last_h);
        }
        let wanted = control.h.min(longest);
        // two equal parts rather than a long one and a splinter
        let h = if wanted >= left { left } else { wanted.min(0.5 * left) };
        control.last_h = h;
        self.control = Some(control);
        Ok(h)
    }

    /// The energy residual of the step before, J, by the forces of all laws at t; none before the first.
    fn energy_residual(
        &mut self,
        h: f64,
        clock: &RunClock,
        subsystems: &mut Subsystems,
    ) -> Result<Option<f64>> {
        if clock.index == 0 {
            return Ok(None);
        }
        self.detect_contacts(clock.t, h, subsystems)?;
        let mut sum = 0.0;
        for group in &mut self.groups {
            let found = if group.problem.has_grounds() { self.detector.ports() } else { &self.no_ports };
            let Subsystems { instances, members, .. } = subsystems;
            sum += group.residual(clock.step_of(h), found, members, instances)?;
        }
        Ok(Some(sum))
    }

    /// Detects possible contacts of bodies with ground in a step of length h; the ports are then in the detector.
    pub fn detect_contacts(&mut self, t: f64, h: f64, subsystems: &Subsystems) -> Result {
        let now = Now { t, h, gravity: self.gravity, margin: self.contact_margin_m };
        let Subsystems { members, instances, .. } = subsystems;
        let states = |slot: u32| members[slot as usize].states.as_slice();
        self.detector.detect(&now, states, |slot| instances[slot as usize].subsystem())?;
        match self.detector.buried() {
            Some(message) => Err(Error::Simulation { time_s: t, message: message.into() }),
            None => Ok(()),
        }
    }

    /// The forces of joints and the accelerations at the start: a step of h = 0.
    pub fn start_joints(
        &mut self,
        clock: &RunClock,
        subsystems: &mut Subsystems,
        timings: &mut Timings,
    ) -> Result {
        if self.groups.iter().all(|g| g.start.is_none()) {
            return Ok(());
        }
        self.groups.iter_mut().for_each(Group::swap_start);
        let started = self.step((0.0, 0), clock, subsystems, timings);
        self.groups.iter_mut().for_each(Group::swap_start);
        match started? {
            Outcome::Converged => Ok(()),
            Outcome::NotConverged(why) => {
                let message = format!("at the start, for the forces of the joints: {why}");
                Err(Error::Simulation { time_s: clock.t, message })
            }
        }
    }

    /// (4) The groups of glued subsystems: the five steps of the paper, for a step of length h after so many halvings.
    pub fn step(
        &mut self,
        (h, halvings): (f64, u32),
        clock: &RunClock,
        subsystems: &mut Subsystems,
        timings: &mut Timings,
    ) -> Result<Outcome> {
        if self.groups.is_empty() {
            return Ok(Outcome::Converged);
        }
        let start = Clock::now();
        // step 1: collision detection and the constraints of rigid contact
        self.detect_contacts(clock.t, h, subsystems)?;
        timings.charge(Part::Contact, start);
        let watched = self.control.is_some();
        let Subsystems { instances, members, .. } = subsystems;
        for group in self.groups.iter_mut().filter(|g| h > 0.0 || g.start.is_some()) {
            let found = if group.problem.has_grounds() { self.detector.ports() } else { &self.no_ports };
            group.begin(clock.step_of(h), found, members, instances, timings)?;
            group.measure_gap();
            if watched {
                group.passage.look(&mut group.problem);
            }
            // steps 2 to 4: estimate, compatibility, the bodies under the soil's force
            let outcome = match group.strategy.solve(&mut group.problem, instances) {
                Err(early @ Error::Early { .. }) => Outcome::NotConverged(early.to_string()),
                outcome => outcome?,
            };
            if outcome != Outcome::Converged {
                self.failed = Some(group.strategy.name());
                return Ok(outcome);
            }
        }
        // step 5: integrate, once all groups agree
        for group in self.groups.iter_mut().filter(|g| h > 0.0 || g.start.is_some()) {
            let found = if group.problem.has_grounds() { self.detector.ports() } else { &self.no_ports };
            group.describe(found, halvings);
            if watched {
                group.passage.take(&group.problem);
            }
            group.problem.commit(instances)?;
        }
        Ok(Outcome::Converged)
    }

    /// Adds what all groups did in the last communication step to the report of the nominal step.
    pub fn account(&self, report: &mut StepReport) {
        report.ports.clear();
        report.parts += 1;
        self.groups.iter().for_each(|g| report.add(&g.problem.report));
    }

    /// The error of a step at time t that was not made after all halvings.
    pub fn gave_up(&self, t: f64, max_halvings: u32, message: &str) -> Error {
        let Some(strategy) = self.failed else {
            let message = format!("{message}; the step was halved {max_halvings} times");
            return Error::Simulation { time_s: t, message };
        };
        Error::NotConverged {
            strategy,
            time_s: t,
            message: format!(
                "{message}; the step was halved {max_halvings} times. Try a smaller time.step_s, another gluing.form, \
                 gluing.jacobian or strategy: `terraglue compare SCENARIO --strategies iterative,relaxed,…` runs several \
                 side by side and names those that cannot"
            ),
        }
    }

    /// Glues from the next step on as `spec` says; nothing changes where a strategy cannot glue its group.
    pub fn set_strategies(&mut self, spec: &GluingSpec, t: f64, subsystems: &Subsystems) -> Result {
        let specs: Vec<_> = self.groups.iter().map(|g| g.spec(spec)).collect();
        for (group, spec) in self.groups.iter().zip(&specs) {
            if let Some(refusal) = gluing::refusal(spec, &group.problem, &subsystems.instances) {
                return Err(Error::Simulation { time_s: t, message: refusal.reason });
            }
        }
        for (group, spec) in self.groups.iter_mut().zip(&specs) {
            group.strategy = gluing::strategy(spec);
        }
        Ok(())
    }

    /// Memory of each group, signals and streams (given), contact detection and the control of the steps from step to
    /// step.
    pub fn memory(&self, signals: Vec<u64>, streams: Vec<u64>) -> Vec<Vec<u64>> {
        let mut all: Vec<Vec<u64>> = self.groups.iter().map(Group::memory).collect();
        all.push(signals);
        all.push(self.detector.remember());
        let mut last = Vec::new();
        self.control.iter().for_each(|c| c.remember(&mut last));
        all.push(last);
        all.push(streams);
        all
    }

    /// Back to what [`GluedGroups::memory`] gave; what signals and streams kept.
    pub fn recall<'a>(&mut self, memory: &'a [Vec<u64>]) -> [Recall<'a>; 2] {
        for (group, kept) in self.groups.iter_mut().zip(memory) {
            group.recall(kept);
        }
        let mut others = memory.iter().skip(self.groups.len());
        let signals = others.next();
        others.next().into_iter().for_each(|kept| self.detector.recall(kept));
        let control = others.next();
        if let (Some(own), Some(kept)) = (&mut self.control, control) {
            own.recall(&mut Recall(kept));
        }
        [signals, others.next()].map(|kept| Recall(kept.map_or(&[], Vec::as_slice)))
    }
}
