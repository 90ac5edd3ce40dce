//! The values of one loop of connections: from the outputs of a trial to the values that the next one is made with.
//!
//! Loops of a run are repeated beside each other, each with its own values: one that is solved keeps them, whatever others still do.
//!
//! A trial is one step of each FMU, or four of a quarter of the length. With u the value of an output at the start, in the middle (m) and at the end
//! (e) of the step, an input that is integrated is held at (u + e)/2 over a whole step; over the quarters at (7u + 8m − 3e)/12, (3u + 8m + e)/12,
//! (u + 8m + 3e)/12 and (8m + 7e − 3u)/12. These lead a rate to ∫p and a place to ∫∫p as the three-stage Lobatto IIIA method has them (Hairer and Wanner,
//! Solving Ordinary Differential Equations II, 1996, section IV.5), with p the parabola through the three values: of fourth order, A-stable, and as start
//! and end are treated alike, a loop without damping neither gains nor loses amplitude.

use super::newton::Newton;
use crate::signals::{FeedThroughs, Link, Links, held};
use terraglue_diagnostics::Result;
use terraglue_gluing::acceleration::Acceleration;
use terraglue_host::Instance;
use terraglue_numerics::extremes::larger;
use terraglue_scenario::Relaxation;

/// Largest difference of a value and the one that the step was made with, relative to the largest at the starts of steps and in their first trials. Values that have always
/// been rounding errors never come so far: where repetitions bring them no nearer, it is relative to the larger of the value and [`SMALL`].
const TOLERANCE: f64 = 1e-10;
/// Repetitions in a row that bring values no nearer.
const STUCK: u32 = 3;
/// In the unit of a value.
const SMALL: f64 = 1e-3;

/// Values that grow by this factor beyond those of start and first trial, and beyond 1 in their unit, have no solution.
const RUNAWAY: f64 = 1e12;

/// A part of a step that a trial is made of.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(super) enum Part {
    /// All of it.
    Whole,
    /// One of four, from 0 on.
    Quarter(u32),
}

/// A connection of a loop.
#[derive(Debug)]
struct Iterated {
    link: usize,
    /// Whether its target takes each value at the end of the step.
    takes_end: Vec<bool>,
}

/// A loop, or iterated connections that lead to an FMU without being part of one.
#[derive(Debug)]
pub(super) struct LoopValues {
    links: Vec<Iterated>,
    /// Subsystems of the loop.
    members: Vec<usize>,
    /// Subsystems that feed it within the step and are no part of it.
    sources: Vec<usize>,
    /// Whether an input of it is integrated: only then quarters are worth it.
    integrates: bool,
    /// Why trials are whole steps; empty: they are made of quarters.
    why_whole: String,
    /// Connections whose values are looked at: those that are iterated, then those that pass outputs of its parts on within the step.
    watched: Vec<usize>,
    /// Whether trials of this step are made of quarters.
    by_quarters: bool,
    /// Values at the start of the step.
    start: Vec<f64>,
    /// Values that the trial was made with: at the end of the step and, by quarters, then those in the middle.
    guess: Vec<f64>,
    /// Values of the watched connections at the start, after each of the first three quarters of the trial and at its end.
    seen: [Vec<f64>; 5],
    /// Whether a subsystem did not move in a quarter of the trial, but in the step.
    lags: bool,
    /// Largest difference relative to the largest value at the last trial.
    off: f64,
    /// Trials in a row that did not halve it.
    stuck: u32,
    /// Size of the values at start and first trial.
    scale: Vec<f64>,
    /// Differences of the outputs and the guess at the last trial.
    missed: Vec<f64>,
    newton: Newton,
    acceleration: Acceleration,
}

impl LoopValues {
    /// Of the iterated connections among `numbers` to the members of a loop; `cannot` says why a subsystem makes no steps of a quarter of the length.
    pub fn new(
        numbers: Vec<usize>,
        links: &Links,
        feed_through: &FeedThroughs,
        [members, sources]: [Vec<usize>; 2],
        cannot: impl Fn(usize) -> Option<String>,
    ) -> Self {
        let takes_end = |link: &Link| link.ends().map(|([_, to], _)| feed_through.takes_end(to)).collect();
        let newton = Newton::new(numbers.iter().copied(), links, &members);
        let at_ends = numbers.iter().any(|k| links.numbers[*k].is_iterated_at_ends());
        let own: Vec<Iterated> = numbers
            .into_iter()
            .map(|link| Iterated { link, takes_end: takes_end(&links.numbers[link]) })
            .collect();
        let integrates = own.iter().any(|i| i.takes_end.contains(&false));
        let why_whole = match members.iter().chain(&sources).find_map(|slot| cannot(*slot)) {
            _ if at_ends => "as `iterate-ends` asks".to_owned(),
            Some(why) => format!("as {why}"),
            None => String::new(),
        };
        let is_part = |slot: usize| members.contains(&slot) || sources.contains(&slot);
        let passed = links.numbers.iter().enumerate();
        let passed = passed.filter(|(_, link)| link.is_within_the_step() && is_part(link.slots()[0]));
        let watched = own.iter().map(|i| i.link).chain(passed.map(|(k, _)| k)).collect();
        Self {
            newton,
            links: own,
            members,
            sources,
            integrates,
            why_whole,
            watched,
            by_quarters: false,
            start: Vec::new(),
            guess: Vec::new(),
            seen: Default::default(),
            lags: false,
            off: f64::INFINITY,
            stuck: 0,
            scale: Vec::new(),
            missed: Vec::new(),
            acceleration: Acceleration::new(Relaxation::Anderson, 1.0),
        }
    }

    /// Subsystems of it and those that feed it.
    pub fn parts(&self) -> impl Iterator<Item = usize> + '_ {
        self.members.iter().chain(&self.sources).copied()
    }

    /// Whether an input of it is integrated.
    pub fn integrates(&self) -> bool {
        self.integrates
    }

    /// Whether its steps are always whole, and why.
    pub fn why_whole(&self) -> Option<&str> {
        (!self.why_whole.is_empty()).then_some(&self.why_whole)
    }

    /// Makes its steps whole, for a reason.
    pub fn make_whole(&mut self, why: String) {
        self.why_whole = why;
    }

    /// How it is solved, in words.
    pub fn way(&self, instances: &[Instance]) -> String {
        let newton = self.newton.way(instances, &self.members);
        match self.why_whole.as_str() {
            "" => format!("{newton}; values are exchanged in the middle of the step, too, in quarters of it"),
            why => format!("{newton}; values are exchanged at its end only, {why}"),
        }
    }

    /// Subsystems of the loop.
    pub fn members(&self) -> &[usize] {
        &self.members
    }

    /// Whether trials of this step are made of quarters.
    pub fn goes_by_quarters(&self) -> bool {
        self.by_quarters
    }

    /// Whether a subsystem has a solver step of its own that is longer than a quarter of the step.
    pub fn lags(&self) -> bool {
        self.lags
    }

    /// Keeps the values at the start of the step; the first trial is a whole step that is made with them.
    ///
    /// # Errors
    /// A value that a subsystem cannot give.
    pub fn begin(&mut self, links: &mut Links, instances: &[Instance]) -> Result {
        self.start.clear();
        for own in &self.links {
            let link = &mut links.numbers[own.link];
            link.learn();
            self.start.extend((0..link.count()).map(|k| link.value(k)));
        }
        self.guess.clone_from(&self.start);
        if self.why_whole.is_empty() {
            read(&self.watched[self.links.len()..], links, instances, &mut self.seen[1])?;
            let Self { start, seen: [first, passed, ..], .. } = self;
            first.clone_from(start);
            first.extend_from_slice(passed);
        }
        self.scale.clear();
        self.restart(false);
        Ok(())
    }

    /// Makes the connections show the values at the start of the step.
    pub fn back(&self, links: &mut Links) {
        let mut start = self.start.iter();
        for own in &self.links {
            let link = &mut links.numbers[own.link];
            (0..link.count()).zip(&mut start).for_each(|(k, value)| *link.value_mut(k) = *value);
        }
    }

    /// From now on in whole steps until the end of this one.
    pub fn go_whole(&mut self) {
        self.guess.truncate(self.start.len());
        self.scale.truncate(self.start.len());
        self.restart(false);
    }

    /// Trials from now on are of one kind, and those before are no guide to them.
    fn restart(&mut self, by_quarters: bool) {
        (self.by_quarters, self.lags, self.off, self.stuck) = (by_quarters, false, f64::INFINITY, 0);
        self.acceleration.begin();
    }

    /// Takes the outputs after one of the first three quarters of a trial, from 0 on.
    ///
    /// # Errors
    /// A value that a subsystem cannot give.
    pub fn take_within(&mut self, quarter: usize, links: &mut Links, instances: &[Instance]) -> Result {
        read(&self.watched, links, instances, &mut self.seen[quarter + 1])
    }

    /// Whether the outputs are those that the trial was made with; if not, a better guess is there.
    ///
    /// # Errors
    /// A value that a subsystem cannot give.
    pub fn stands(&mut self, links: &mut Links, instances: &[Instance]) -> Result<bool> {
        let n = self.start.len();
        let watched = if self.by_quarters { &self.watched[..] } else { &self.watched[..self.links.len()] };
        read(watched, links, instances, &mut self.seen[4])?;
        let (own, residual) = (&self.links, self.acceleration.residual());
        residual.clear();
        residual.extend_from_slice(&self.seen[4][..n]);
        let first = self.scale.is_empty();
        if first {
            own.iter().for_each(|i| links.numbers[i.link].learn());
        }
        if self.by_quarters {
            residual.extend_from_slice(&self.seen[2][..n]);
        }
        let largest: Vec<f64> = own
            .iter()
            .flat_map(|i| {
                let link = &links.numbers[i.link];
                (0..link.count()).map(|k| link.largest(k))
            })
            .collect();
        let (mut off, mut is_small): (f64, bool) = (0.0, true);
        for ((value, guess), largest) in residual.iter_mut().zip(&self.guess).zip(largest.iter().cycle()) {
            let missed = (*value - guess).abs();
            is_small &= missed <= TOLERANCE * value.abs().max(guess.abs()).max(SMALL);
            if missed > 0.0 || missed.is_nan() {
                let size = if *largest > 0.0 { *largest } else { value.abs().max(guess.abs()) };
                off = larger(off, missed / size);
            }
            *value -= guess;
        }
        self.missed.clone_from(residual);
        if first {
            let sizes = self.guess.iter().zip(&*residual).map(|(u, r)| u.abs().max((u + r).abs()).max(1.0));
            self.scale.extend(sizes);
        }
        self.stuck = if off > 0.5 * self.off { self.stuck + 1 } else { 0 };
        self.off = off;
        if off <= TOLERANCE || (is_small && self.stuck >= STUCK) {
            self.lags = self.by_quarters && lags(watched, links, &self.seen);
            return Ok(true);
        }
        self.newton.solve(residual, links, instances)?;
        // values of different units count alike
        let unit = |largest: &f64| if *largest > 0.0 { *largest } else { 1.0 };
        let units = || largest.iter().map(unit).cycle();
        residual.iter_mut().zip(units()).for_each(|(r, unit)| *r /= unit);
        let scaled: Vec<f64> = self.guess.iter().zip(units()).map(|(guess, unit)| guess / unit).collect();
        let step = self.acceleration.step(&scaled);
        self.guess.iter_mut().zip(step).zip(units()).for_each(|((guess, d), unit)| *guess += d * unit);
        Ok(false)
    }

    /// From now on by quarters, where it can; the first guess of the middle is the mean of start and end.
    pub fn begin_quarters(&mut self) {
        if !self.why_whole.is_empty() {
            return;
        }
        self.guess.extend_from_within(..);
        let n = self.start.len();
        let middle = self.guess[n..].iter_mut();
        middle.zip(&self.start).for_each(|(middle, start)| *middle = 0.5 * (*middle + start));
        self.scale.extend_from_within(..);
        self.restart(true);
    }

    /// Whether the guess has left all that start and first trial were of.
    pub fn runs_away(&self) -> bool {
        self.guess.iter().zip(&self.scale).any(|(guess, scale)| guess.abs() > RUNAWAY * scale)
    }

    /// Sets the inputs to what the guess makes of them in a part of the step.
    pub fn set(&self, part: Part, links: &Links, instances: &mut [Instance]) -> Result {
        let mut first = 0;
        for own in &self.links {
            let link = &links.numbers[own.link];
            let entries = first..first + link.count();
            first = entries.end;
            let values: Vec<f64> =
                entries.zip(&own.takes_end).map(|(k, takes_end)| self.input(part, k, *takes_end)).collect();
            link.write(instances, &values)?;
        }
        Ok(())
    }

    /// What an input is held at over a part of the step.
    fn input(&self, part: Part, k: usize, takes_end: bool) -> f64 {
        let (u, e) = (self.start[k], self.guess[k]);
        let Part::Quarter(quarter) = part else { return held(takes_end, u, e) };
        let m = self.guess[self.start.len() + k];
        match (quarter, takes_end) {
            // of the parabola, at the end of the quarter
            (0, true) => (3.0 * u + 6.0 * m - e) / 8.0,
            (1, true) => m,
            (2, true) => (3.0 * e + 6.0 * m - u) / 8.0,
            (_, true) => e,
            (0, false) => (7.0 * u + 8.0 * m - 3.0 * e) / 12.0,
            (1, false) => (3.0 * u + 8.0 * m + e) / 12.0,
            (2, false) => (u + 8.0 * m + 3.0 * e) / 12.0,
            (_, false) => (8.0 * m + 7.0 * e - 3.0 * u) / 12.0,
        }
    }

    /// The largest difference of an output and its guess, its connection, and all connections.
    pub fn worst(&self, links: &Links, instances: &[Instance]) -> (f64, String, Vec<String>) {
        let size = |k: usize| if self.missed[k].is_nan() { f64::INFINITY } else { self.missed[k].abs() };
        let worst = (0..self.missed.len()).max_by(|a, b| size(*a).total_cmp(&size(*b)));
        let names: Vec<String> =
            self.links.iter().flat_map(|own| links.numbers[own.link].names(instances)).collect();
        let name = worst.and_then(|k| names.get(k % names.len().max(1)).cloned());
        (worst.map_or(0.0, size), name.unwrap_or_default(), names)
    }
}

/// Outputs as they are, of some connections.
fn read(numbers: &[usize], links: &mut Links, instances: &[Instance], out: &mut Vec<f64>) -> Result {
    out.clear();
    for k in numbers {
        out.extend_from_slice(links.numbers[*k].read(instances)?);
    }
    Ok(())
}

/// Whether a subsystem leaves all its outputs as they are over a quarter of a step, and changes them in a later one: it has a solver step of its own that is longer
/// than a quarter, so its outputs within the step are not those of their times.
fn lags(numbers: &[usize], links: &Links, values: &[Vec<f64>; 5]) -> bool {
    let ranges = numbers.iter().scan(0, |first, k| {
        let link = &links.numbers[*k];
        let range = *first..*first + link.count();
        *first = range.end;
        Some((link.slots()[0], range))
    });
    let ranges: Vec<_> = ranges.collect();
    ranges.iter().any(|(slot, _)| {
        let all = ranges.iter().filter(|(other, _)| other == slot).flat_map(|(_, range)| range.clone());
        let mut stays = values.windows(2).map(|pair| all.clone().all(|k| pair[0][k] == pair[1][k]));
        stays.any(|stays| stays) && stays.any(|stays| !stays)
    })
}
