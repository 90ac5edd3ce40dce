//! The step loop; the paper's five steps can be read here and in [`terraglue_gluing`] by name.
//!
//! Order of a communication step, all subsystems: (1) events and `set`; (2) outputs of t become inputs;
//! (3) a trial of every subsystem without glue; (4) the group of glued subsystems by its strategy;
//! (5) commit of all, in the order of their names. Reads see committed values only.

use crate::observer::{Event, Observer, SubsystemView, View, ledger_of};
use crate::signals::{Directory, Faults, Link, Links, TimeLine};
use serde_json::Value;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant as Clock};
use terraglue_diagnostics::{Error, Result};
use terraglue_gluing as gluing;
use terraglue_gluing::contact::{ContactDetector, Now, PortSet};
use terraglue_gluing::memory::Recall;
use terraglue_gluing::step_control::StepControl;
use terraglue_gluing::timing::{Part, Timings};
use terraglue_gluing::{Outcome, StepContext, StepReport};
use terraglue_host::{Instance, Reply, TeardownErrors};
use terraglue_subsystem::{BodyState, Energy};
use uncoupled::{StepSchedule, Uncoupled};

mod build;
mod explain;
mod group;
mod hosted;
mod pieces;
mod reload;
mod standing;
mod uncoupled;

pub use build::{find, make, services, with_law};
pub use explain::{ConnectionNote, Explanation};
use group::Group;

/// What a run needs beside its scenario.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Threads for `parallel_for`; 0: as many as there are cores. Results do not depend on it.
    pub threads: usize,
    /// Folders searched for modules before all others.
    pub module_paths: Vec<PathBuf>,
    /// Set from outside to stop the run at the next communication point.
    pub cancel: Arc<AtomicBool>,
    /// Bits of the time before the start, s, while what touches the ground comes to rest; 0 otherwise.
    pub standing: Arc<AtomicU64>,
}

/// What the coordinator knows of an instance beside the instance itself.
#[derive(Debug)]
struct Member {
    states: Vec<BodyState>,
    /// CPU cost of its trials without glue, sampled, s.
    cost: Duration,
}

/// A simulation of a whole mission. Several live side by side; there are no globals.
pub struct Testbed {
    instances: Vec<Instance>,
    /// When each makes a step by itself.
    schedules: Vec<StepSchedule>,
    members: Vec<Member>,
    /// Subsystems that are glued to each other, in the order of their first member.
    groups: Vec<Group>,
    detector: ContactDetector,
    links: Links,
    time_line: TimeLine,
    faults: Faults,
    /// Whether steps may be cut so that one ends at the time of an event.
    exact: bool,
    directory: Directory,
    events: Vec<Event>,
    /// How the last nominal step was glued, all groups and parts.
    report: StepReport,
    /// Ports of groups without ground.
    no_ports: PortSet,
    /// Sets the length of steps, where the scenario asks for it.
    control: Option<StepControl>,
    /// The strategy that did not converge last.
    failed: &'static str,
    timings: Timings,
    uncoupled: Uncoupled,
    gravity: [f64; 3],
    contact_margin_m: f64,
    cancel: Arc<AtomicBool>,
    standing: Arc<AtomicU64>,
    teardown_errors: TeardownErrors,
    step_s: f64,
    /// Time of nominal step 0, s: 0 unless the length of the steps has been changed on the way.
    origin_s: f64,
    /// Nominal steps done.
    nominal: u64,
    /// Communication steps done, halves counted.
    index: u64,
    t: f64,
    last_h: f64,
    /// Time before t = 0 in which bodies come to rest on the ground, s.
    settle_s: f64,
    /// Energies that were counted before t = 0.
    before: Energy,
    halvings: u32,
    max_halvings: u32,
    started: bool,
}

/// Where a testbed stood; see [`Testbed::snapshot`].
#[derive(Clone, Debug)]
pub struct Snapshot {
    slot: u32,
    clock: TimeKept,
    fired: Vec<bool>,
    /// What each group, faults, contact detection and the control of the steps keep from step to step.
    memory: Vec<Vec<u64>>,
}

/// What a testbed knows of its time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TimeKept {
    step_s: f64,
    origin_s: f64,
    nominal: u64,
    index: u64,
    t: f64,
    started: bool,
    /// Energies that were counted before t = 0.
    before: Energy,
}

impl Testbed {
    /// Simulated time, s.
    pub fn t_s(&self) -> f64 {
        self.t
    }

    /// Communication steps done so far.
    pub fn step_index(&self) -> u64 {
        self.index
    }

    /// All variables by full name.
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// All instances in the order of their names.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Number of variables that are fed by another one.
    pub fn connections(&self) -> usize {
        self.links.numbers.iter().map(Link::count).sum::<usize>() + self.links.discrete.len()
    }

    /// How the last step was glued.
    pub fn report(&self) -> &StepReport {
        &self.report
    }

    /// Goes to the next nominal communication point t + h.
    pub fn step(&mut self) -> Result {
        self.begin()?;
        let end = self.origin_s + (self.nominal + 1) as f64 * self.step_s;
        let mut longest = self.step_s;
        self.halvings = 0;
        self.report.clear();
        self.report.converged = true;
        while end - self.t > 1e-6 * self.step_s {
            let (start, times) = self.watch();
            self.apply_events()?;
            self.transfer_signals()?;
            self.timings.charge_sample(Part::Signals, start, times);
            let h_now = self.next_length(longest, end)?;
            match self.communication_step(h_now, end)? {
                Outcome::Converged => {
                    self.index += 1;
                    self.t += h_now;
                    self.account();
                }
                Outcome::NotConverged(why) if self.halvings == self.max_halvings => {
                    self.account();
                    return Err(self.gave_up(why));
                }
                Outcome::NotConverged(_) => {
                    self.groups.iter().for_each(|g| self.report.add_cost(&g.problem.report));
                    self.halvings += 1;
                    longest = 0.5 * h_now;
                }
            }
        }
        self.nominal += 1;
        self.t = end;
        self.last_h = self.step_s;
        Ok(())
    }

    /// Length of the next communication step: as long as is left, unless halving or the control asks for less.
    fn next_length(&mut self, longest: f64, end: f64) -> Result<f64> {
        let left = self.next_stop(end) - self.t;
        let Some(mut control) = self.control else { return Ok(longest.min(left)) };
        if let Some(residual) = self.energy_residual(control.h)? {
            control.learn(residual, control.last_h);
        }
        let wanted = control.h.min(longest);
        // two equal parts rather than a long one and a splinter
        let h = if wanted >= left { left } else { wanted.min(0.5 * left) };
        control.last_h = h;
        self.control = Some(control);
        Ok(h)
    }

    /// The end of the nominal step, or the time of an event or a fault before it.
    fn next_stop(&self, end: f64) -> f64 {
        if !self.exact {
            return end;
        }
        let next = self.time_line.next_time(self.t).min(self.faults.next_time(self.t));
        let apart = 1e-6 * self.step_s;
        if next - self.t > apart && end - next > apart { next } else { end }
    }

    /// The energy residual of the step before, J, by the forces of all laws at t; none before the first.
    fn energy_residual(&mut self, h: f64) -> Result<Option<f64>> {
        if self.index == 0 {
            return Ok(None);
        }
        self.detect_contacts(h)?;
        let at = StepContext { t: self.t, h, index: self.index, ..StepContext::default() };
        let mut sum = 0.0;
        for group in &mut self.groups {
            let found = if group.problem.has_grounds() { self.detector.ports() } else { &self.no_ports };
            sum += group.residual(at, found, &self.members, &mut self.instances)?;
        }
        Ok(Some(sum))
    }

    /// Adds what all groups did in the last communication step to the report of the nominal step.
    fn account(&mut self) {
        self.report.ports.clear();
        self.report.parts += 1;
        self.groups.iter().for_each(|g| self.report.add(&g.problem.report));
    }

    /// The forces of joints and the accelerations at the start: a step of h = 0.
    fn start_joints(&mut self) -> Result {
        if self.groups.iter().all(|g| g.start.is_none()) {
            return Ok(());
        }
        self.groups.iter_mut().for_each(Group::swap_start);
        let started = self.glue(0.0);
        self.groups.iter_mut().for_each(Group::swap_start);
        match started? {
            Outcome::Converged => Ok(()),
            Outcome::NotConverged(why) => {
                let message = format!("at the start, for the forces of the joints: {why}");
                Err(Error::Simulation { time_s: self.t, message })
            }
        }
    }

    /// (1) What the time line has for this communication point.
    fn apply_events(&mut self) -> Result {
        while let Some(due) = self.time_line.next_due(self.t, self.step_s, &self.instances) {
            for (name, value) in &due.set {
                self.set(name, value)?;
            }
            for action in &due.act {
                self.act(action, "{}")?;
            }
        }
        Ok(())
    }

    /// (2) Outputs of t become inputs of the step.
    fn transfer_signals(&mut self) -> Result {
        if self.index == 0 && self.t == 0.0 {
            self.initialize_signals()?;
        }
        self.read_signals()?;
        if !self.faults.is_empty() {
            self.apply_faults()?;
        }
        self.write_signals()
    }

    /// Outputs become inputs with nothing wrong on their way.
    fn pass_signals(&mut self) -> Result {
        self.read_signals()?;
        self.write_signals()
    }

    fn read_signals(&mut self) -> Result {
        // all are read before any is set: an FMU whose outputs follow its inputs at once shows nobody the inputs of t
        for link in &mut self.links.numbers {
            link.read(&self.instances)?;
        }
        self.links.discrete.iter_mut().try_for_each(|l| l.read(&self.instances))
    }

    fn write_signals(&mut self) -> Result {
        for link in &self.links.numbers {
            link.pass_on(&mut self.instances)?;
        }
        self.links.discrete.iter().try_for_each(|l| l.pass_on(&mut self.instances))
    }

    /// What is wrong with the values on their way.
    fn apply_faults(&mut self) -> Result {
        let (t_s, events) = (self.t, &mut self.events);
        let links = &mut self.links.numbers;
        self.faults.apply((t_s, self.step_s), links, &mut self.instances, |(label, begins)| {
            let what = format!("fault {}: {label}", if begins { "begins" } else { "ends" });
            events.push(Event { t_s, what });
        })
    }

    /// (3) to (5) for one step of length h; nothing is committed unless it converged.
    fn communication_step(&mut self, h: f64, end: f64) -> Result<Outcome> {
        let (start, times) = self.watch();
        let early = self.advance_unglued(h, end)?;
        if let Some(why) = early {
            return Ok(Outcome::NotConverged(why));
        }
        self.timings.charge_sample(Part::Uncoupled, start, times);
        let outcome = self.glue(h)?;
        if outcome == Outcome::Converged {
            self.commit_unglued(h, end)?;
            self.read_states()?;
        }
        Ok(outcome)
    }

    /// (4) The group of glued subsystems: the five steps of the paper.
    fn glue(&mut self, h: f64) -> Result<Outcome> {
        if self.groups.is_empty() {
            return Ok(Outcome::Converged);
        }
        let at = StepContext { t: self.t, h, index: self.index, ..StepContext::default() };
        let start = Clock::now();
        // step 1: collision detection and the constraints of rigid contact
        self.detect_contacts(h)?;
        self.timings.charge(Part::Contact, start);
        let watched = self.control.is_some();
        for group in self.groups.iter_mut().filter(|g| h > 0.0 || g.start.is_some()) {
            let found = if group.problem.has_grounds() { self.detector.ports() } else { &self.no_ports };
            group.begin(at, found, &self.members, &mut self.instances, &mut self.timings)?;
            group.measure_gap();
            if watched {
                group.passage.look(&mut group.problem);
            }
            // steps 2 to 4: estimate, compatibility, the bodies under the soil's force
            let outcome = match group.strategy.solve(&mut group.problem, &mut self.instances) {
                Err(early @ Error::Early { .. }) => Outcome::NotConverged(early.to_string()),
                outcome => outcome?,
            };
            if outcome != Outcome::Converged {
                self.failed = group.strategy.name();
                return Ok(outcome);
            }
        }
        // step 5: integrate, once all groups agree
        for group in self.groups.iter_mut().filter(|g| h > 0.0 || g.start.is_some()) {
            let found = if group.problem.has_grounds() { self.detector.ports() } else { &self.no_ports };
            group.describe(found, self.halvings);
            if watched {
                group.passage.take(&group.problem);
            }
            group.problem.commit(&mut self.instances)?;
        }
        Ok(Outcome::Converged)
    }

    /// Where bodies may touch ground in a step of length h; the ports are then in the detector.
    fn detect_contacts(&mut self, h: f64) -> Result {
        let now = Now { t: self.t, h, gravity: self.gravity, margin: self.contact_margin_m };
        let (members, instances) = (&self.members, &self.instances);
        let states = |slot: u32| members[slot as usize].states.as_slice();
        self.detector.detect(&now, states, |slot| instances[slot as usize].subsystem())?;
        match self.detector.buried() {
            Some(message) => Err(Error::Simulation { time_s: self.t, message: message.into() }),
            None => Ok(()),
        }
    }

    fn read_states(&mut self) -> Result {
        for (slot, _) in self.schedules.iter().enumerate().filter(|(_, turn)| turn.has_bodies) {
            self.instances[slot].body_states(&mut self.members[slot].states)?;
        }
        Ok(())
    }

    fn gave_up(&self, message: String) -> Error {
        Error::NotConverged {
            strategy: self.failed,
            time_s: self.t,
            message: format!(
                "{message}; the step was halved {} times. Try a smaller time.step_s, another gluing.form, \
                 gluing.jacobian or strategy: `terraglue compare SCENARIO --strategies iterative,relaxed,…` runs several \
                 side by side and names those that cannot",
                self.max_halvings
            ),
        }
    }

    /// Steps until `until_s`, an error, or the cancel flag; tells the observers. The observers' `finished` is
    /// left to the caller, who knows whether the run goes on.
    pub fn run_until(&mut self, until_s: f64, observers: &mut [&mut dyn Observer]) -> Result {
        while until_s - self.t > 1e-6 * self.step_s && !self.cancelled() {
            let stepped = self.step();
            for event in self.events.drain(..) {
                for observer in observers.iter_mut() {
                    observer.event(&event)?;
                }
            }
            stepped?;
            self.view(|view| observers.iter_mut().try_for_each(|o| o.stepped(view)))?;
        }
        Ok(())
    }

    /// Where the time of all steps went.
    pub fn timings(&self) -> Timings {
        let mut sum = self.timings.clone();
        self.groups.iter().for_each(|g| sum.add(&g.problem.timings));
        sum
    }

    /// Whether somebody asked to stop.
    pub fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// Shows the committed state.
    pub fn view<R>(&self, look: impl FnOnce(&View) -> R) -> R {
        let subsystems: Vec<SubsystemView> = self
            .instances
            .iter()
            .zip(&self.members)
            .map(|(instance, member)| SubsystemView {
                name: instance.name(),
                module: instance.module(),
                kind: instance.kind(),
                scene: instance.scene(),
                body_states: &member.states,
                instance: instance.subsystem(),
            })
            .collect();
        look(&View {
            t_s: self.t,
            step_index: self.index,
            h_s: self.last_h,
            subsystems: &subsystems,
            gluing: self.report(),
            energy: self.energy(),
        })
    }

    /// Sum over all subsystems, work and heat since t = 0; unknown where one that has energy keeps no ledger.
    pub fn energy(&self) -> Energy {
        let ledgers = self.instances.iter().map(|i| ledger_of(i.kind(), &i.subsystem().energy()));
        standing::since(&self.before, ledgers.fold(Energy::default(), |sum, ledger| sum.plus(&ledger)))
    }

    /// Committed value of a scalar number by full name; `None` where there is no such variable.
    pub fn read(&self, name: &str) -> Option<f64> {
        self.directory.find(name)?.number(&self.instances).ok()
    }

    /// Sets a variable by full name: effective in the next step, logged as an event. Refuses with the reason.
    pub fn set(&mut self, name: &str, value: &Value) -> Result {
        let refused = |reason: String| Error::Simulation {
            time_s: self.t,
            message: format!("cannot set `{name}` = {value}: {reason}"),
        };
        let Some(variable) = self.directory.find(name) else {
            let hint = self.directory.hint(name).map(|h| format!("; {h}"));
            return Err(refused(format!("there is no such variable{}", hint.unwrap_or_default())));
        };
        let was = variable
            .number(&self.instances)
            .map(|x| format!(" (was {})", twelve_digits(x)))
            .unwrap_or_default();
        if let Reply::Refused(reason) = variable.set(&mut self.instances, self.index > 0, value)? {
            return Err(refused(reason));
        }
        self.events.push(Event { t_s: self.t, what: format!("set {name} = {value}{was}") });
        Ok(())
    }

    /// Calls an action `subsystem.action`; logged as an event.
    pub fn act(&mut self, action: &str, arguments: &str) -> Result {
        let (subsystem, name) = action.split_once('.').unwrap_or((action, ""));
        let time_s = self.t;
        let Some(instance) = self.instances.iter_mut().find(|i| i.name() == subsystem) else {
            let message = format!("action `{action}`: there is no subsystem `{subsystem}`");
            return Err(Error::Simulation { time_s, message });
        };
        if let Reply::Refused(reason) = instance.act(name, arguments)? {
            return Err(instance.error("act", format!("`{action}` was refused: {reason}")));
        }
        self.events.push(Event { t_s: self.t, what: format!("act {action}") });
        Ok(())
    }

    /// Ends all subsystems. FMUs are told to terminate and are freed; what goes wrong there is an error too.
    ///
    /// # Errors
    /// What a subsystem did instead of ending.
    pub fn close(self) -> Result {
        let (time_s, teardown_errors) = (self.t, self.teardown_errors.clone());
        drop(self);
        match teardown_errors.take() {
            all if all.is_empty() => Ok(()),
            all => Err(Error::Simulation { time_s, message: all.join("; ") }),
        }
    }

    /// Glues from the next step on as `spec` says; what strategies remember of earlier steps is lost.
    ///
    /// # Errors
    /// [`Error::Simulation`]: the strategy cannot glue these subsystems.
    pub fn set_gluing(&mut self, spec: &terraglue_scenario::GluingSpec) -> Result {
        let specs: Vec<_> = self.groups.iter().map(|g| g.spec(spec)).collect();
        for (group, spec) in self.groups.iter().zip(&specs) {
            if let Some(refusal) = gluing::refusal(spec, &group.problem, &self.instances) {
                return Err(Error::Simulation { time_s: self.t, message: refusal.reason });
            }
        }
        for (group, spec) in self.groups.iter_mut().zip(&specs) {
            group.strategy = gluing::strategy(spec);
        }
        Ok(())
    }

    /// Keeps the committed state of everything under a number.
    pub fn snapshot(&mut self, slot: u32) -> Result<Snapshot> {
        self.instances.iter_mut().try_for_each(|i| i.save_state(slot))?;
        Ok(Snapshot { slot, clock: self.time_kept(), fired: self.time_line.fired(), memory: self.memory() })
    }

    /// Back to a snapshot, exactly.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result {
        self.instances.iter_mut().try_for_each(|i| i.restore_state(snapshot.slot))?;
        self.restore_rest(snapshot)
    }

    /// What a snapshot holds beside the states of the instances.
    fn restore_rest(&mut self, snapshot: &Snapshot) -> Result {
        self.set_time(snapshot.clock);
        self.time_line.set_fired(&snapshot.fired);
        for (group, kept) in self.groups.iter_mut().zip(&snapshot.memory) {
            group.recall(kept);
        }
        let mut others = snapshot.memory.iter().skip(self.groups.len());
        others.next().into_iter().for_each(|kept| self.faults.recall(kept));
        others.next().into_iter().for_each(|kept| self.detector.recall(kept));
        if let (Some(control), Some(kept)) = (&mut self.control, others.next()) {
            control.recall(&mut Recall(kept));
        }
        self.read_states()
    }

    /// What each group, faults, contact detection and the control of the steps keep from step to step.
    fn memory(&self) -> Vec<Vec<u64>> {
        let mut all: Vec<Vec<u64>> = self.groups.iter().map(Group::memory).collect();
        all.push(self.faults.remember());
        all.push(self.detector.remember());
        let mut last = Vec::new();
        self.control.iter().for_each(|c| c.remember(&mut last));
        all.push(last);
        all
    }
}

/// Without the digits that arithmetic leaves: 0.3 and not 0.30000000000000004.
fn twelve_digits(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}
