//! Results of tests: findings and outcomes.

use serde::{Deserialize, Serialize};

/// A promise that a module does not keep: which call, what went in, what came back, what was expected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// Function of the interface, or what the host did.
    pub call: String,
    /// The input.
    pub given: String,
    /// The answer.
    pub got: String,
    /// The expected answer.
    pub expected: String,
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}; given {}; expected {}", self.call, self.got, self.given, self.expected)
    }
}

/// Why a test did not end with a pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// A promise is broken.
    Fail(Finding),
    /// The test does not apply; the text says what the module misses by that.
    Skip(String),
    /// Nothing is broken, but somebody should look.
    Warning(String),
}

/// Result of a test.
pub type Verdict<T = ()> = Result<T, Stop>;

/// Expectation where a call was refused.
pub const ANSWER: &str = "an answer";

impl Stop {
    /// A broken promise.
    pub fn fail(
        call: impl Into<String>,
        given: impl Into<String>,
        got: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Fail(Finding {
            call: call.into(),
            given: given.into(),
            got: got.into(),
            expected: expected.into(),
        })
    }
}

impl From<terraglue_diagnostics::Error> for Stop {
    fn from(error: terraglue_diagnostics::Error) -> Self {
        match error {
            terraglue_diagnostics::Error::Module { function, time_s, message, .. } => {
                Self::fail(function, format!("t = {time_s} s"), message, ANSWER)
            }
            other => Self::fail("a step", "the scripted run", other.to_string(), ANSWER),
        }
    }
}

/// How a test ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "outcome", rename_all = "lowercase")]
pub enum Outcome {
    /// Every promise was kept.
    Pass,
    /// One was not.
    Fail {
        /// Which.
        finding: Finding,
    },
    /// The process ended before the test did.
    Crash {
        /// By what.
        how: String,
    },
    /// The time limit was reached.
    Hang {
        /// The limit, s.
        limit_s: f64,
    },
    /// Does not apply, and what the module misses by that.
    Skip {
        /// Why.
        why: String,
    },
    /// Nothing is broken, but somebody should look.
    Warning {
        /// At what.
        what: String,
    },
    /// A test that it builds on did not pass.
    Blocked {
        /// That test.
        by: String,
    },
    /// Switched off by the file beside the module.
    Off {
        /// The reason given there.
        reason: String,
    },
}

impl Outcome {
    /// From the result of a test.
    pub fn of(verdict: Verdict) -> Self {
        match verdict {
            Ok(()) => Self::Pass,
            Err(Stop::Fail(finding)) => Self::Fail { finding },
            Err(Stop::Skip(why)) => Self::Skip { why },
            Err(Stop::Warning(what)) => Self::Warning { what },
        }
    }

    /// One word.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail { .. } => "fail",
            Self::Crash { .. } => "crash",
            Self::Hang { .. } => "hang",
            Self::Skip { .. } => "skip",
            Self::Warning { .. } => "warning",
            Self::Blocked { .. } => "blocked",
            Self::Off { .. } => "off",
        }
    }

    /// The test that blocks it.
    pub fn blocked_by(&self) -> Option<&str> {
        match self {
            Self::Blocked { by } => Some(by),
            _ => None,
        }
    }

    /// Whether the module broke a promise.
    pub fn is_broken(&self) -> bool {
        matches!(self, Self::Fail { .. } | Self::Crash { .. } | Self::Hang { .. })
    }

    /// Whether what builds on this test can be run.
    pub fn carries_on(&self) -> bool {
        !self.is_broken() && !matches!(self, Self::Blocked { .. })
    }

    /// The rest in one line.
    pub fn detail(&self) -> String {
        match self {
            Self::Pass => String::new(),
            Self::Fail { finding } => finding.to_string(),
            Self::Crash { how } => how.clone(),
            Self::Hang { limit_s } => format!("no answer within {limit_s} s"),
            Self::Skip { why } => why.clone(),
            Self::Warning { what } => what.clone(),
            Self::Blocked { by } => format!("blocked by {by}"),
            Self::Off { reason } => format!("switched off: {reason}"),
        }
    }
}
