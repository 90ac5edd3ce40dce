//! Clocks whose intervals the unit tells in event mode (FMI 3.0, 2.2.9): each tick the time to the next one (`calculated`, `tunable`,
//! `changing`), or any event the time to a single tick (`countdown`).
//!
//! What was told last belongs to the state of the instance: it is saved and restored with it.

use super::Slave;
use super::functions::Api;
use crate::description::Told;
use crate::error::Result;
use std::cell::Cell;
use std::ffi::c_int;

/// `fmi3IntervalNotYetKnown` and `fmi3IntervalUnchanged`; what else is told is new.
const NOT_YET_KNOWN: c_int = 0;
const UNCHANGED: c_int = 1;

/// Such a clock.
#[derive(Debug)]
pub struct ToldClock {
    /// Number in calls.
    pub reference: u32,
    kind: Told,
    /// Time of its next tick and the interval before it, s; ∞ and 0: not known.
    next: Cell<f64>,
    interval: Cell<f64>,
    /// Whether it has just ticked, so that its next interval is asked for.
    ticked: Cell<bool>,
}

impl ToldClock {
    /// A clock that waits for its first tick after the start at 0 s.
    pub fn new(reference: u32, kind: Told) -> Self {
        let next = match kind {
            Told::Each(shift) => shift,
            Told::Countdown => f64::INFINITY,
        };
        let (next, interval, ticked) = (Cell::new(next), Cell::new(0.0), Cell::new(false));
        Self { reference, kind, next, interval, ticked }
    }

    /// The run starts at this time, s.
    pub fn begin(&self, start: f64) {
        self.next.set(self.next.get() + start);
    }

    /// s.
    pub fn next(&self) -> f64 {
        self.next.get()
    }

    /// Whether it ticks at t.
    pub fn is_due(&self, t: f64) -> bool {
        let slack = 1e-9 * self.interval.get() + 4.0 * f64::EPSILON * t.abs();
        self.next.get() <= t + slack
    }

    /// The same; it has ticked then.
    pub fn take(&self, t: f64) -> bool {
        let due = self.is_due(t);
        if due {
            self.next.set(f64::INFINITY);
            self.ticked.set(true);
        }
        due
    }

    /// Takes what the unit told at t; the reason where that is no interval.
    fn tell(&self, t: f64, interval: f64, qualifier: c_int) -> std::result::Result<(), String> {
        let countdown = self.kind == Told::Countdown;
        let ticked = self.ticked.replace(false);
        if qualifier == NOT_YET_KNOWN || qualifier == UNCHANGED && countdown || !countdown && !ticked {
            return Ok(());
        }
        let interval = if qualifier == UNCHANGED { self.interval.get() } else { interval };
        if !(interval.is_finite() && (interval > 0.0 || countdown && interval == 0.0)) {
            return Err(format!(
                "told the interval {interval} s of the clock {} at t = {t} s",
                self.reference
            ));
        }
        self.interval.set(interval);
        self.next.set(t + interval);
        Ok(())
    }
}

impl Slave {
    /// In event mode, once discrete states are settled: asks for new intervals.
    pub(super) fn ask_intervals(&self, t: f64) -> Result {
        const NAME: &str = "fmi3GetIntervalDecimal";
        let Api::Three(three) = self.api else { return Ok(()) };
        let told = &self.clocks.told;
        if told.is_empty() {
            return Ok(());
        }
        let references: Vec<u32> = told.iter().map(|clock| clock.reference).collect();
        let (mut intervals, mut qualifiers) = (vec![f64::NAN; told.len()], vec![NOT_YET_KNOWN; told.len()]);
        let (r, n) = (references.as_ptr(), references.len());
        let (x, q) = (intervals.as_mut_ptr(), qualifiers.as_mut_ptr());
        // SAFETY: as many values as references.
        self.call(NAME, three.get_interval, |f, c| unsafe { f(c, r, n, x, q) })?;
        for (clock, (interval, qualifier)) in told.iter().zip(intervals.into_iter().zip(qualifiers)) {
            clock.tell(t, interval, qualifier).map_err(|outcome| self.lied(NAME, outcome))?;
        }
        Ok(())
    }

    /// What was told last, to be kept beside a saved state.
    pub(super) fn schedule(&self, out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.clocks.told.iter().flat_map(|clock| [clock.next.get(), clock.interval.get()]));
    }

    /// Back to what was told when a state was saved.
    pub(super) fn reschedule(&self, schedule: &[f64]) {
        for (clock, kept) in self.clocks.told.iter().zip(schedule.chunks_exact(2)) {
            clock.next.set(kept[0]);
            clock.interval.set(kept[1]);
        }
    }

    /// Numbers of a schedule.
    pub(super) fn schedule_len(&self) -> usize {
        2 * self.clocks.told.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_asks_after_each_tick_and_a_countdown_at_each_event() {
        let each = ToldClock::new(1, Told::Each(0.5));
        each.begin(1.0);
        assert!(!each.take(1.0) && each.take(1.5) && each.next() == f64::INFINITY);
        each.tell(1.5, 0.25, 2).unwrap();
        // events between ticks change nothing
        each.tell(1.6, 9.0, 2).unwrap();
        assert_eq!(each.next(), 1.75);
        assert!(each.take(1.75));
        each.tell(1.75, f64::NAN, 1).unwrap();
        assert_eq!(each.next(), 2.0);
        let once = ToldClock::new(2, Told::Countdown);
        once.begin(1.0);
        once.tell(1.0, 3.0, 0).unwrap();
        assert_eq!(once.next(), f64::INFINITY);
        once.tell(1.0, 0.5, 2).unwrap();
        once.tell(1.2, 0.5, 1).unwrap();
        assert!(once.next() == 1.5 && once.take(1.5) && !once.take(1.6));
        assert!(once.tell(2.0, -1.0, 2).is_err() && once.tell(2.0, f64::NAN, 2).is_err());
    }
}
