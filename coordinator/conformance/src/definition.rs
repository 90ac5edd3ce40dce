//! Definition of a named test: its properties and its function.

use super::finding::Verdict;
use super::scope::{Area, Level};
use super::test_context::TestContext;
use terraglue_subsystem::Kind;

/// A named test.
#[derive(Clone, Copy)]
pub struct Test {
    /// Name, unique.
    pub name: &'static str,
    /// Its area.
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
