//! Areas of tests, and levels of how much is tried.

/// Area of a test.
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
