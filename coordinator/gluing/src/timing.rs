//! Times of the parts of a step: wall time, for `timing.csv` and the benchmark; never in the recording.

use std::time::{Duration, Instant};

/// Parts of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Part {
    /// Events and connections.
    Signals,
    /// Subsystems without glue.
    Uncoupled,
    /// Contact detection (paper, step 1).
    Contact,
    /// `set_ports` of all members (step 1).
    Ports,
    /// `estimate_forces` (step 2).
    Estimate,
    /// `solve_compatibility` and trials of the grounds (step 3).
    Grounds,
    /// Trials of the bodies (step 4).
    Bodies,
    /// Interface Jacobians.
    Jacobian,
    /// `commit` of the bodies (step 5).
    CommitBodies,
    /// `commit` of the grounds (step 5): where material moves.
    CommitGrounds,
    /// The world takes over what has moved, for those that see it.
    World,
    /// `observe` of all that see, with their rays.
    Observe,
    /// Observers of the run: the recording.
    Observers,
}

impl Part {
    /// All parts with their names in tables.
    pub const ALL: [(Self, &'static str); 13] = [
        (Self::Signals, "signals"),
        (Self::Uncoupled, "unglued"),
        (Self::Contact, "contact"),
        (Self::Ports, "set_ports"),
        (Self::Estimate, "estimate_forces"),
        (Self::Grounds, "grounds"),
        (Self::Bodies, "bodies"),
        (Self::Jacobian, "jacobian"),
        (Self::CommitBodies, "commit_bodies"),
        (Self::CommitGrounds, "commit_grounds"),
        (Self::World, "world"),
        (Self::Observe, "observe"),
        (Self::Observers, "observers"),
    ];
}

/// Sums by part.
#[derive(Clone, Debug, Default)]
pub struct Timings {
    sums: [Duration; Part::ALL.len()],
}

impl Timings {
    /// The time since `start` counts `times` for `part`; nothing where no watch was started.
    pub fn charge_sample(&mut self, part: Part, start: Option<Instant>, times: u32) {
        if let Some(start) = start {
            self.sums[part as usize] += start.elapsed() * times;
        }
    }

    /// The time since `start` goes to the account of `part`.
    pub fn charge(&mut self, part: Part, start: Instant) {
        self.sums[part as usize] += start.elapsed();
    }

    /// Adds the sums of another account.
    pub fn add(&mut self, other: &Self) {
        for (sum, more) in self.sums.iter_mut().zip(&other.sums) {
            *sum += *more;
        }
    }

    /// Name and sum of every part, s.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        Part::ALL.iter().map(|(part, name)| (*name, self.sums[*part as usize].as_secs_f64()))
    }
}
