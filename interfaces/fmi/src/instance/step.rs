//! `doStep`, events between steps, and what both answer.

use super::call::CallStatus;
use super::functions::{Api, Three};
use super::{FmuInstance, InstancePhase, goes_on};
use crate::error::{Error, Result};
use crate::floating_point::Mode;
use std::ffi::c_int;

const DO_STEP_2: &str = "fmi2DoStep";
/// `fmi2LastSuccessfulTime` of `fmi2StatusKind`.
const LAST_SUCCESSFUL_TIME: c_int = 2;
/// `fmi2Terminated` of `fmi2StatusKind`.
const TERMINATED: c_int = 3;
/// How far past the end of a step an FMU may say it is, as a share of the step: some round to a grid of their own.
const PAST: f64 = 1e-3;
/// What stands in `lastSuccessfulTime` before a step, a NaN of its own: does the FMU write there at all?
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
        let Api::Two(two) = &self.api else { return self.do_step_3(step) };
        let for_good = c_int::from(step.for_good);
        let mode = Mode::now();
        // SAFETY: the arguments are those of the standard.
        let status = self.status(DO_STEP_2, two.do_step, |f, c| unsafe { f(c, step.t, step.h, for_good) });
        if mode.restore() {
            self.mode_changed(DO_STEP_2);
        }
        match status? {
            status if goes_on(status) => {
                Ok(Stepped { reached: step.t + step.h, terminate: false, events: 0 })
            }
            status => self.stopped_2(step, status),
        }
    }

    /// Says once that all others would round otherwise.
    #[cold]
    fn mode_changed(&self, function: &str) {
        if !self.mode_told.replace(true) {
            self.log.note(&format!(
                "{function} changed how this thread rounds or treats tiny numbers; it is set back after each step"
            ));
        }
    }

    /// How far an FMU of FMI 2.0 came that did not make its step.
    #[cold]
    fn stopped_2(&self, step: Advance, status: CallStatus) -> Result<Stepped> {
        const NAME: &str = DO_STEP_2;
        let Api::Two(two) = self.api else { return Err(Error::Refused(NAME.into())) };
        let end = step.t + step.h;
        if status != CallStatus::Discard {
            return Err(self.failed(NAME, status));
        }
        let log = self.log.last();
        let mut reached = f64::NAN;
        // SAFETY: the arguments are those of the standard, here and below.
        let answer = self.status("fmi2GetRealStatus", two.get_real_status, |f, c| unsafe {
            f(c, LAST_SUCCESSFUL_TIME, &raw mut reached)
        });
        let reached = match answer {
            Ok(s) if goes_on(s) && reached >= step.t && reached <= end => reached,
            _ => step.t,
        };
        let mut terminated = 0;
        let answer = self.status("fmi2GetBooleanStatus", two.get_boolean_status, |f, c| unsafe {
            f(c, TERMINATED, &raw mut terminated)
        });
        if answer.is_ok_and(goes_on) && terminated != 0 {
            return Ok(Stepped { reached, terminate: true, events: 0 });
        }
        Err(Error::Discard { function: NAME, reached, log })
    }

    fn do_step_3(&mut self, step: Advance) -> Result<Stepped> {
        const NAME: &str = "fmi3DoStep";
        let Api::Three(Three { do_step, get_f64, enter_event_mode, enter_step_mode, .. }) = self.api else {
            return Err(Error::Refused(NAME.into()));
        };
        let end = step.t + step.h;
        let (mut t, mut events, mut returns) = (step.t, 0, 0);
        if self.updates {
            self.forget_between();
        }
        let tolerance = 1e-9 * step.h + 4.0 * f64::EPSILON * end.abs();
        if self.clocks.is_due() {
            events += 1;
            if self.fire(t)? {
                return Ok(Stepped { reached: t, terminate: true, events });
            }
        }
        loop {
            let tick = self.clocks.next(t, end);
            let stop = if end - tick > tolerance { tick } else { end };
            let (mut event, mut terminate, mut early, mut last) = (false, false, false, UNTOLD);
            // a step that is repeated goes back to where its first part began
            let for_good = step.for_good && (t <= step.t || !self.description.capabilities.state);
            if self.updates {
                self.open_between(t, stop, get_f64);
            }
            let mode = Mode::now();
            let status = self.status(NAME, do_step, |f, c| unsafe {
                f(c, t, stop - t, for_good, &raw mut event, &raw mut terminate, &raw mut early, &raw mut last)
            });
            if mode.restore() {
                self.mode_changed(NAME);
            }
            let wrong = if self.updates { self.close_between() } else { None };
            let status = status?;
            if status == CallStatus::Discard && !wrong.as_ref().is_some_and(|w| w.fatal) {
                let reached = if last >= step.t && last <= end { last } else { step.t };
                return Err(Error::Discard { function: NAME, reached, log: self.log.last() });
            }
            if let Some(wrong) = wrong {
                return Err(self.stopped_between(NAME, wrong, status));
            }
            if !goes_on(status) {
                return Err(self.failed(NAME, status));
            }
            if last.to_bits() == UNTOLD.to_bits() && !early && !terminate {
                last = self.untold(stop);
            }
            let past = last > stop + tolerance && last - stop <= PAST * step.h;
            if past && !self.ran_past.replace(true) {
                let text =
                    format!("says that it came to t = {last} s in a step to {stop} s; taken as {stop} s");
                self.log.note(&text);
            }
            let at_stop = past || (last - stop).abs() <= tolerance;
            if !at_stop && !early || last.is_nan() || last < t - tolerance || last > stop + tolerance && !past
            {
                let outcome = format!("says that it came to t = {last} s in the step from {t} s to {stop} s");
                return Err(self.lied(NAME, outcome));
            }
            if terminate {
                return Ok(Stepped { reached: last, terminate, events });
            }
            let now = if at_stop { stop } else { last };
            let ticks = at_stop && self.clocks.tick_at(stop);
            let settles = event && self.event_mode || ticks;
            if settles {
                events += 1;
                self.call("fmi3EnterEventMode", enter_event_mode, |f, c| unsafe { f(c) })?;
                if self.updates {
                    self.set_followed(now)?;
                }
                if at_stop {
                    self.tick(stop, false)?;
                }
                if self.update_discrete_states(now)? {
                    return Ok(Stepped { reached: last, terminate: true, events });
                }
                self.call("fmi3EnterStepMode", enter_step_mode, |f, c| unsafe { f(c) })?;
            }
            if at_stop && stop >= end {
                return Ok(Stepped { reached: end, terminate: false, events });
            }
            if !(at_stop || event && self.event_mode) && last <= t {
                let outcome = format!("came no further than t = {last} s in the step to {end} s");
                return Err(self.lied(NAME, outcome));
            }
            if events > ROUNDS {
                return Err(self.lied(NAME, format!("found more than {ROUNDS} events in one step")));
            }
            returns += u32::from(!at_stop);
            if returns > RETURNS {
                return Err(self.lied(NAME, format!("returned early more than {RETURNS} times in one step")));
            }
            t = now;
            if self.updates && !settles {
                self.set_followed(t)?;
            }
        }
    }

    /// Where an FMU is that said its step is made and not how far it came.
    #[cold]
    fn untold(&self, stop: f64) -> f64 {
        if !self.untold.replace(true) {
            self.log.note("fmi3DoStep does not say how far it came (lastSuccessfulTime), which breaks the standard; its steps count as made");
        }
        stop
    }

    /// Updates discrete states at t until nothing changes and no clock ticks; whether the FMU asks for the end.
    pub(super) fn update_discrete_states(&mut self, t: f64) -> Result<bool> {
        const NAME: &str = "fmi3UpdateDiscreteStates";
        let Api::Three(three) = self.api else { return Ok(false) };
        for _ in 0..ROUNDS {
            let (mut again, mut terminate, mut nominals, mut values, mut defined) =
                (false, false, false, false, false);
            let mut next = f64::INFINITY;
            self.look_at_clocks()?;
            self.call(NAME, three.update_discrete, |f, c| unsafe {
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
            if !again {
                self.ask_intervals(t)?;
                if !self.clocks.told_at(t) {
                    return Ok(false);
                }
                self.tick_told(t)?;
            }
        }
        Err(self.lied(NAME, format!("asks for more than {ROUNDS} rounds at one time")))
    }
}
