//! Errors of the coordinator, split by whose turn it is: the author of the input, or the simulation.

/// Errors that stop a run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scenario or another input is wrong (exit code 2). Rendered with file, line and the offending text.
    #[error(transparent)]
    Input(#[from] Box<crate::InputError>),
    /// A subsystem failed (exit code 1).
    #[error("{subsystem} ({module}): {function} failed at t = {} s: {message}", nanosecond(*time_s))]
    Module {
        /// Name in the scenario.
        subsystem: String,
        /// Module name.
        module: String,
        /// Function of the interface.
        function: &'static str,
        /// Simulated time, s.
        time_s: f64,
        /// Its message.
        message: String,
    },
    /// A glued subsystem cannot go to the end of the step; the testbed repeats it with half the length.
    #[error("`{subsystem}` ended the step early in {function}, at t = {} s", nanosecond(*reached_s))]
    Early {
        /// Name in the scenario.
        subsystem: String,
        /// Function of the interface.
        function: &'static str,
        /// How far it went, s.
        reached_s: f64,
    },
    /// The gluing did not converge (exit code 1).
    #[error("gluing by `{strategy}` did not converge at t = {} s: {message}", nanosecond(*time_s))]
    NotConverged {
        /// Strategy.
        strategy: &'static str,
        /// Simulated time, s.
        time_s: f64,
        /// Residual, port and advice.
        message: String,
    },
    /// The simulation cannot go on for another reason (exit code 1).
    #[error("simulation failed at t = {} s: {message}", nanosecond(*time_s))]
    Simulation {
        /// Simulated time, s.
        time_s: f64,
        /// Description of the failure.
        message: String,
    },
    /// There is no room for a file of the run (exit code 1).
    #[error("{path}: {source}; {free} are free there; the run is kept up to t = {} s", nanosecond(*kept_s))]
    Full {
        /// Path as the user knows it.
        path: String,
        /// Room on its disk.
        free: String,
        /// Simulated time up to which all was written, s.
        kept_s: f64,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A file could not be read or written (exit code 2 where its path is wrong, else 1).
    #[error("{path}: {source}")]
    File {
        /// Path as the user knows it.
        path: String,
        /// Why.
        source: std::io::Error,
    },
}

/// Words of an error of a module in a process of its own that is gone.
pub const LOST: &str = "its process was lost";

/// A time without the rounding of steps that were added up: 0.172 and not 0.17200000000000001.
fn nanosecond(t_s: f64) -> f64 {
    (t_s * 1e9).round() / 1e9
}

impl Error {
    /// The way out, where there is one that fits every cause.
    pub fn help(&self) -> Option<&'static str> {
        use std::io::ErrorKind::{FileTooLarge, NotFound, PermissionDenied};
        match self {
            Self::Full { source, .. } if source.kind() == FileTooLarge => {
                Some("raise the limit of the shell (ulimit -f), or record less often: recording.every_steps")
            }
            Self::Full { .. } => Some(
                "free some room, name a folder elsewhere with --out, or record less often: recording.every_steps",
            ),
            Self::File { source, .. } => Some(match source.kind() {
                NotFound => "look whether the path is right",
                PermissionDenied => "look at the permissions of the file and of its folder",
                _ => "look at the file and at its folder, or name another one",
            }),
            Self::Module { module, message, .. } => {
                Some(match (module.ends_with(".fmu"), message.contains(LOST)) {
                    (false, false) => {
                        "`terraglue check-module` puts a module to the test, `isolate = true` keeps it apart"
                    }
                    (false, true) => "`terraglue check-module` puts a module to the test",
                    (true, false) => {
                        "`trace = \"calls.txt\"` in the table of an FMU writes down its calls, `isolate = true` keeps it apart"
                    }
                    (true, true) => "`trace = \"calls.txt\"` in the table of an FMU writes down its calls",
                })
            }
            _ => None,
        }
    }
}

/// Result with the coordinator's error.
pub type Result<T = ()> = std::result::Result<T, Error>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_said_without_rounding() {
        let time_s = (0..86).fold(0.0, |t, _| t + 0.002);
        let error = Error::Simulation { time_s, message: "buried".into() };
        assert_eq!(error.to_string(), "simulation failed at t = 0.172 s: buried");
    }
}
