//! Inputs that follow their source beyond the last communication point (`extrapolate = "linear"`), along the line through its last two
//! values, or along the derivative that the source provides (`extrapolate = "derivatives"`).
//!
//! An input is held over a step, so a subsystem that integrates it takes the mean of the line over its step, which makes the exchange of
//! second order. One whose outputs follow its inputs at once takes the value at the end, to which its outputs belong. Source and target may
//! make steps of different lengths (`step_multiple`): the line runs through the last two values of the source, and the mean is taken over the
//! step of the target.

use terraglue_diagnostics::Result;
use terraglue_gluing::memory::{Recall, Remember};

/// Held value of an input that goes from `start` to `end` in a step: the end if outputs follow inputs at once, else the mean.
pub fn held(takes_end: bool, start: f64, end: f64) -> f64 {
    if takes_end { end } else { 0.5 * (start + end) }
}

/// A communication step that is about to be made.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Its start, s.
    pub t: f64,
    /// Its length, s.
    pub h: f64,
    /// Nominal steps of the testbed so far.
    pub nominal: u64,
}

/// The line of each source of a connection.
#[derive(Debug)]
pub struct Extrapolation {
    /// Steps of the testbed per step of the source and of the target.
    multiples: [u64; 2],
    /// Whether the target takes each value at the end of its step.
    takes_end: Vec<bool>,
    /// Whether the source provides the slope; else the line runs through its last two values.
    by_derivatives: bool,
    /// Time of the last values, s; NaN before the first ones.
    last_s: f64,
    /// Steps of source and target that were seen last.
    seen: [u64; 2],
    last: Vec<f64>,
    /// Change of the values per second.
    slope: Vec<f64>,
    /// Values at the start of the step of the target.
    start: Vec<f64>,
    ahead: Vec<f64>,
}

impl Extrapolation {
    /// Of a source and a target that make one step per so many of the testbed.
    pub fn new(multiples: [u32; 2], by_derivatives: bool) -> Self {
        Self {
            multiples: multiples.map(|n| u64::from(n.max(1))),
            takes_end: Vec::new(),
            by_derivatives,
            last_s: f64::NAN,
            seen: [0; 2],
            last: Vec::new(),
            slope: Vec::new(),
            start: Vec::new(),
            ahead: Vec::new(),
        }
    }

    /// Says which of the values the target takes at the end of its step.
    pub fn set_ends(&mut self, takes_end: Vec<bool>) {
        self.takes_end = takes_end;
    }

    /// Whether the source provides its slopes.
    pub fn by_derivatives(&self) -> bool {
        self.by_derivatives
    }

    /// Whether the source has made a step since its values were taken last.
    fn is_fresh(&self, moment: Moment) -> bool {
        let now = moment.nominal / self.multiples[0];
        self.last_s.is_nan()
            || if self.multiples[0] == 1 { moment.t > self.last_s } else { now != self.seen[0] }
    }

    /// Takes the values at the start of a communication step; `tell` writes the slopes, and is asked where they are wanted and the source
    /// has made a step.
    ///
    /// # Errors
    /// The error of `tell`.
    pub fn take(
        &mut self,
        moment: Moment,
        values: &[f64],
        tell: impl FnOnce(&mut [f64]) -> Result,
    ) -> Result {
        let Moment { t, h, nominal } = moment;
        let now = self.multiples.map(|n| nominal / n);
        let first = self.last_s.is_nan();
        if self.is_fresh(moment) {
            self.slope.resize(values.len(), 0.0);
            match self.by_derivatives {
                true if nominal > 0 => tell(&mut self.slope)?,
                // before its first step a source has none
                true => self.slope.fill(0.0),
                false => {
                    for (slope, (value, last)) in self.slope.iter_mut().zip(values.iter().zip(&self.last)) {
                        *slope = (value - last) / (t - self.last_s);
                    }
                }
            }
            self.last.clear();
            self.last.extend_from_slice(values);
            self.last_s = t;
        }
        let Self { last, slope, start, ahead, last_s, takes_end, .. } = self;
        let (last, slope, since) = (&*last, &*slope, *last_s);
        let line = |time: f64| last.iter().zip(slope).map(move |(x, s)| x + s * (time - since));
        if first || self.multiples[1] == 1 || now[1] != self.seen[1] {
            start.clear();
            start.extend(line(t));
        }
        ahead.clear();
        let ends = takes_end.iter().copied().chain(std::iter::repeat(false));
        let values = line(t + h).zip(&*start).zip(ends);
        ahead.extend(values.map(|((end, start), takes_end)| held(takes_end, *start, end)));
        self.seen = now;
        Ok(())
    }

    /// Values for the inputs; `None` before the first step.
    pub fn ahead(&self) -> Option<&[f64]> {
        (!self.ahead.is_empty()).then_some(&self.ahead)
    }

    /// The same over one of four quarters of the step, from 0 on.
    pub fn over_quarter(&self, k: u32) -> Option<Vec<f64>> {
        let k = f64::from(k);
        let ends = self.takes_end.iter().copied().chain(std::iter::repeat(false));
        // `ahead` is the end of the line, or its middle
        let along = |((start, ahead), takes_end): ((&f64, &f64), bool)| {
            start + (ahead - start) * if takes_end { 0.25 * (k + 1.0) } else { 0.5 * (k + 0.5) }
        };
        (!self.ahead.is_empty()).then(|| self.start.iter().zip(&self.ahead).zip(ends).map(along).collect())
    }

    /// For a snapshot.
    pub fn remember(&self, out: &mut Vec<u64>) {
        out.put(self.last_s);
        out.extend(self.seen);
        [&self.last, &self.slope, &self.start].into_iter().for_each(|list| out.put_all(list));
    }

    /// Back to a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        self.last_s = kept.number();
        self.seen = [kept.word(), kept.word()];
        [&mut self.last, &mut self.slope, &mut self.start].into_iter().for_each(|list| kept.all(list));
        self.ahead.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::{Extrapolation, Moment};

    const H: f64 = 0.1;

    /// Takes values whose slopes nobody is asked for.
    fn take(line: &mut Extrapolation, moment: Moment, value: f64) {
        line.take(moment, &[value], |_| panic!("no slope is wanted")).expect("taken");
    }

    /// Value of the inputs at the last of some steps, of a source with the value u(t) in its own last step.
    fn ahead(multiples: [u32; 2], takes_end: bool, steps: u64, u: impl Fn(f64) -> f64) -> f64 {
        let mut line = Extrapolation::new(multiples, false);
        line.set_ends(vec![takes_end]);
        let source = u64::from(multiples[0]);
        for nominal in 0..steps {
            let told = (nominal / source * source) as f64 * H;
            take(&mut line, Moment { t: nominal as f64 * H, h: H, nominal }, u(told));
        }
        line.ahead().map_or(f64::NAN, |all| all[0])
    }

    #[test]
    fn a_line_is_met_whatever_the_lengths_of_the_steps() {
        let u = |t: f64| 3.0 - 2.0 * t;
        for (multiples, steps) in [([1, 1], 7), ([1, 3], 9), ([3, 1], 8), ([2, 3], 9), ([3, 2], 8)] {
            let end = steps as f64 * H;
            let length = f64::from(multiples[1]) * H;
            assert!((ahead(multiples, true, steps, u) - u(end)).abs() < 1e-12, "{multiples:?}");
            assert!(
                (ahead(multiples, false, steps, u) - u(end - 0.5 * length)).abs() < 1e-12,
                "{multiples:?}"
            );
        }
    }

    #[test]
    fn the_first_step_and_a_step_that_is_repeated_have_no_other_line() {
        assert_eq!(ahead([1, 1], false, 1, |t| 1.0 + t), 1.0);
        let mut line = Extrapolation::new([1, 1], false);
        line.set_ends(vec![true]);
        take(&mut line, Moment { t: 0.0, h: H, nominal: 0 }, 1.0);
        take(&mut line, Moment { t: H, h: H, nominal: 1 }, 2.0);
        take(&mut line, Moment { t: H, h: 0.5 * H, nominal: 1 }, 2.0);
        assert!((line.ahead().map_or(f64::NAN, |all| all[0]) - 2.5).abs() < 1e-12);
    }

    #[test]
    fn slopes_that_are_told_are_the_line_and_the_first_step_is_held() {
        let mut line = Extrapolation::new([1, 1], true);
        take(&mut line, Moment { t: 0.0, h: H, nominal: 0 }, 1.0);
        assert_eq!(line.ahead(), Some(&[1.0][..]));
        // the last two values have another slope
        let moment = Moment { t: H, h: H, nominal: 1 };
        let tell = |slopes: &mut [f64]| {
            slopes.fill(3.0);
            Ok(())
        };
        line.take(moment, &[2.0], tell).expect("taken");
        assert!((line.ahead().map_or(f64::NAN, |all| all[0]) - (2.0 + 3.0 * 0.5 * H)).abs() < 1e-12);
    }
}
