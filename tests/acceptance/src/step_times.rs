//! Cost of a step of the shipped scenarios: by part, and as a whole with and without recording.
//!
//! Runs are equal from the first to the last bit, so every step counts with the least of its times over several runs:
//! other work of the machine is left out. Parts are measured in wall time, the whole in CPU time of the thread.

use crate::{build, shipped};
use terraglue::observer::Observer;
use terraglue::recording::{Recorder, RecorderOptions};
use terraglue::{Result, Testbed};

/// A scenario of the benchmark.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its name in `scenarios/`.
    pub scenario: &'static str,
    /// Module of the soil.
    pub soil: &'static str,
    /// How it is glued.
    pub strategy: &'static str,
}

/// The four combinations of soil and strategy.
pub const COMBINATIONS: [(&str, &str); 4] = [
    ("soil-cellular-automaton", "cooperative"),
    ("soil-cellular-automaton", "iterative"),
    ("soil-bekker", "cooperative"),
    ("soil-bekker", "iterative"),
];

/// The scenarios, each with as many simulated seconds as the benchmark takes.
pub const SCENARIOS: [(&str, f64); 3] = [("moon_walk", 3.0), ("sand_walk", 3.0), ("rover_slope", 0.3)];

/// Name of the row that holds the observers' part.
pub const RECORDING: &str = "recording";
/// Name of the row that holds the whole.
pub const WHOLE: &str = "whole";

/// Times of one part over all steps, µs.
#[derive(Clone, Debug)]
pub struct Row {
    /// Name of the part.
    pub name: &'static str,
    /// Ascending.
    times: Vec<f64>,
}

impl Row {
    /// Mean over the steps.
    pub fn mean(&self) -> f64 {
        self.times.iter().sum::<f64>() / self.times.len().max(1) as f64
    }

    /// The time that this share of the steps does not exceed.
    pub fn quantile(&self, share: f64) -> f64 {
        let place = (share * self.times.len() as f64).ceil() as usize;
        self.times.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    }

    /// The longest.
    pub fn largest(&self) -> f64 {
        self.quantile(1.0)
    }
}

/// CPU time of this thread so far, µs.
fn cpu_us() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    1e6 * t.tv_sec as f64 + 1e-3 * t.tv_nsec as f64
}

/// The parts of a step, recording and the whole, over `seconds` of simulated time; the least of so many runs.
///
/// # Errors
/// The scenario cannot be read or built, or a step fails.
pub fn measure(case: Case, seconds: f64, runs: usize, recorded: bool) -> Result<Vec<Row>> {
    let mut least: Vec<Row> = Vec::new();
    for _ in 0..runs.max(1) {
        let rows = run(case, seconds, recorded)?;
        if least.is_empty() {
            least = rows;
            continue;
        }
        for (least, row) in least.iter_mut().zip(rows) {
            least.times.iter_mut().zip(row.times).for_each(|(a, b)| *a = a.min(b));
        }
    }
    least.iter_mut().for_each(|row| row.times.sort_by(f64::total_cmp));
    Ok(least)
}

/// One run; times in the order of the steps.
fn run(case: Case, seconds: f64, recorded: bool) -> Result<Vec<Row>> {
    let scenario = shipped(case.scenario, &[("soil.module", case.soil), ("gluing.strategy", case.strategy)]);
    let folder = tempfile::tempdir().unwrap_or_else(|e| panic!("no folder for the recording: {e}"));
    let mut testbed = build(&scenario)?;
    let mut recorder = match recorded {
        true => Some(Recorder::create(folder.path(), &scenario, RecorderOptions::default())?),
        false => None,
    };
    testbed.begin()?;
    if let Some(recorder) = &mut recorder {
        testbed.view(|view| recorder.started(view))?;
    }
    let mut rows: Vec<Row> = names(&testbed).map(|name| Row { name, times: Vec::new() }).collect();
    let mut before = sums(&testbed);
    while seconds - testbed.t_s() > 1e-6 {
        let start = cpu_us();
        testbed.step()?;
        let stepped = cpu_us();
        if let Some(recorder) = &mut recorder {
            testbed.view(|view| recorder.stepped(view))?;
        }
        let end = cpu_us();
        let now = sums(&testbed);
        let parts = now.iter().zip(&before).map(|(now, before)| now - before);
        let times = parts.chain([end - stepped, end - start]);
        rows.iter_mut().zip(times).for_each(|(row, time)| row.times.push(time));
        before = now;
    }
    Ok(rows)
}

fn names(testbed: &Testbed) -> impl Iterator<Item = &'static str> {
    let parts: Vec<_> = testbed.timings().rows().map(|(name, _)| name).collect();
    parts.into_iter().chain([RECORDING, WHOLE])
}

/// Sums by part, µs.
fn sums(testbed: &Testbed) -> Vec<f64> {
    testbed.timings().rows().map(|(_, s)| 1e6 * s).collect()
}
