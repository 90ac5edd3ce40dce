//! Times that the FMU reports in event mode: of its next event (`nextEventTime`), and of clocks (FMI 3.0, 2.2.9): each tick the time to
//! the next one (`calculated`, `tunable`, `changing`), or any event the time to a single tick (`countdown`).
//!
//! Intervals reported as fractions are added up as whole numbers, so that a clock of 1/3 s does not drift.
//!
//! The last reported times belong to the state of the instance: they are saved and restored with it.

use super::foreign::ForeignInstance;
use super::functions::Api;
use crate::description::Told;
use crate::error::Result;
use std::cell::Cell;
use std::ffi::c_int;

/// `fmi3IntervalNotYetKnown` and `fmi3IntervalUnchanged`; with any other qualifier the interval is new.
const NOT_YET_KNOWN: c_int = 0;
const UNCHANGED: c_int = 1;
/// Numbers of a clock in a schedule.
const KEPT: usize = 6;
/// Numbers of a schedule before those of its clocks.
const OWN: usize = 2;
/// Whole numbers up to here are exact in f64.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Such a clock.
#[derive(Debug)]
pub struct ToldClock {
    /// Number in calls.
    pub reference: u32,
    kind: Told,
    /// Whether it reports fractions.
    fraction: bool,
    /// Time of its next tick and the interval before it, s; ∞ and 0: not known.
    next: Cell<f64>,
    interval: Cell<f64>,
    /// Where the count of fractions began, s, and the sum since then as counter and resolution; resolution 0: none.
    base: Cell<f64>,
    sum: Cell<f64>,
    resolution: Cell<f64>,
    /// The counter that was reported last.
    counter: Cell<f64>,
    /// Whether it has just ticked, so that its next interval is read.
    ticked: Cell<bool>,
}

impl ToldClock {
    /// A clock that waits for its first tick after the start at 0 s.
    pub fn new(reference: u32, kind: Told, fraction: bool) -> Self {
        let next = match kind {
            Told::Each(shift) => shift,
            Told::Countdown => f64::INFINITY,
        };
        let zero = || Cell::new(0.0);
        Self {
            reference,
            kind,
            fraction,
            next: Cell::new(next),
            interval: zero(),
            base: zero(),
            sum: zero(),
            resolution: zero(),
            counter: zero(),
            ticked: Cell::new(false),
        }
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
        let slack = 1e-9 * self.interval.get() + rounding(t);
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

    /// Takes the interval that the FMU reported at t; the reason where it is not valid.
    fn tell(&self, t: f64, interval: f64, qualifier: c_int) -> std::result::Result<(), String> {
        if !self.listens(qualifier) {
            return Ok(());
        }
        let interval = if qualifier == UNCHANGED { self.interval.get() } else { interval };
        self.check(t, interval, || format!("{interval} s"))?;
        self.interval.set(interval);
        self.next.set(t + interval);
        Ok(())
    }

    /// The same of a fraction, counter / resolution in s.
    fn tell_fraction(
        &self,
        t: f64,
        (counter, resolution): (u64, u64),
        qualifier: c_int,
    ) -> std::result::Result<(), String> {
        if !self.listens(qualifier) {
            return Ok(());
        }
        let known = [self.counter.get(), self.resolution.get()];
        let [counter, resolution] =
            if qualifier == UNCHANGED { known } else { [counter as f64, resolution as f64] };
        let interval = counter / resolution;
        self.check(t, interval, || format!("{counter}/{resolution} s"))?;
        let goes_on = self.kind != Told::Countdown
            && resolution == self.resolution.get()
            && self.sum.get() + counter < EXACT;
        if !goes_on {
            self.base.set(t);
            self.sum.set(0.0);
        }
        self.sum.set(self.sum.get() + counter);
        self.resolution.set(resolution);
        self.counter.set(counter);
        self.interval.set(interval);
        self.next.set(self.base.get() + self.sum.get() / resolution);
        Ok(())
    }

    /// Whether an answer with this qualifier is a new interval; a clock that has not ticked since the last one waits.
    fn listens(&self, qualifier: c_int) -> bool {
        let countdown = self.kind == Told::Countdown;
        let ticked = self.ticked.replace(false);
        !(qualifier == NOT_YET_KNOWN || qualifier == UNCHANGED && countdown || !countdown && !ticked)
    }

    fn check(&self, t: f64, interval: f64, shown: impl Fn() -> String) -> std::result::Result<(), String> {
        let countdown = self.kind == Told::Countdown;
        if interval.is_finite() && (interval > 0.0 || countdown && interval == 0.0) {
            return Ok(());
        }
        Err(format!("told the interval {} of the clock {} at t = {t} s", shown(), self.reference))
    }

    fn numbers(&self) -> [&Cell<f64>; KEPT] {
        [&self.next, &self.interval, &self.base, &self.sum, &self.resolution, &self.counter]
    }
}

/// What sums of steps may be off at t, s.
fn rounding(t: f64) -> f64 {
    4.0 * f64::EPSILON * t.abs()
}

/// All that an instance has reported.
pub(super) struct ToldClocks {
    clocks: Vec<ToldClock>,
    /// Time of the next event, s; ∞: the FMU has announced none.
    event: Cell<f64>,
    /// Whether the instance is in event mode between two steps, as a discrete input has changed.
    pub changes: Cell<bool>,
}

impl Default for ToldClocks {
    fn default() -> Self {
        Self::new(Vec::new())
    }
}

impl ToldClocks {
    /// Of these clocks.
    pub fn new(clocks: Vec<ToldClock>) -> Self {
        Self { clocks, event: Cell::new(f64::INFINITY), changes: Cell::new(false) }
    }

    /// The run starts at this time, s.
    pub fn begin(&self, start: f64) {
        self.clocks.iter().for_each(|clock| clock.begin(start));
    }

    /// The first tick that is known, or `end`, s.
    #[inline]
    pub fn next(&self, end: f64) -> f64 {
        self.clocks.iter().map(ToldClock::next).fold(end, f64::min)
    }

    /// The time of the next event, if it is before `end`, s.
    #[inline]
    pub fn event_before(&self, end: f64) -> Option<f64> {
        let at = self.event.get();
        (at < end - rounding(end)).then_some(at)
    }

    /// Whether one of the clocks ticks at t.
    #[inline]
    pub fn any_due(&self, t: f64) -> bool {
        self.clocks.iter().any(|clock| clock.is_due(t))
    }

    /// Whether the next event is at t, up to rounding.
    #[inline]
    pub fn event_is_due(&self, t: f64) -> bool {
        self.event.get() <= t + rounding(t)
    }

    /// Takes the time of the next event that the FMU reports at t; whether that is at once. The reason where it is not valid.
    pub fn expect(&self, t: f64, next: Option<f64>) -> std::result::Result<bool, String> {
        let at = next.unwrap_or(f64::INFINITY);
        if at.is_nan() || at < t - rounding(t) {
            return Err(format!("says at t = {t} s that its next event is at {at} s"));
        }
        self.event.set(at);
        Ok(at <= t)
    }

    /// Numbers in calls of those that tick at t; they have ticked then.
    pub fn take(&self, t: f64) -> impl Iterator<Item = u32> {
        self.clocks.iter().filter(move |clock| clock.take(t)).map(|clock| clock.reference)
    }

    /// In event mode, once discrete states are settled: asks for new intervals.
    pub fn ask(&self, foreign: &ForeignInstance, t: f64) -> Result {
        if self.clocks.is_empty() {
            return Ok(());
        }
        self.ask_decimals(foreign, t)?;
        self.ask_fractions(foreign, t)
    }

    fn ask_decimals(&self, foreign: &ForeignInstance, t: f64) -> Result {
        const NAME: &str = "fmi3GetIntervalDecimal";
        let Api::Three(three) = foreign.api else { return Ok(()) };
        let told = || self.clocks.iter().filter(|clock| !clock.fraction);
        let references: Vec<u32> = told().map(|clock| clock.reference).collect();
        if references.is_empty() {
            return Ok(());
        }
        let (r, n) = (references.as_ptr(), references.len());
        let (mut intervals, mut qualifiers) = (vec![f64::NAN; n], vec![NOT_YET_KNOWN; n]);
        let (x, q) = (intervals.as_mut_ptr(), qualifiers.as_mut_ptr());
        // SAFETY: as many values as references.
        foreign.call(NAME, three.get_interval, |f, c| unsafe { f(c, r, n, x, q) })?;
        for (clock, (interval, qualifier)) in told().zip(intervals.into_iter().zip(qualifiers)) {
            clock.tell(t, interval, qualifier).map_err(|outcome| foreign.lied(NAME, outcome))?;
        }
        Ok(())
    }

    fn ask_fractions(&self, foreign: &ForeignInstance, t: f64) -> Result {
        const NAME: &str = "fmi3GetIntervalFraction";
        let Api::Three(three) = foreign.api else { return Ok(()) };
        let told = || self.clocks.iter().filter(|clock| clock.fraction);
        let references: Vec<u32> = told().map(|clock| clock.reference).collect();
        if references.is_empty() {
            return Ok(());
        }
        let (r, n) = (references.as_ptr(), references.len());
        let (mut counters, mut resolutions) = (vec![0_u64; n], vec![0_u64; n]);
        let mut qualifiers = vec![NOT_YET_KNOWN; n];
        let (x, d, q) = (counters.as_mut_ptr(), resolutions.as_mut_ptr(), qualifiers.as_mut_ptr());
        // SAFETY: as many values as references.
        foreign.call(NAME, three.get_fraction, |f, c| unsafe { f(c, r, n, x, d, q) })?;
        let fractions = counters.into_iter().zip(resolutions).zip(qualifiers);
        for (clock, (fraction, qualifier)) in told().zip(fractions) {
            clock.tell_fraction(t, fraction, qualifier).map_err(|outcome| foreign.lied(NAME, outcome))?;
        }
        Ok(())
    }

    /// Appends the last reported times, to be kept with a saved state.
    pub fn schedule(&self, out: &mut Vec<f64>) {
        out.clear();
        out.extend([self.event.get(), f64::from(u8::from(self.changes.get()))]);
        out.extend(self.clocks.iter().flat_map(|clock| clock.numbers().map(Cell::get)));
    }

    /// Restores the times that were kept with a saved state.
    pub fn reschedule(&self, schedule: &[f64]) {
        let Some(([event, changes], clocks)) = schedule.split_first_chunk::<OWN>() else { return };
        self.event.set(*event);
        self.changes.set(*changes != 0.0);
        for (clock, kept) in self.clocks.iter().zip(clocks.chunks_exact(KEPT)) {
            clock.numbers().into_iter().zip(kept).for_each(|(own, kept)| own.set(*kept));
        }
    }

    /// Numbers of a schedule.
    pub fn schedule_len(&self) -> usize {
        OWN + KEPT * self.clocks.len()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_asks_after_each_tick_and_a_countdown_at_each_event() {
        let each = ToldClock::new(1, Told::Each(0.5), false);
        each.begin(1.0);
        assert!(!each.take(1.0) && each.take(1.5) && each.next() == f64::INFINITY);
        each.tell(1.5, 0.25, 2).unwrap();
        // events between ticks change nothing
        each.tell(1.6, 9.0, 2).unwrap();
        assert_eq!(each.next(), 1.75);
        assert!(each.take(1.75));
        each.tell(1.75, f64::NAN, 1).unwrap();
        assert_eq!(each.next(), 2.0);
        let once = ToldClock::new(2, Told::Countdown, false);
        once.begin(1.0);
        once.tell(1.0, 3.0, 0).unwrap();
        assert_eq!(once.next(), f64::INFINITY);
        once.tell(1.0, 0.5, 2).unwrap();
        once.tell(1.2, 0.5, 1).unwrap();
        assert!(once.next() == 1.5 && once.take(1.5) && !once.take(1.6));
        assert!(once.tell(2.0, -1.0, 2).is_err() && once.tell(2.0, f64::NAN, 2).is_err());
    }

    #[test]
    fn fractions_do_not_drift() {
        let third = ToldClock::new(1, Told::Each(0.0), true);
        third.begin(0.0);
        for k in 1..=3000 {
            assert!(third.take(third.next()));
            third.tell_fraction(f64::from(k - 1) / 3.0, (1, 3), if k == 1 { 2 } else { UNCHANGED }).unwrap();
            assert_eq!(third.next(), f64::from(k) / 3.0);
        }
        assert!(third.take(1000.0));
        third.tell_fraction(1000.0, (1, 4), 2).unwrap();
        assert_eq!(third.next(), 1000.25);
        assert!(third.take(1000.25));
        assert!(third.tell_fraction(1000.25, (1, 0), 2).is_err());
    }
}
