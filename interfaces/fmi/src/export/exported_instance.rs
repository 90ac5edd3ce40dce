//! An instance of an exported FMU as both standards see it: phases, time, values, steps, states, log.

use super::states::{Handle, Moment, States};
use super::values::{self, FmiType};
use super::{Answer, Layout, Status, Wrong, wrong};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use terraglue_subsystem::{
    Capabilities, Causality, Effect, Error, Input, LogLevel, Motion, Response, Step, Subsystem, ValueType,
    Variable, flag,
};

/// Arguments of a new instance.
#[derive(Clone)]
pub struct Opening {
    /// Name that the master gave it.
    pub name: String,
    /// Folder of the FMU's resources.
    pub resources: PathBuf,
    /// Takes lines for the master's log, from any thread.
    pub log: Mailbox,
}

/// An instance at its start.
pub struct Opened {
    /// Subsystem that is stepped.
    pub subsystem: Box<dyn Subsystem>,
    /// Value references.
    pub layout: Layout,
    /// Token (FMI 3.0) or GUID (FMI 2.0) of the description that belongs to it.
    pub token: String,
    /// Numbered states that the subsystem keeps.
    pub slots: u32,
    /// Whether outputs of the start need a step of h = 0.
    pub settles: bool,
    /// Joints, for their terminals.
    pub joints: Vec<super::JointTerminal>,
}

/// Makes the subsystem of an FMU from its resources; on failure the reason.
pub type Open = fn(&Opening) -> Result<Opened, String>;

/// Lines on their way to the master. They are handed over when a call returns, on the thread of the caller.
#[derive(Clone, Debug, Default)]
pub struct Mailbox(Arc<Mutex<Vec<(LogLevel, String)>>>);

/// Most lines that wait for one call to return.
const WAITING: usize = 256;

impl Mailbox {
    /// Puts a line in; a flood loses its later lines.
    pub fn put(&self, level: LogLevel, text: &str) {
        let mut lines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() < WAITING {
            lines.push((level, text.to_owned()));
        }
    }

    /// Takes all lines out.
    pub fn take(&self) -> Vec<(LogLevel, String)> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Phase of an instance's life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Made; start values and parameters may be set.
    Instantiated,
    /// Between entering and leaving the initialisation.
    Initialization,
    /// Between steps.
    Running,
    /// A step failed: values and states can be looked at, earlier states restored.
    Failed,
    /// The run is over.
    Terminated,
    /// Nothing works any more.
    Dead,
}

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Time up to which the step was done, s.
    pub time: f64,
    /// Whether all of it was done.
    pub complete: bool,
    /// Whether the FMU asks for the end of the run.
    pub terminate: bool,
}

/// An instance of an FMU.
pub struct ExportedInstance {
    open: Open,
    opening: Opening,
    subsystem: Box<dyn Subsystem>,
    layout: Layout,
    token: String,
    slots: u32,
    settles: bool,
    phase: Phase,
    time: f64,
    stop: Option<f64>,
    index: u64,
    reached: Reached,
    states: States,
}

static INSTANCES: AtomicUsize = AtomicUsize::new(1);

/// Parts into which a subsystem may divide a step at most.
const PARTS: u32 = 10_000;

impl ExportedInstance {
    /// Makes an instance.
    ///
    /// # Errors
    /// Why the subsystem cannot be made, or that `token` belongs to another FMU.
    pub fn new(open: Open, name: &str, resources: &Path, token: Option<&str>) -> Result<Self, String> {
        let opening = Opening { name: name.into(), resources: resources.into(), log: Mailbox::default() };
        let opened = open(&opening)?;
        if let Some(given) = token.filter(|t| *t != opened.token) {
            return Err(format!("the token `{given}` is not that of this FMU, `{}`", opened.token));
        }
        let id = INSTANCES.fetch_add(1, Ordering::Relaxed);
        Ok(Self {
            open,
            opening,
            subsystem: opened.subsystem,
            layout: opened.layout,
            token: opened.token,
            states: States::new(id, opened.slots),
            slots: opened.slots,
            settles: opened.settles,
            phase: Phase::Instantiated,
            time: 0.0,
            stop: None,
            index: 0,
            reached: Reached { time: 0.0, complete: true, terminate: false },
        })
    }

    /// Where it stands.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// How the last step ended.
    pub fn reached(&self) -> Reached {
        self.reached
    }

    /// Lines for the master's log.
    pub fn mailbox(&self) -> &Mailbox {
        &self.opening.log
    }

    /// Nothing works any more.
    pub fn kill(&mut self) {
        self.phase = Phase::Dead;
    }

    /// Whether a function may be called now.
    ///
    /// # Errors
    /// [`Wrong`]: the function may not be called in this phase.
    pub fn expect(&self, function: &str, phases: &[Phase]) -> Answer {
        if phases.contains(&self.phase) {
            return Ok(());
        }
        let now = match self.phase {
            Phase::Instantiated => "before the initialisation",
            Phase::Initialization => "during the initialisation",
            Phase::Running => "after the initialisation",
            Phase::Failed => "after a failed step",
            Phase::Terminated => "after the end",
            Phase::Dead => "after a fatal error",
        };
        wrong(format!("{function} may not be called {now}"))
    }

    /// Says when the run begins and ends, s.
    ///
    /// # Errors
    /// [`Wrong`]: the run has begun, or its times make no sense.
    pub fn set_experiment(&mut self, start: f64, stop: Option<f64>) -> Answer {
        self.expect("setting up the experiment", &[Phase::Instantiated])?;
        if !start.is_finite() || stop.is_some_and(|s| s.is_nan() || s < start) {
            return wrong(format!("a run from {start} s to {} s makes no sense", stop.unwrap_or(f64::NAN)));
        }
        (self.time, self.stop, self.index) = (start, stop, 0);
        self.reached = Reached { time: start, complete: true, terminate: false };
        Ok(())
    }

    /// Begins the initialisation.
    ///
    /// # Errors
    /// [`Wrong`]: it was entered before.
    pub fn enter_initialization(&mut self) -> Answer {
        self.expect("entering the initialisation", &[Phase::Instantiated])?;
        self.phase = Phase::Initialization;
        Ok(())
    }

    /// Ends the initialisation; outputs are those of the start.
    ///
    /// # Errors
    /// [`Wrong`]: the initialisation has not begun, or the subsystem failed.
    pub fn exit_initialization(&mut self) -> Answer {
        self.expect("leaving the initialisation", &[Phase::Initialization])?;
        if self.settles {
            self.part(0.0).map_err(|e| self.failed(e))?;
        }
        self.phase = Phase::Running;
        Ok(())
    }

    /// Ends the run.
    ///
    /// # Errors
    /// [`Wrong`]: there is no run to end.
    pub fn terminate(&mut self) -> Answer {
        self.expect("terminating", &[Phase::Running, Phase::Failed])?;
        self.phase = Phase::Terminated;
        Ok(())
    }

    /// Back to where it was made: all values, states and the time are forgotten.
    ///
    /// # Errors
    /// [`Wrong`]: the instance is dead, or the subsystem cannot be made again.
    pub fn reset(&mut self) -> Answer {
        self.expect(
            "resetting",
            &[Phase::Instantiated, Phase::Initialization, Phase::Running, Phase::Failed, Phase::Terminated],
        )?;
        let opened = (self.open)(&self.opening).map_err(|text| Wrong { status: Status::Error, text })?;
        self.subsystem = opened.subsystem;
        self.states = States::new(INSTANCES.fetch_add(1, Ordering::Relaxed), self.slots);
        (self.phase, self.time, self.index, self.stop) = (Phase::Instantiated, 0.0, 0, None);
        self.reached = Reached { time: 0.0, complete: true, terminate: false };
        Ok(())
    }

    /// Reads the values of variables of one of these types.
    ///
    /// # Errors
    /// [`Wrong`]: an unknown reference, a variable of another type, or a call in the wrong phase.
    pub fn get<T: FmiType>(&self, references: &[u32], types: &[ValueType], out: &mut [T]) -> Answer {
        let readable = [Phase::Initialization, Phase::Running, Phase::Failed, Phase::Terminated];
        self.expect("getting values", &readable)?;
        values::read(self.subsystem.as_ref(), &self.layout, references, types, out)
    }

    /// Sets the values of variables of one of these types.
    ///
    /// # Errors
    /// [`Wrong`]: an unknown reference, a variable of another type or that cannot be set now, or a value that is refused.
    pub fn set<T: FmiType>(&mut self, references: &[u32], types: &[ValueType], values: &[T]) -> Answer {
        self.expect("setting values", &[Phase::Instantiated, Phase::Initialization, Phase::Running])?;
        let running = self.phase == Phase::Running;
        let may = |v: &Variable| may_set(v, running);
        values::write(self.subsystem.as_mut(), &self.layout, references, types, values, may)
    }

    /// Number of elements behind a value reference.
    pub fn len(&self, reference: u32) -> Option<usize> {
        let entry = self.layout.entry(reference)?;
        Some(if entry.element.is_some() { 1 } else { self.subsystem.variables()[entry.variable].len() })
    }

    /// Steps from `t` by `h` (s). A subsystem that cannot do all of it at once does it in parts.
    ///
    /// # Errors
    /// [`Wrong`]: the step does not begin where the FMU is, has no length, passes the end of the run, or the subsystem failed.
    pub fn step(&mut self, t: f64, h: f64) -> Answer<Reached> {
        self.expect("a step", &[Phase::Running])?;
        let slack = 1e-9 * h.abs().max(self.time.abs());
        if !((t - self.time).abs() <= slack) {
            return wrong(format!("the step begins at t = {t} s, but the FMU stands at t = {} s", self.time));
        }
        if !(h.is_finite() && h > 0.0) {
            return wrong(format!("a step of {h} s cannot be made"));
        }
        let end = t + h;
        if let Some(stop) = self.stop.filter(|stop| end > stop + 1e-6 * h.max(slack)) {
            return wrong(format!("the step ends at t = {end} s, after the end of the run at t = {stop} s"));
        }
        self.reached = Reached { time: self.time, complete: false, terminate: false };
        let done = self.parts(end, h);
        self.reached.time = self.time;
        done.map_err(|e| self.failed(e))?;
        Ok(self.reached)
    }

    fn parts(&mut self, end: f64, h: f64) -> terraglue_subsystem::Result {
        let mut part = h;
        for _ in 0..PARTS {
            let left = end - self.time;
            let whole = part >= left * (1.0 - 1e-9);
            let before = self.time;
            match self.part(if whole { left } else { part }) {
                Ok((reached, flags)) => {
                    let done = whole && reached >= end - 1e-9 * h;
                    self.time = if done { end } else { reached };
                    self.index += 1;
                    self.reached.terminate = flags & flag::TERMINATE != 0;
                    if done || self.reached.terminate {
                        self.reached.complete = done;
                        return Ok(());
                    }
                    part = end - self.time;
                }
                Err(Error::Discard { reached }) if reached > before && reached < end => {
                    part = reached - before;
                }
                Err(error) => return Err(error),
            }
        }
        Err(Error::Discard { reached: self.time })
    }

    /// One trial and its commit; the time reached and the flags.
    fn part(&mut self, h: f64) -> terraglue_subsystem::Result<(f64, u32)> {
        let step = Step::free(self.time, h, self.index);
        let none = Input::Force { t: &[], motion: None };
        let end = self.time + h;
        let mut out = Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: end, flags: 0 };
        self.subsystem.advance(&step, &none, &mut out)?;
        let (reached, flags) = (out.reached, out.flags);
        if !(reached >= self.time && reached <= end) {
            return Err(Error::Failed(format!("the step from {} s ended at {reached} s", self.time)));
        }
        let still = Motion { x: &[], v: &[] };
        self.subsystem.commit(&Step::free(self.time, reached - self.time, self.index), &[], &still)?;
        Ok((reached, flags))
    }

    fn failed(&mut self, error: Error) -> Wrong {
        let time = self.time;
        let answer = Wrong::from(error);
        self.phase = match answer.status {
            Status::Fatal => Phase::Dead,
            Status::Discard => self.phase,
            _ => Phase::Failed,
        };
        Wrong { text: format!("at t = {time} s: {}", answer.text), ..answer }
    }

    fn can(&self, what: Capabilities, name: &str) -> Answer {
        if self.subsystem.capabilities().has(what) {
            Ok(())
        } else {
            wrong(format!("this FMU cannot {name}"))
        }
    }

    fn saving(&self) -> Answer {
        let any =
            [Phase::Instantiated, Phase::Initialization, Phase::Running, Phase::Failed, Phase::Terminated];
        self.expect("saving or restoring a state", &any)?;
        self.can(Capabilities::STATE, "save its state")
    }

    fn moment(&self) -> Moment {
        Moment { time: self.time, index: self.index, phase: self.phase }
    }

    fn go_to(&mut self, moment: Moment) {
        (self.time, self.index, self.phase) = (moment.time, moment.index, moment.phase);
        self.reached = Reached { time: moment.time, complete: true, terminate: false };
    }

    /// Saves the state; over an earlier one where `over` is given.
    ///
    /// # Errors
    /// [`Wrong`]: the subsystem cannot save its state, or no slot is free.
    pub fn save(&mut self, over: Option<Handle>) -> Answer<Handle> {
        self.saving()?;
        let slot = match over {
            Some(handle) => self.states.find(handle)?.0,
            None => self.states.free_slot()?,
        };
        self.subsystem.save_state(slot)?;
        Ok(self.states.keep(slot, self.moment()))
    }

    /// Back to a saved state, exactly.
    ///
    /// # Errors
    /// [`Wrong`]: the handle is no state of this instance.
    pub fn restore(&mut self, handle: Handle) -> Answer {
        self.saving()?;
        let (slot, moment) = self.states.find(handle)?;
        self.subsystem.restore_state(slot)?;
        self.go_to(moment);
        Ok(())
    }

    /// Forgets a saved state.
    ///
    /// # Errors
    /// [`Wrong`]: the handle is no state of this instance.
    pub fn release(&mut self, handle: Handle) -> Answer {
        self.states.release(handle)
    }

    /// A saved state as bytes for another instance of the same FMU.
    ///
    /// # Errors
    /// [`Wrong`]: the subsystem cannot give its state as bytes, or the handle is no state of this instance.
    pub fn serialize(&mut self, handle: Handle) -> Answer<Vec<u8>> {
        self.saving()?;
        self.can(Capabilities::SERIALIZE, "serialise its state")?;
        let (slot, moment) = self.states.find(handle)?;
        let spare = self.states.spare();
        self.subsystem.save_state(spare)?;
        self.subsystem.restore_state(slot)?;
        let bytes = self.subsystem.serialize();
        self.subsystem.restore_state(spare)?;
        Ok(with_header(&self.token, moment, &bytes?))
    }

    /// A saved state from bytes that [`ExportedInstance::serialize`] made.
    ///
    /// # Errors
    /// [`Wrong`]: the bytes are no state of this FMU, or no slot is free.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Answer<Handle> {
        self.saving()?;
        self.can(Capabilities::SERIALIZE, "serialise its state")?;
        let Some((moment, body)) = without_header(&self.token, bytes) else {
            return wrong("these bytes are no state of this FMU");
        };
        let (slot, spare) = (self.states.free_slot()?, self.states.spare());
        self.subsystem.save_state(spare)?;
        let taken = self.subsystem.deserialize(body).and_then(|()| self.subsystem.save_state(slot));
        self.subsystem.restore_state(spare)?;
        taken?;
        Ok(self.states.keep(slot, moment))
    }
}

fn may_set(v: &Variable, running: bool) -> Answer {
    match (v.causality, v.effect) {
        (_, Effect::NeedsReset) if running => {
            wrong(format!("`{}` can be set before the first step only", v.name))
        }
        (Causality::Output | Causality::Local, Effect::NeedsReset) => Ok(()),
        (Causality::Output | Causality::Local, _) | (_, Effect::ReadOnly) => {
            wrong(format!("`{}` can only be read", v.name))
        }
        _ => Ok(()),
    }
}

const MAGIC: &[u8; 8] = b"TGSTATE1";

/// Magic, length and bytes of the token, time, index, phase; then the subsystem's own bytes.
fn with_header(token: &str, moment: Moment, bytes: &[u8]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    out.extend((token.len() as u32).to_le_bytes());
    out.extend(token.as_bytes());
    out.extend(moment.time.to_le_bytes());
    out.extend(moment.index.to_le_bytes());
    out.push(moment.phase as u8);
    out.extend(bytes);
    out
}

fn without_header<'a>(token: &str, bytes: &'a [u8]) -> Option<(Moment, &'a [u8])> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (length, rest) = rest.split_first_chunk::<4>()?;
    if u32::from_le_bytes(*length) as usize != token.len() {
        return None;
    }
    let rest = rest.strip_prefix(token.as_bytes())?;
    let (time, rest) = rest.split_first_chunk::<8>()?;
    let (index, rest) = rest.split_first_chunk::<8>()?;
    let (phase, rest) = rest.split_first()?;
    let phase = match phase {
        0 => Phase::Instantiated,
        1 => Phase::Initialization,
        2 => Phase::Running,
        3 => Phase::Failed,
        4 => Phase::Terminated,
        _ => return None,
    };
    let time = f64::from_le_bytes(*time);
    time.is_finite().then_some((Moment { time, index: u64::from_le_bytes(*index), phase }, rest))
}
