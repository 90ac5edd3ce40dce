//! The values of one loop of connections: from the outputs of a trial to the values that the next one is made with.
//!
//! Loops of a run are repeated beside each other, each with its own values: one that is solved keeps them, whatever others still do.
//!
//! A trial is one step of each FMU, or two of half the length. With u the value of an output at the start, in the middle (m) and at the end (e) of
//! the step, an input that is integrated is held at (u + e)/2 over a whole step; over the halves at (3u + 4m − e)/6 and (4m + 3e − u)/6, which
//! have the mean and the first moment of the parabola through the three values: an FMU that integrates the input once or twice makes
//! a step of the fourth order, and, as start and end are treated alike, a loop without damping neither gains nor loses amplitude.

use super::newton::Newton;
use crate::signals::{FeedThroughs, Link, Links, held};
use terraglue_diagnostics::Result;
use terraglue_gluing::acceleration::Acceleration;
use terraglue_host::Instance;
use terraglue_scenario::Relaxation;
use terraglue_subsystem::{Capabilities, ValueType};

/// Largest difference of a value and the one that the step was made with, relative to the larger of it and 1e-3 in its unit.
const TOLERANCE: f64 = 1e-10;

/// Values that grow by this factor beyond those of start and first trial have no solution.
const RUNAWAY: f64 = 1e6;

/// A part of a step that a trial is made of.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(super) enum Part {
    /// All of it.
    Whole,
    /// From its start to its middle.
    FirstHalf,
    /// From its middle to its end.
    SecondHalf,
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
    /// Why trials are whole steps; empty: they are made of halves.
    why_whole: String,
    /// Whether trials of this step are made of halves.
    by_halves: bool,
    /// Values at the start of the step.
    start: Vec<f64>,
    /// Values that the trial was made with: at the end of the step and, by halves, then those in the middle.
    guess: Vec<f64>,
    /// Outputs in the middle of the trial.
    middle: Vec<f64>,
    /// Size of the values at start and first trial.
    scale: Vec<f64>,
    /// Differences of the outputs and the guess at the last trial.
    missed: Vec<f64>,
    newton: Newton,
    acceleration: Acceleration,
}

impl LoopValues {
    /// Of the iterated connections among `numbers` to subsystems of a loop.
    pub fn new(
        numbers: Vec<usize>,
        links: &Links,
        feed_through: &FeedThroughs,
        instances: &[Instance],
        members: Vec<usize>,
    ) -> Self {
        let takes_end = |link: &Link| link.ends().map(|([_, to], _)| feed_through.takes_end(to)).collect();
        let newton = Newton::new(numbers.iter().copied(), links, &members);
        let at_ends = numbers.iter().any(|k| links.numbers[*k].is_iterated_at_ends());
        let own: Vec<Iterated> = numbers
            .into_iter()
            .map(|link| Iterated { link, takes_end: takes_end(&links.numbers[link]) })
            .collect();
        let integrates = own.iter().any(|i| i.takes_end.contains(&false));
        let fixed = members.iter().map(|slot| &instances[*slot]).find_map(makes_no_halves);
        let why_whole = match fixed {
            _ if at_ends => "as `iterate-ends` asks".to_owned(),
            _ if !integrates => "as outputs follow all its values at once".to_owned(),
            Some(why) => why,
            None => String::new(),
        };
        Self {
            newton,
            links: own,
            members,
            why_whole,
            by_halves: false,
            start: Vec::new(),
            guess: Vec::new(),
            middle: Vec::new(),
            scale: Vec::new(),
            missed: Vec::new(),
            acceleration: Acceleration::new(Relaxation::Anderson, 1.0),
        }
    }

    /// How it is solved, in words.
    pub fn way(&self, instances: &[Instance]) -> String {
        let newton = self.newton.way(instances, &self.members);
        match self.why_whole.as_str() {
            "" => format!("{newton}; values are exchanged in the middle of the step, too"),
            why => format!("{newton}; values are exchanged at its end only, {why}"),
        }
    }

    /// Subsystems of the loop.
    pub fn members(&self) -> &[usize] {
        &self.members
    }

    /// Whether trials of this step are made of halves.
    pub fn goes_by_halves(&self) -> bool {
        self.by_halves
    }

    /// Keeps the values at the start of the step; the first trial is a whole step that is made with them.
    pub fn begin(&mut self, links: &Links) {
        let values = |i: &Iterated| {
            let link = &links.numbers[i.link];
            (0..link.count()).map(|k| link.value(k)).collect::<Vec<f64>>()
        };
        self.start = self.links.iter().flat_map(values).collect();
        self.guess.clone_from(&self.start);
        self.by_halves = false;
        self.scale.clear();
        self.acceleration.begin();
    }

    /// Takes the outputs in the middle of a trial.
    pub fn take_middle(&mut self, links: &mut Links, instances: &[Instance]) -> Result {
        read(&self.links, links, instances, &mut self.middle)
    }

    /// Whether the outputs are those that the trial was made with; if not, a better guess is there.
    pub fn stands(&mut self, links: &mut Links, instances: &[Instance]) -> Result<bool> {
        let (own, residual) = (&self.links, self.acceleration.residual());
        read(own, links, instances, residual)?;
        if self.by_halves && stays_until_the_end(own, links, [&self.start, &self.middle, residual]) {
            self.guess.clone_from(residual);
            self.by_halves = false;
            self.acceleration.begin();
            return Ok(false);
        }
        if self.by_halves {
            residual.extend_from_slice(&self.middle);
        }
        let mut stands = true;
        for (value, guess) in residual.iter_mut().zip(&self.guess) {
            stands &= (*value - guess).abs() <= TOLERANCE * value.abs().max(guess.abs()).max(1e-3);
            *value -= guess;
        }
        self.missed.clone_from(residual);
        let first = self.scale.is_empty();
        if first {
            let sizes = self.guess.iter().zip(&*residual).map(|(u, r)| u.abs().max((u + r).abs()).max(1e-3));
            self.scale.extend(sizes);
        }
        if stands {
            return Ok(true);
        }
        self.newton.solve(residual, links, instances)?;
        let step = self.acceleration.step(&self.guess);
        self.guess.iter_mut().zip(step).for_each(|(guess, d)| *guess += d);
        if first && self.why_whole.is_empty() {
            self.begin_halves();
        }
        Ok(false)
    }

    /// From now on by halves; the first guess of the middle is the mean of start and end.
    fn begin_halves(&mut self) {
        self.by_halves = true;
        self.guess.extend_from_within(..);
        let n = self.start.len();
        self.guess[n..]
            .iter_mut()
            .zip(&self.start)
            .for_each(|(middle, start)| *middle = 0.5 * (*middle + start));
        self.scale.extend_from_within(..);
        self.acceleration.begin();
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
        let n = self.start.len();
        let (start, end) = (self.start[k], self.guess[k]);
        match part {
            Part::Whole => held(takes_end, start, end),
            Part::FirstHalf if takes_end => self.guess[n + k],
            Part::SecondHalf if takes_end => end,
            Part::FirstHalf => (3.0 * start + 4.0 * self.guess[n + k] - end) / 6.0,
            Part::SecondHalf => (4.0 * self.guess[n + k] + 3.0 * end - start) / 6.0,
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

/// Outputs as they are.
fn read(own: &[Iterated], links: &mut Links, instances: &[Instance], out: &mut Vec<f64>) -> Result {
    out.clear();
    for i in own {
        out.extend_from_slice(links.numbers[i.link].read(instances)?);
    }
    Ok(())
}

/// Whether a subsystem leaves all its outputs, until the middle of the step, as they were at the start, and changes them at its end: it has a
/// solver step of its own that is longer than half a step, so its outputs in the middle are not those of the middle.
fn stays_until_the_end(own: &[Iterated], links: &Links, [start, middle, end]: [&[f64]; 3]) -> bool {
    let ranges = own.iter().scan(0, |first, i| {
        let link = &links.numbers[i.link];
        let range = *first..*first + link.count();
        *first = range.end;
        Some((link.slots()[0], range))
    });
    let ranges: Vec<_> = ranges.collect();
    ranges.iter().any(|(slot, _)| {
        let mut all = ranges.iter().filter(|(other, _)| other == slot).flat_map(|(_, range)| range.clone());
        all.clone().all(|k| start[k] == middle[k]) && all.any(|k| start[k] != end[k])
    })
}

/// Why a subsystem makes no steps of half the length, if it does not.
fn makes_no_halves(instance: &Instance) -> Option<String> {
    let has_clocks = instance.variables().iter().any(|v| v.value_type == ValueType::Clock);
    let why = match instance.capabilities().has(Capabilities::FIXED_STEP) {
        true => "makes steps of one length only",
        false if has_clocks => "has clocks",
        false => return None,
    };
    Some(format!("as `{}` {why}", instance.name()))
}
