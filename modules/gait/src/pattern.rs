//! Gait patterns: which part of the cycle a foot spends on the ground, and how the legs follow each other.
//!
//! Duty factor and phase as defined by McGhee (1968); the wave gait runs from the rear to the front of a side.

use crate::geometry::LEGS;

/// A regular gait of six legs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Pattern {
    /// Three feet swing at a time: LF, RM, LR and then RF, LM, RR.
    Tripod = 0,
    /// Two feet swing at a time, one on either side, both sides half a cycle apart.
    Ripple = 1,
    /// One foot swings at a time.
    Wave = 2,
}

/// Names in the order of [`Pattern::ALL`].
pub const NAMES: [&str; 3] = ["tripod", "ripple", "wave"];

const SIXTH: f64 = 1.0 / 6.0;

impl Pattern {
    /// All patterns in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Tripod, Self::Ripple, Self::Wave];

    /// By name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// Name in scenarios.
    pub fn name(self) -> &'static str {
        NAMES[self as usize]
    }

    /// Part of the cycle that a foot is on the ground.
    pub fn duty(self) -> f64 {
        match self {
            Self::Tripod => 0.55,
            Self::Ripple => 2.0 / 3.0,
            Self::Wave => 5.0 * SIXTH,
        }
    }

    /// Default duration of a cycle, s.
    pub fn cycle_s(self) -> f64 {
        match self {
            Self::Tripod => 1.2,
            Self::Ripple => 1.8,
            Self::Wave => 3.0,
        }
    }

    /// Phase of each leg at the start of a cycle; 0 … duty on the ground, duty … 1 in the air.
    pub fn phases(self) -> [f64; LEGS] {
        match self {
            Self::Tripod => [0.0, 0.5, 0.0, 0.5, 0.0, 0.5],
            Self::Ripple => [4.0 * SIXTH, 2.0 * SIXTH, 0.0, SIXTH, 5.0 * SIXTH, 3.0 * SIXTH],
            Self::Wave => [2.0 * SIXTH, SIXTH, 0.0, 5.0 * SIXTH, 4.0 * SIXTH, 3.0 * SIXTH],
        }
    }
}

terraglue_subsystem::persist!(
    enum Pattern {
        Tripod,
        Ripple,
        Wave,
    }
);
