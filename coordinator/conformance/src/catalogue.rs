//! All tests.

use super::areas;
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

/// All tests in an order in which every test comes after those that it builds on.
pub fn catalogue() -> &'static [Test] {
    static ALL: std::sync::OnceLock<Vec<Test>> = std::sync::OnceLock::new();
    ALL.get_or_init(|| areas::ALL.iter().flat_map(|list| list()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_what_a_test_builds_on_comes_before_it() {
        let mut seen: Vec<&str> = Vec::new();
        for test in catalogue() {
            assert!(!seen.contains(&test.name), "{} twice", test.name);
            for before in test.after {
                assert!(
                    seen.contains(before),
                    "{} builds on {before}, which does not come before it",
                    test.name
                );
            }
            seen.push(test.name);
        }
    }
}
