//! Errors of FMUs, by the part that has to be mended: archive, description, library, behaviour.

use std::path::PathBuf;

/// Why an FMU cannot be used or does not go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The archive is refused before anything of it is written or run.
    #[error("{}: {}{message}", path.display(), entry.as_ref().map(|e| format!("entry `{e}`: ")).unwrap_or_default())]
    Archive {
        /// File.
        path: PathBuf,
        /// Entry of the archive.
        entry: Option<String>,
        /// Description of the problem.
        message: String,
    },
    /// `modelDescription.xml` breaks the standard.
    #[error("{}: {file}:{line}: <{element}>: {message}", path.display())]
    Description {
        /// File.
        path: PathBuf,
        /// File inside the archive.
        file: &'static str,
        /// Line, from 1.
        line: u32,
        /// Element.
        element: String,
        /// Description of the problem.
        message: String,
    },
    /// It is a good FMU, but of a kind that is not run here.
    #[error("{}: {message}", path.display())]
    Unsupported {
        /// File.
        path: PathBuf,
        /// Kind of FMU that it is.
        message: String,
    },
    /// Its shared library is missing or cannot be loaded.
    #[error("{}: {message}", path.display())]
    Library {
        /// File.
        path: PathBuf,
        /// Description of the problem.
        message: String,
    },
    /// A function did not succeed.
    #[error("{function} {outcome}{}", said(log))]
    Call {
        /// Function of the C interface.
        function: &'static str,
        /// Status, or another fault of its answer.
        outcome: String,
        /// Last lines that the FMU logged.
        log: Vec<String>,
        /// Whether nothing of the instance may be called any more.
        fatal: bool,
    },
    /// `doStep` refused the step as too long.
    #[error("{function} discarded the step; it came to t = {reached} s{}", said(log))]
    Discard {
        /// Function of the C interface.
        function: &'static str,
        /// Last successful time, s.
        reached: f64,
        /// Last lines that the FMU logged.
        log: Vec<String>,
    },
    /// The FMU does not offer the requested function.
    #[error("{0}")]
    Refused(String),
    /// A name, value or time that the caller gave does not fit the FMU.
    #[error("{0}")]
    WrongInput(String),
}

/// Result with this crate's error.
pub type Result<T = ()> = std::result::Result<T, Error>;

fn said(log: &[String]) -> String {
    match log {
        [] => String::new(),
        lines => format!("; it says: {}", lines.join(" | ")),
    }
}
