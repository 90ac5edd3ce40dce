//! Errors of calls. Errors are values: no panic crosses a subsystem's border.

/// Why a call of a subsystem did not succeed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The subsystem does not offer this call, this kind of input or this level.
    #[error("not supported")]
    Unsupported,
    /// The step is too long; the subsystem could go to `reached` (s) only. The host may repeat with a shorter step.
    #[error("step discarded, reached t = {reached} s")]
    Discard {
        /// Time up to which the subsystem could advance, s.
        reached: f64,
    },
    /// A value, name or argument is not acceptable; the subsystem is unchanged and usable.
    #[error("{0}")]
    Refused(String),
    /// The call failed; the committed state is intact.
    #[error("{0}")]
    Failed(String),
    /// The call failed and the instance must not be called again.
    #[error("{0} (fatal)")]
    Fatal(String),
}

/// Result of a call of a subsystem.
pub type Result<T = ()> = std::result::Result<T, Error>;
