//! The step loop. The paper's five steps can be read by name in `testbed/glued.rs` and in [`terraglue_gluing`].
//!
//! Order of a communication step, all subsystems: (1) events and `set`; (2) outputs of t become inputs;
//! (3) a trial of every subsystem without glue; (4) the group of glued subsystems by its strategy;
//! (5) commit of all, in the order of their names; then those that see look at the committed world. Reads see committed values only.

use crate::observer::{Event, Observer, SubsystemView, View, ledger_of};
use crate::signals::{Moment, Signals};
use serde_json::Value;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;
use terraglue_diagnostics::{Error, Result};
use terraglue_gluing::timing::{Part, Timings};
use terraglue_gluing::{Outcome, StepReport};
use terraglue_host::{Instance, Reply, TeardownErrors};
use terraglue_subsystem::Energy;

mod build;
mod checks;
mod declared_glue;
mod explain;
mod glued;
mod group;
mod hosted;
mod loop_values;
mod loops;
mod newton;
mod pieces;
mod reload;
mod run_clock;
mod schedule;
mod shown;
mod sight;
mod standing;
mod step_order;
mod streams;
mod subsystems;
mod uncoupled;

pub use build::{find, make, services, with_law};
pub use explain::{ConnectionNote, Explanation};
use glued::GluedGroups;
use run_clock::RunClock;
use sight::Sight;
use streams::Streams;
use subsystems::Subsystems;
use uncoupled::Uncoupled;

/// Options of a run beside its scenario.
///
/// ```
/// use std::sync::atomic::Ordering;
/// use terraglue_engine::Options;
///
/// let options = Options { threads: 2, ..Options::default() };
/// let from_outside = options.cancel.clone();
/// from_outside.store(true, Ordering::Relaxed);
/// assert!(options.cancel.load(Ordering::Relaxed));
/// ```
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

/// A simulation of a whole mission. Several live side by side; there are no globals.
///
/// ```
/// use terraglue_engine::{Options, Testbed};
/// use terraglue_host::Library;
/// use terraglue_scenario::Scenario;
/// # use std::sync::Arc;
/// # use terraglue_subsystem::*;
/// # struct Heater { watts: f64, joules: f64, trial: f64, variables: Vec<Variable> }
/// # impl Module for Heater {
/// #     fn schema() -> Schema {
/// #         Schema { name: "heater".into(), kind: Kind::Controller, help: "Heats".into(), parameters: Vec::new() }
/// #     }
/// #     fn instantiate(_: &Config, _: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
/// #         let power = Variable::real(0, "power", "W", Causality::Input, "Power");
/// #         let energy = Variable::real(1, "energy", "J", Causality::Output, "Energy so far");
/// #         Ok(Box::new(Self { watts: 0.0, joules: 0.0, trial: 0.0, variables: vec![power, energy] }))
/// #     }
/// # }
/// # impl Subsystem for Heater {
/// #     fn capabilities(&self) -> Capabilities { Capabilities::RETRY }
/// #     fn variables(&self) -> &[Variable] { &self.variables }
/// #     fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
/// #         let ValuesMut::F64(out) = out else { return Err(Error::Unsupported) };
/// #         for (id, out) in ids.iter().zip(out) { *out = [self.watts, self.joules][*id as usize]; }
/// #         Ok(())
/// #     }
/// #     fn set(&mut self, _: &[u32], values: Values) -> Result {
/// #         let Values::F64(values) = values else { return Err(Error::Unsupported) };
/// #         self.watts = values[0];
/// #         Ok(())
/// #     }
/// #     fn advance(&mut self, step: &Step, _: &Input, _: &mut Response) -> Result {
/// #         self.trial = self.joules + step.h * self.watts;
/// #         Ok(())
/// #     }
/// #     fn commit(&mut self, _: &Step, _: &[f64], _: &Motion) -> Result {
/// #         self.joules = self.trial;
/// #         Ok(())
/// #     }
/// # }
///
/// // a scenario with one subsystem, whose module `Heater` is linked into the program
/// let text = "[time]\nstep_s = 0.1\nduration_s = 1.0\n[plate]\nmodule = \"heater\"\n";
/// let scenario = Scenario::parse(text, "plate.toml", &[])?;
/// let library = Library::new().with::<Heater>();
/// let mut testbed = Testbed::build_with(&scenario, &Options::default(), &library)?;
/// testbed.set("plate.power", &50.0.into())?;
/// testbed.run_until(1.0, &mut [])?;
/// assert!(testbed.read("plate.energy").is_some_and(|e| (e - 50.0).abs() < 1e-9));
/// assert_eq!((testbed.step_index(), testbed.read("plate.colour")), (10, None));
/// # Ok::<(), terraglue_diagnostics::Error>(())
/// ```
pub struct Testbed {
    subsystems: Subsystems,
    glued: GluedGroups,
    uncoupled: Uncoupled,
    signals: Signals,
    sight: Sight,
    streams: Streams,
    clock: RunClock,
    /// Whether steps may be cut so that one ends at the time of an event.
    exact: bool,
    events: Vec<Event>,
    /// Gluing of the last nominal step, all groups and parts.
    report: StepReport,
    timings: Timings,
    cancel: Arc<AtomicBool>,
    standing: Arc<AtomicU64>,
    teardown_errors: TeardownErrors,
    last_h: f64,
    /// Time before t = 0 in which bodies come to rest on the ground, s.
    settle_s: f64,
    halvings: u32,
    max_halvings: u32,
}

/// State of a testbed; see [`Testbed::snapshot`].
#[derive(Clone, Debug)]
pub struct Snapshot {
    slot: u32,
    clock: RunClock,
    fired: Vec<bool>,
    /// Memory of each group, signals, contact detection, the control of the steps and streams from step to step.
    memory: Vec<Vec<u64>>,
}

impl Testbed {
    /// Simulated time, s.
    pub fn t_s(&self) -> f64 {
        self.clock.t
    }

    /// Communication steps done so far.
    pub fn step_index(&self) -> u64 {
        self.clock.index
    }

    /// Connections, events and faults, and all variables by full name.
    pub fn signals(&self) -> &Signals {
        &self.signals
    }

    /// All instances in the order of their names.
    pub fn instances(&self) -> &[Instance] {
        &self.subsystems.instances
    }

    /// Report of the gluing in the last step.
    pub fn report(&self) -> &StepReport {
        &self.report
    }

    /// Goes to the next nominal communication point t + h.
    ///
    /// # Errors
    /// [`Error::NotConverged`]: a strategy found no solution, though the step was halved as often as allowed.
    /// [`Error::Module`] or [`Error::Simulation`]: what a module or an event ran into.
    pub fn step(&mut self) -> Result {
        self.begin()?;
        let end = self.clock.end();
        let mut longest = self.clock.step_s;
        self.halvings = 0;
        self.report.clear();
        self.report.converged = true;
        self.streams.clear();
        let mut repeated = false;
        while self.clock.is_before(end) {
            let (start, times) = uncoupled::watch(&self.clock, !self.glued.groups.is_empty());
            self.apply_events()?;
            self.transfer_signals(time_left(self, end).min(longest), repeated)?;
            self.timings.charge_sample(Part::Signals, start, times);
            let left = time_left(self, end);
            let h_now = self.glued.next_length((longest, left), &self.clock, &mut self.subsystems)?;
            match self.communication_step(h_now, end)? {
                Outcome::Converged => {
                    self.clock.advance(h_now);
                    self.glued.account(&mut self.report);
                    repeated = false;
                }
                Outcome::NotConverged(why) if self.halvings == self.max_halvings => {
                    self.glued.account(&mut self.report);
                    return Err(self.glued.gave_up(self.clock.t, self.max_halvings, &why));
                }
                Outcome::NotConverged(_) => {
                    self.glued.groups.iter().for_each(|g| self.report.add_cost(&g.problem.report));
                    self.halvings += 1;
                    longest = 0.5 * h_now;
                    repeated = true;
                }
            }
        }
        self.clock.nominal += 1;
        self.clock.t = end;
        self.last_h = self.clock.step_s;
        Ok(())
    }

    /// (1) Events of the time line at this communication point.
    fn apply_events(&mut self) -> Result {
        let (t, h) = (self.clock.t, self.clock.step_s);
        while let Some(due) = self.signals.time_line.next_due(t, h, &self.subsystems.instances) {
            for (name, value) in &due.set {
                self.set(name, value)?;
            }
            for action in &due.act {
                self.act(action, "{}")?;
            }
        }
        Ok(())
    }

    /// (2) Outputs of t become inputs of the step of length h; `repeated`: of one that was discarded with a greater length.
    fn transfer_signals(&mut self, h: f64, repeated: bool) -> Result {
        if self.clock.index == 0 && self.clock.t == 0.0 && !repeated {
            standing::end_initialization(&mut self.clock, &mut self.signals, &mut self.subsystems)?;
        }
        let instances = &mut self.subsystems.instances;
        let (t_s, events) = (self.clock.t, &mut self.events);
        let moment = Moment { t: t_s, h, nominal: self.clock.nominal };
        if repeated {
            return self.signals.transfer_again(moment, instances);
        }
        self.signals.transfer(moment, self.clock.step_s, instances, |(label, begins)| {
            let what = format!("fault {}: {label}", if begins { "begins" } else { "ends" });
            events.push(Event { t_s, what });
        })
    }

    /// (3) to (5) for one step of length h; nothing is committed unless it converged.
    fn communication_step(&mut self, h: f64, end: f64) -> Result<Outcome> {
        let (start, times) = uncoupled::watch(&self.clock, !self.glued.groups.is_empty());
        let early =
            self.uncoupled.advance(&self.clock, (h, end), &mut self.signals.links, &mut self.subsystems)?;
        if let Some(why) = early {
            self.glued.failed = None;
            return Ok(Outcome::NotConverged(why));
        }
        self.timings.charge_sample(Part::Uncoupled, start, times);
        let of_step = (h, self.halvings);
        let outcome = self.glued.step(of_step, &self.clock, &mut self.subsystems, &mut self.timings)?;
        if outcome == Outcome::Converged {
            self.sight.before_commit(&self.subsystems);
            uncoupled::commit(&self.clock, (h, end), &mut self.subsystems)?;
            self.subsystems.read_states()?;
            self.sight.after_commit(&self.clock, (h, end), &mut self.subsystems, &mut self.timings)?;
            self.streams.collect(&self.subsystems.instances, |stream, bytes| {
                self.signals.links.feed(stream, bytes)
            })?;
        } else {
            self.uncoupled.discard(&mut self.signals.links, &mut self.subsystems)?;
        }
        Ok(outcome)
    }

    /// Steps until `until_s`, an error, or the cancel flag; notifies the observers. The observers' `finished` is
    /// left to the caller, who knows whether the run goes on.
    ///
    /// # Errors
    /// Errors of [`Testbed::step`] or of an observer.
    pub fn run_until(&mut self, until_s: f64, observers: &mut [&mut dyn Observer]) -> Result {
        while self.clock.is_before(until_s) && !self.cancelled() {
            let stepped = self.step();
            let start = Instant::now();
            for event in self.events.drain(..) {
                for observer in observers.iter_mut() {
                    observer.event(&event)?;
                }
            }
            stepped?;
            self.view(|view| observers.iter_mut().try_for_each(|o| o.stepped(view)))?;
            self.timings.charge(Part::Observers, start);
        }
        Ok(())
    }

    /// Times of the parts of all steps.
    pub fn timings(&self) -> Timings {
        let mut sum = self.timings.clone();
        self.glued.groups.iter().for_each(|g| sum.add(&g.problem.timings));
        sum
    }

    /// Cost of the steps of each subsystem so far, s of wall time. Without glue: the steps that were watched, times the
    /// steps that each represents; with glue: all calls in a step.
    pub fn costs(&self) -> impl Iterator<Item = (&str, f64)> {
        let cost = |slot| self.subsystems.cost(slot).as_secs_f64();
        self.instances().iter().enumerate().map(move |(slot, i)| (i.name(), cost(slot)))
    }

    /// Whether somebody asked to stop.
    pub fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// Shows the committed state.
    pub fn view<R>(&self, look: impl FnOnce(&View) -> R) -> R {
        let Subsystems { instances, members, .. } = &self.subsystems;
        let subsystems: Vec<SubsystemView> = instances
            .iter()
            .zip(members)
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
            t_s: self.clock.t,
            step_index: self.clock.index,
            h_s: self.last_h,
            subsystems: &subsystems,
            gluing: self.report(),
            energy: self.energy(),
            streams: self.streams.views(),
        })
    }

    /// Sum over all subsystems, work and heat since t = 0; unknown where one that has energy keeps no ledger.
    pub fn energy(&self) -> Energy {
        let ledgers = self.instances().iter().map(|i| ledger_of(i.kind(), &i.subsystem().energy()));
        standing::since(&self.clock.before, ledgers.fold(Energy::default(), |sum, ledger| sum.plus(&ledger)))
    }

    /// Committed value of a scalar number by full name; `None` where there is no such variable.
    pub fn read(&self, name: &str) -> Option<f64> {
        self.signals.directory.find(name)?.number(self.instances()).ok()
    }

    /// Sets a variable by full name: effective in the next step, logged as an event. Refuses with the reason.
    ///
    /// # Errors
    /// [`Error::Simulation`]: there is no such variable, or the value is not accepted. [`Error::Module`]: the module failed.
    pub fn set(&mut self, name: &str, value: &Value) -> Result {
        let (time_s, started) = (self.clock.t, self.clock.index > 0);
        let refused = |reason: String| Error::Simulation {
            time_s,
            message: format!("cannot set `{name}` = {value}: {reason}"),
        };
        let Some(variable) = self.signals.directory.find(name) else {
            let hint = self.signals.directory.hint(name).map(|h| format!("; {h}"));
            return Err(refused(format!("there is no such variable{}", hint.unwrap_or_default())));
        };
        let was = variable
            .number(self.instances())
            .map(|x| format!(" (was {})", twelve_digits(x)))
            .unwrap_or_default();
        if let Reply::Refused(reason) = variable.set(&mut self.subsystems.instances, started, value)? {
            return Err(refused(reason));
        }
        self.events.push(Event { t_s: time_s, what: format!("set {name} = {value}{was}") });
        Ok(())
    }

    /// Calls an action `subsystem.action`; logged as an event.
    ///
    /// # Errors
    /// [`Error::Simulation`]: there is no such subsystem. [`Error::Module`]: the action is refused or failed.
    pub fn act(&mut self, action: &str, arguments: &str) -> Result {
        let (subsystem, name) = action.split_once('.').unwrap_or((action, ""));
        let time_s = self.clock.t;
        let Some(instance) = self.subsystems.instances.iter_mut().find(|i| i.name() == subsystem) else {
            let message = format!("action `{action}`: there is no subsystem `{subsystem}`");
            return Err(Error::Simulation { time_s, message });
        };
        if let Reply::Refused(reason) = instance.act(name, arguments)? {
            return Err(instance.error("act", format!("`{action}` was refused: {reason}")));
        }
        self.events.push(Event { t_s: time_s, what: format!("act {action}") });
        Ok(())
    }

    /// Ends all subsystems. FMUs are terminated and freed; a failure there is an error too.
    ///
    /// # Errors
    /// Error of a subsystem at its end.
    pub fn close(self) -> Result {
        let (time_s, teardown_errors) = (self.clock.t, self.teardown_errors.clone());
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
        self.glued.set_strategies(spec, self.clock.t, &self.subsystems)
    }

    /// Keeps the committed state of everything under a number.
    ///
    /// # Errors
    /// [`Error::Module`]: a module that cannot keep its state.
    pub fn snapshot(&mut self, slot: u32) -> Result<Snapshot> {
        self.subsystems.instances.iter_mut().try_for_each(|i| i.save_state(slot))?;
        let memory = self.glued.memory(self.signals.remember(), self.streams.remember());
        Ok(Snapshot { slot, clock: self.clock, fired: self.signals.time_line.fired(), memory })
    }

    /// Back to a snapshot, exactly.
    ///
    /// # Errors
    /// [`Error::Module`]: a module that cannot go back.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result {
        self.subsystems.instances.iter_mut().try_for_each(|i| i.restore_state(snapshot.slot))?;
        restore_rest(self, snapshot)
    }
}

/// Restores the content of a snapshot beside the states of the instances.
fn restore_rest(testbed: &mut Testbed, snapshot: &Snapshot) -> Result {
    testbed.clock = snapshot.clock;
    testbed.signals.time_line.set_fired(&snapshot.fired);
    let [mut signals, mut streams] = testbed.glued.recall(&snapshot.memory);
    testbed.signals.recall(&mut signals);
    testbed.streams.recall(&mut streams);
    testbed.subsystems.read_states()
}

/// Without the digits that arithmetic leaves: 0.3 and not 0.30000000000000004.
fn twelve_digits(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

/// Time to the next event or the end of the step, s.
fn time_left(testbed: &Testbed, end: f64) -> f64 {
    let clock = &testbed.clock;
    let next = if testbed.exact { testbed.signals.next_time(clock.t) } else { f64::INFINITY };
    clock.stop(next, end) - clock.t
}
