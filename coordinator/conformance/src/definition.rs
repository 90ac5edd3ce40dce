//! What a named test is: its area, from which level on it runs, and what it does.

use super::finding::Verdict;
use super::test_context::TestContext;
use terraglue_subsystem::Kind;

/// What a test is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Area {
    Library,
    LifeCycle,
    Values,
    State,
    Numbers,
    Physics,
    Resources,
}

impl Area {
    /// As people write it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Library => "library",
            Self::LifeCycle => "life cycle",
            Self::Values => "values",
            Self::State => "state",
            Self::Numbers => "numbers",
            Self::Physics => "physics",
            Self::Resources => "resources",
        }
    }
}

/// How much is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Seconds: what a reload or an editor waits for.
    Quick,
    /// Everything once.
    Standard,
    /// Everything, with many more cases.
    Thorough,
}

impl Level {
    /// All.
    pub const ALL: [Self; 3] = [Self::Quick, Self::Standard, Self::Thorough];

    /// As a word of the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Standard => "standard",
            Self::Thorough => "thorough",
        }
    }
}

/// A named test.
pub struct Test {
    /// Name, unique.
    pub name: &'static str,
    /// What it is about.
    pub area: Area,
    /// From which level on it is run.
    pub level: Level,
    /// Kinds of modules that it is for; empty: all.
    pub kinds: &'static [Kind],
    /// Tests that it builds on.
    pub after: &'static [&'static str],
    /// The promise, in one line.
    pub promise: &'static str,
    /// Does it.
    pub run: fn(&TestContext) -> Verdict,
}
