//! `doStep`, events between steps, and the answers of both.

use super::foreign::{CallStatus, goes_on};
use super::functions::{Api, Three};
use super::{FmuInstance, InstancePhase};
use crate::error::{Error, Result};
use crate::floating_point::Mode;
use std::ffi::c_int;

const DO_STEP_2: &str = "fmi2DoStep";
const DO_STEP_3: &str = "fmi3DoStep";
/// `fmi2LastSuccessfulTime` of `fmi2StatusKind`.
const LAST_SUCCESSFUL_TIME: c_int = 2;
/// `fmi2Terminated` of `fmi2StatusKind`.
const TERMINATED: c_int = 3;
/// Largest time past the end of a step that an FMU without `fixedInternalStepSize` may report, as a share of the step.
const PAST: f64 = 1e-3;
/// Value of `lastSuccessfulTime` before a step: a NaN of its own shows whether the FMU writes it at all.
const UNTOLD: f64 = f64::from_bits(0x7ff8_756e_746f_6c64);
/// Rounds of discrete updates at one time before an FMU is taken to loop for ever.
const ROUNDS: u32 = 1000;
/// Early returns in one step before an FMU is taken to go on for ever.
const RETURNS: u32 = 100_000;

/// A communication step to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Advance {
    /// Start, s.
    pub t: f64,
    /// Length, s.
    pub h: f64,
    /// Whether no state from before `t` is ever set again. Going back to `t` itself, to repeat this step, is no such thing.
    pub for_good: bool,
}

/// How a communication step ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepped {
    /// Time reached, s.
    pub reached: f64,
    /// Whether the FMU asks for the end of the simulation.
    pub terminate: bool,
    /// Events that were handled.
    pub events: u32,
}

/// Where a part of a step has ended.
enum PartEnd {
    /// At the requested time.
    Stop,
    /// Before it, where the FMU goes on.
    Before,
    /// At a time that no step ends at.
    Wrong,
}

/// How a part of a step ended (FMI 3).
struct StepPart {
    event: bool,
    terminate: bool,
    /// Time reached by its own account, s.
    last: f64,
    /// Whether that is the end of the part.
    at_stop: bool,
}

#[cold]
fn too_soon() -> Error {
    Error::Refused("doStep before the end of the initialisation".into())
}

impl FmuInstance {
    /// Goes from t to t + h.
    ///
    /// # Errors
    /// [`Error::Discard`] where the FMU could not go so far; it is then at `reached` and cannot be stepped on
    /// before a state is restored.
    #[inline(always)]
    pub fn do_step(&mut self, step: Advance) -> Result<Stepped> {
        if self.phase != InstancePhase::Stepping {
            return Err(too_soon());
        }
        let Api::Two(two) = &self.foreign.api else { return self.do_step_3(step) };
        let for_good = c_int::from(step.for_good);
        let mode = Mode::now();
        // SAFETY: the arguments are those of the standard.
        self.foreign.trace(format_args!("from {:?} s by {:?} s", step.t, step.h));
        let status =
            self.foreign.status(DO_STEP_2, two.do_step, |f, c| unsafe { f(c, step.t, step.h, for_good) });
        if mode.restore() {
            mode_changed(self, DO_STEP_2);
        }
        match status? {
            status if goes_on(status) => {
                Ok(Stepped { reached: step.t + step.h, terminate: false, events: 0 })
            }
            status => self.stopped_2(step, status),
        }
    }

    /// How far an FMU of FMI 2.0 came that did not make its step.
    #[cold]
    fn stopped_2(&self, step: Advance, status: CallStatus) -> Result<Stepped> {
        const NAME: &str = DO_STEP_2;
        let Api::Two(two) = self.foreign.api else { return Err(Error::Refused(NAME.into())) };
        let end = step.t + step.h;
        if status != CallStatus::Discard {
            return Err(self.foreign.failed(NAME, status));
        }
        let log = self.foreign.log.last();
        let mut reached = f64::NAN;
        // SAFETY: the arguments are those of the standard, here and below.
        let answer = self.foreign.status("fmi2GetRealStatus", two.get_real_status, |f, c| unsafe {
            f(c, LAST_SUCCESSFUL_TIME, &raw mut reached)
        });
        let reached = match answer {
            Ok(s) if goes_on(s) && reached >= step.t && reached <= end => reached,
            _ => step.t,
        };
        let mut terminated = 0;
        let answer = self.foreign.status("fmi2GetBooleanStatus", two.get_boolean_status, |f, c| unsafe {
            f(c, TERMINATED, &raw mut terminated)
        });
        if answer.is_ok_and(goes_on) && terminated != 0 {
            return Ok(Stepped { reached, terminate: true, events: 0 });
        }
        Err(Error::Discard { function: NAME, reached, log })
    }

    /// Goes from t to t + h (FMI 3), part by part: clocks tick and events are handled between the parts.
    fn do_step_3(&mut self, step: Advance) -> Result<Stepped> {
        let end = step.t + step.h;
        let (mut t, mut events, mut reported, mut returns) = (step.t, 0, 0, 0);
        if self.updates {
            self.foreign.log.updates.forget_rows();
        }
        let tolerance = 1e-9 * step.h + 4.0 * f64::EPSILON * end.abs();
        if self.ends_at_start {
            return Ok(Stepped { reached: t, terminate: true, events });
        }
        if self.clocks.is_due() || self.clocks.told.changes.get() {
            events += 1;
            if self.fire(t)? {
                return Ok(Stepped { reached: t, terminate: true, events });
            }
        }
        loop {
            let stop = next_stop(self, t, end, tolerance);
            let StepPart { event, terminate, last, at_stop } = self.do_part(step, (t, stop), tolerance)?;
            if terminate {
                return Ok(Stepped { reached: last, terminate, events });
            }
            let now = if at_stop { stop } else { last };
            let ticks = at_stop && self.clocks.tick_at(stop);
            let announced = at_stop && self.clocks.told.event_is_due(stop);
            let settles = event && self.event_mode || ticks;
            if settles {
                events += 1;
                // clocks tick as often as they say
                reported += u32::from(event);
                if self.handle_event(now, at_stop)? {
                    return Ok(Stepped { reached: last, terminate: true, events });
                }
            }
            if at_stop && stop >= end {
                return Ok(Stepped { reached: end, terminate: false, events });
            }
            if !(at_stop || event && self.event_mode) && last <= t {
                let outcome = format!("came no further than t = {last} s in the step to {end} s");
                return Err(self.foreign.lied(DO_STEP_3, outcome));
            }
            returns += u32::from(!at_stop || announced);
            if let Some(outcome) = endless(reported, returns) {
                return Err(self.foreign.lied(DO_STEP_3, outcome));
            }
            t = now;
            if self.updates && !settles {
                self.set_followed(t)?;
            }
        }
    }

    /// One call of `fmi3DoStep`, from t to `stop`, and a check of its answer.
    #[inline]
    fn do_part(&mut self, step: Advance, (t, stop): (f64, f64), tolerance: f64) -> Result<StepPart> {
        const NAME: &str = DO_STEP_3;
        let Api::Three(Three { do_step, get_f64, .. }) = self.foreign.api else {
            return Err(Error::Refused(NAME.into()));
        };
        let (mut event, mut terminate, mut early, mut last) = (false, false, false, UNTOLD);
        // a step that is repeated goes back to where its first part began
        let for_good = step.for_good && (t <= step.t || !self.description.capabilities.state);
        if self.updates {
            self.foreign.log.updates.open(t, stop, self.foreign.address(), get_f64);
        }
        let mode = Mode::now();
        self.foreign.trace(format_args!("from {t:?} s by {:?} s", stop - t));
        let status = self.foreign.status(NAME, do_step, |f, c| unsafe {
            f(c, t, stop - t, for_good, &raw mut event, &raw mut terminate, &raw mut early, &raw mut last)
        });
        if mode.restore() {
            mode_changed(self, NAME);
        }
        let wrong = if self.updates { self.foreign.log.updates.close() } else { None };
        let status = status?;
        if status == CallStatus::Discard && !wrong.as_ref().is_some_and(|w| w.fatal) {
            let reached = if last >= step.t && last <= step.t + step.h { last } else { step.t };
            return Err(Error::Discard { function: NAME, reached, log: self.foreign.log.last() });
        }
        if let Some(wrong) = wrong {
            return Err(self.foreign.stopped_between(NAME, wrong, status));
        }
        if !goes_on(status) {
            return Err(self.foreign.failed(NAME, status));
        }
        if last.to_bits() == UNTOLD.to_bits() && !early && !terminate {
            last = untold(self, stop);
        }
        // continued from where it came to, it stays there: that is a time of its own solver
        let stays =
            t > step.t && stop - t > tolerance && (last - t).abs() <= tolerance && !early && !terminate;
        let ended = match stays {
            true => {
                own_time(self, last, stop);
                PartEnd::Stop
            }
            false => self.part_end((t, stop), last, early || terminate, tolerance),
        };
        let at_stop = match ended {
            PartEnd::Stop => true,
            PartEnd::Before => {
                if early && !super::may_return_early(&self.description, self.event_mode) {
                    not_allowed(self, last, stop);
                }
                false
            }
            PartEnd::Wrong => {
                let outcome = format!("says that it came to t = {last} s in the step from {t} s to {stop} s");
                return Err(self.foreign.lied(NAME, outcome));
            }
        };
        Ok(StepPart { event, terminate, last, at_stop })
    }

    /// Where a part of a step from t to `stop` has ended whose `lastSuccessfulTime` is `last`.
    ///
    /// An FMU with a solver step of its own (`fixedInternalStepSize`) may report the time of its solver, which is up to one of
    /// these steps away from the communication point that it has reached: the Reference FMUs do. Any other FMU that reports an
    /// earlier time has returned early, whether it reports so or not, and is continued from there.
    fn part_end(&self, (t, stop): (f64, f64), last: f64, early: bool, tolerance: f64) -> PartEnd {
        let off = last - stop;
        if off.abs() <= tolerance {
            return PartEnd::Stop;
        }
        if early && last >= t - tolerance && last < stop {
            return PartEnd::Before;
        }
        // one that went on by a part of a step of its own cannot be taken back: it is at the end of the step
        let own = self.description.capabilities.fixed_step.unwrap_or(0.0) * (1.0 + 1e-6);
        if is_of_solver(self, last, off) || (0.0..=own.max(PAST * (stop - t))).contains(&off) {
            own_time(self, last, stop);
            return PartEnd::Stop;
        }
        if last > t && last < stop {
            returned_early(self, last, stop);
            return PartEnd::Before;
        }
        PartEnd::Wrong
    }

    /// Event mode at `now`, with the clocks that tick there at the end of a part; whether the FMU asks for the end.
    fn handle_event(&mut self, now: f64, at_stop: bool) -> Result<bool> {
        let Api::Three(Three { enter_event_mode, enter_step_mode, .. }) = self.foreign.api else {
            return Ok(false);
        };
        self.foreign.call("fmi3EnterEventMode", enter_event_mode, |f, c| unsafe { f(c) })?;
        if self.updates {
            self.set_followed(now)?;
        }
        if at_stop {
            self.clocks.tick(&self.foreign, now, false)?;
        }
        if self.update_discrete_states(now)? {
            return Ok(true);
        }
        self.foreign.call("fmi3EnterStepMode", enter_step_mode, |f, c| unsafe { f(c) })?;
        Ok(false)
    }

    /// When a step begins: an event for the triggered clocks and for discrete inputs that have changed. Whether the FMU asks for the end.
    fn fire(&mut self, t: f64) -> Result<bool> {
        let Api::Three(three) = self.foreign.api else { return Ok(false) };
        if !self.clocks.told.changes.replace(false) {
            self.foreign.call("fmi3EnterEventMode", three.enter_event_mode, |f, c| unsafe { f(c) })?;
        }
        self.clocks.tick_without_periodic(&self.foreign, t, true)?;
        if self.update_discrete_states(t)? {
            return Ok(true);
        }
        self.foreign.call("fmi3EnterStepMode", three.enter_step_mode, |f, c| unsafe { f(c) })?;
        Ok(false)
    }

    /// Between two parts of a step: sets the inputs that the FMU follows; its last request may be of another time.
    fn set_followed(&self, t: f64) -> Result {
        let mut inner = self.foreign.log.updates.inner();
        inner.followed.iter_mut().try_for_each(|input| {
            let (reference, values) = input.values_at(t)?;
            self.foreign.set(&[reference], values)
        })
    }

    /// Updates discrete states at t until nothing changes and no clock ticks; whether the FMU asks for the end.
    pub(super) fn update_discrete_states(&mut self, t: f64) -> Result<bool> {
        const NAME: &str = "fmi3UpdateDiscreteStates";
        let Api::Three(three) = self.foreign.api else { return Ok(false) };
        for _ in 0..ROUNDS {
            let (mut again, mut terminate, mut nominals, mut values, mut defined) =
                (false, false, false, false, false);
            let mut next = f64::INFINITY;
            self.clocks.look(&self.foreign)?;
            self.foreign.call(NAME, three.update_discrete, |f, c| unsafe {
                f(
                    c,
                    &raw mut again,
                    &raw mut terminate,
                    &raw mut nominals,
                    &raw mut values,
                    &raw mut defined,
                    &raw mut next,
                )
            })?;
            if terminate {
                return Ok(true);
            }
            let next = defined.then_some(next);
            let at_once =
                self.clocks.told.expect(t, next).map_err(|outcome| self.foreign.lied(NAME, outcome))?;
            if !again {
                self.clocks.told.ask(&self.foreign, t)?;
                if self.clocks.told_at(t) {
                    self.clocks.tick_told(&self.foreign, t)?;
                } else if !at_once {
                    return Ok(false);
                }
            }
        }
        Err(self.foreign.lied(NAME, format!("asks for more than {ROUNDS} rounds at one time")))
    }
}

/// Where the part of a step to `end` ends that begins at t, s: at a tick, or at an event that the FMU has announced. One with steps of
/// one length has its events at communication points.
#[inline]
fn next_stop(instance: &FmuInstance, t: f64, end: f64, tolerance: f64) -> f64 {
    let tick = instance.clocks.next(t, end);
    let stop = if end - tick > tolerance { tick } else { end };
    match instance.clocks.told.event_before(stop) {
        Some(event) if instance.description.capabilities.variable_step => event,
        Some(_) => {
            late_events(instance);
            stop
        }
        None => stop,
    }
}

/// Notes once that the events of an FMU with steps of one length are late.
#[cold]
fn late_events(instance: &FmuInstance) {
    if !instance.late_events.replace(true) {
        instance.foreign.log.note(
            "announces an event within a step, and makes steps of one length: such events are handled at the end of the step",
        );
    }
}

/// Complaint about a step that has more parts than any can need.
fn endless(events: u32, returns: u32) -> Option<String> {
    if events > ROUNDS {
        return Some(format!("found more than {ROUNDS} events in one step"));
    }
    (returns > RETURNS).then(|| {
        format!(
            "returned early more than {RETURNS} times in one step, or as often at an event that was announced"
        )
    })
}

/// Notes once that all others would round otherwise.
#[cold]
fn mode_changed(instance: &FmuInstance, function: &str) {
    if !instance.mode_told.replace(true) {
        instance.foreign.log.note(&format!(
            "{function} changed how this thread rounds or treats tiny numbers; it is set back after each step"
        ));
    }
}

/// Whether a time that is `off` the end of a step may be that of a solver of its own: its times are sums of its steps.
fn is_of_solver(of: &FmuInstance, last: f64, off: f64) -> bool {
    let own = of.description.capabilities.fixed_step.unwrap_or(0.0);
    let steps = (last - of.start) / own;
    // each step adds a rounding
    let rounded = 1e-6 + steps.abs() * f64::EPSILON * (1.0 + last.abs() / own);
    off.abs() <= own * (1.0 + 1e-6) && (steps - steps.round()).abs() <= rounded
}

/// Notes once that the FMU reports the time of its own solver.
#[cold]
fn own_time(instance: &FmuInstance, last: f64, stop: f64) {
    if !instance.own_time.replace(true) {
        let text = format!(
            "{DO_STEP_3} reports the time {last} s of its own solver (lastSuccessfulTime) in a step to {stop} s; the step counts \
             as made, and its outputs are those of its solver"
        );
        instance.foreign.log.note(&text);
    }
}

/// Notes once that the FMU returns early though it was told not to.
#[cold]
fn not_allowed(instance: &FmuInstance, last: f64, stop: f64) {
    if !instance.early.replace(true) {
        let text = format!(
            "{DO_STEP_3} returned early at t = {last} s in a step to {stop} s, which was not allowed (earlyReturnAllowed = false); it is \
             continued from there"
        );
        instance.foreign.log.note(&text);
    }
}

/// Notes once that the FMU returns early without the flag.
#[cold]
fn returned_early(instance: &FmuInstance, last: f64, stop: f64) {
    if !instance.early.replace(true) {
        let text = format!(
            "{DO_STEP_3} came to t = {last} s in a step to {stop} s (lastSuccessfulTime) without earlyReturn; it is continued \
             from there"
        );
        instance.foreign.log.note(&text);
    }
}

/// The time of an FMU that completed its step but did not report `lastSuccessfulTime`.
#[cold]
fn untold(instance: &FmuInstance, stop: f64) -> f64 {
    if !instance.untold.replace(true) {
        instance.foreign.log.note("fmi3DoStep does not say how far it came (lastSuccessfulTime), which breaks the standard; its steps count as made");
    }
    stop
}
