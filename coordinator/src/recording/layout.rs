//! Names of the files in a results folder, and errors that carry them.

use crate::error::Error;
use std::path::Path;

/// Everything simulated.
pub const RECORDING: &str = "recording.mcap";
/// The figures of the run.
pub const SUMMARY: &str = "summary.json";
/// All scalar variables as a table.
pub const VARIABLES: &str = "variables.csv";
/// What a clock measured.
pub const TIMING: &str = "timing.csv";
/// The ground at the end, ESRI ASCII grid.
pub const FINAL_GROUND: &str = "final_ground.asc";
/// The report page.
pub const REPORT: &str = "report.html";

/// Says which file an input/output error is about.
pub(crate) fn at(path: &Path) -> impl Fn(std::io::Error) -> Error + '_ {
    move |source| Error::File { path: path.display().to_string(), source }
}

/// The same for an error of another library.
pub(crate) fn other_at<E>(path: &Path) -> impl Fn(E) -> Error + '_
where
    E: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    move |e| Error::File { path: path.display().to_string(), source: std::io::Error::other(e) }
}

/// Simulated time in nanoseconds, the time stamp of every message.
pub(crate) fn nanoseconds(t_s: f64) -> u64 {
    (t_s * 1e9).round().max(0.0) as u64
}
