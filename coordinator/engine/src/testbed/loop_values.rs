//! The values of one loop of connections: from the outputs of a trial to the values that the next one is made with.
//!
//! Loops of a run are repeated beside each other, each with its own values: one that is solved keeps them, whatever others still do.

use super::newton::Newton;
use crate::signals::{FeedThroughs, Link, Links, held};
use terraglue_diagnostics::Result;
use terraglue_gluing::acceleration::Acceleration;
use terraglue_host::Instance;
use terraglue_scenario::Relaxation;

/// Largest difference of a value and the one that the step was made with, relative to the larger of it and 1e-3 in its unit.
const TOLERANCE: f64 = 1e-10;

/// Values that grow by this factor beyond those of start and first trial have no solution.
const RUNAWAY: f64 = 1e6;

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
    /// Values at the start of the step, and those that the trial was made with.
    start: Vec<f64>,
    guess: Vec<f64>,
    /// Size of the values at start and first trial.
    scale: Vec<f64>,
    /// Differences of the outputs and the guess at the last trial.
    missed: Vec<f64>,
    newton: Newton,
    acceleration: Acceleration,
}

impl LoopValues {
    /// Of the iterated connections among `numbers` to subsystems of a loop.
    pub fn new(numbers: Vec<usize>, links: &Links, feed_through: &FeedThroughs, members: Vec<usize>) -> Self {
        let takes_end = |link: &Link| link.ends().map(|([_, to], _)| feed_through.takes_end(to)).collect();
        Self {
            newton: Newton::new(numbers.iter().copied(), links, &members),
            links: numbers
                .into_iter()
                .map(|link| Iterated { link, takes_end: takes_end(&links.numbers[link]) })
                .collect(),
            members,
            start: Vec::new(),
            guess: Vec::new(),
            scale: Vec::new(),
            missed: Vec::new(),
            acceleration: Acceleration::new(Relaxation::Anderson, 1.0),
        }
    }

    /// How it is solved, in words.
    pub fn way(&self, instances: &[Instance]) -> String {
        self.newton.way(instances, &self.members)
    }

    /// Subsystems of the loop.
    pub fn members(&self) -> &[usize] {
        &self.members
    }

    /// Keeps the values at the start of the step; the first trial is made with them.
    pub fn begin(&mut self, links: &Links) {
        let values = |i: &Iterated| {
            let link = &links.numbers[i.link];
            (0..link.count()).map(|k| link.value(k)).collect::<Vec<f64>>()
        };
        self.start = self.links.iter().flat_map(values).collect();
        self.guess.clone_from(&self.start);
        self.scale.clear();
        self.acceleration.begin();
    }

    /// Whether the outputs are those that the trial was made with; if not, a better guess is there.
    pub fn stands(&mut self, links: &mut Links, instances: &[Instance]) -> Result<bool> {
        let residual = self.acceleration.residual();
        residual.clear();
        let mut stands = true;
        for own in &self.links {
            for value in links.numbers[own.link].read(instances)? {
                let guess = self.guess[residual.len()];
                stands &= (value - guess).abs() <= TOLERANCE * value.abs().max(guess.abs()).max(1e-3);
                residual.push(value - guess);
            }
        }
        self.missed.clone_from(residual);
        if self.scale.is_empty() {
            let sizes = self.guess.iter().zip(&*residual).map(|(u, r)| u.abs().max((u + r).abs()).max(1e-3));
            self.scale.extend(sizes);
        }
        if !stands {
            self.newton.solve(residual, links, instances)?;
            let step = self.acceleration.step(&self.guess);
            self.guess.iter_mut().zip(step).for_each(|(guess, d)| *guess += d);
        }
        Ok(stands)
    }

    /// Whether the guess has left all that start and first trial were of.
    pub fn runs_away(&self) -> bool {
        self.guess.iter().zip(&self.scale).any(|(guess, scale)| guess.abs() > RUNAWAY * scale)
    }

    /// Sets the inputs to what the guess makes of them.
    pub fn set(&self, links: &Links, instances: &mut [Instance]) -> Result {
        let mut first = 0;
        for own in &self.links {
            let link = &links.numbers[own.link];
            let pairs = self.start[first..].iter().zip(&self.guess[first..]).take(link.count());
            let pairs = pairs.zip(&own.takes_end);
            let values: Vec<f64> =
                pairs.map(|((start, end), takes_end)| held(*takes_end, *start, *end)).collect();
            link.write(instances, &values)?;
            first += link.count();
        }
        Ok(())
    }

    /// The largest difference of an output and its guess, its connection, and all connections.
    pub fn worst(&self, links: &Links, instances: &[Instance]) -> (f64, String, Vec<String>) {
        let size = |k: usize| if self.missed[k].is_nan() { f64::INFINITY } else { self.missed[k].abs() };
        let worst = (0..self.missed.len()).max_by(|a, b| size(*a).total_cmp(&size(*b)));
        let names: Vec<String> =
            self.links.iter().flat_map(|own| links.numbers[own.link].names(instances)).collect();
        (worst.map_or(0.0, size), worst.and_then(|k| names.get(k).cloned()).unwrap_or_default(), names)
    }
}
