//! Names of the files in a results folder, and errors that carry them.

use crate::space::RESERVE;
use std::fs::Permissions;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};

/// Everything simulated.
pub const RECORDING: &str = "recording.mcap";
/// The figures of the run.
pub const SUMMARY: &str = "summary.json";
/// All scalar variables as a table.
pub const VARIABLES: &str = "variables.csv";
/// Measured wall times.
pub const TIMING: &str = "timing.csv";
/// How values went round.
pub const EXCHANGE: &str = "exchange.json";
/// The ground at the end, ESRI ASCII grid.
pub const FINAL_GROUND: &str = "final_ground.asc";
/// A layout for Foxglove and Lichtblick.
pub const VIEWER_LAYOUT: &str = "viewer_layout.json";
/// The report page.
pub const REPORT: &str = "report.html";

/// State from which a run resumes that was ended from outside.
pub const CHECKPOINT: &str = "checkpoint.bin";

/// Removes the files of an earlier run, so that none of them stays beside the new ones. Touches nothing in a
/// folder that holds no run.
pub(crate) fn remove_earlier_run(folder: &Path) -> Result {
    if ![RECORDING, SUMMARY].iter().any(|f| folder.join(f).exists()) {
        return Ok(());
    }
    const FILES: [&str; 10] = [
        VARIABLES,
        REPORT,
        SUMMARY,
        TIMING,
        EXCHANGE,
        FINAL_GROUND,
        RESERVE,
        VIEWER_LAYOUT,
        CHECKPOINT,
        RECORDING,
    ];
    for path in FILES.map(|f| folder.join(f)) {
        if path.exists() {
            std::fs::remove_file(&path).map_err(at(&path))?;
        }
    }
    Ok(())
}

/// Writes a file beside `path` and puts it in its place: at any moment there is one whole file, also when several
/// processes write it at once.
///
/// # Errors
/// The file cannot be written; what was there stays.
pub fn replace(path: &Path, content: &[u8]) -> std::io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".");
    let mut part = tempfile::Builder::new();
    part.prefix(&name).suffix(".part").permissions(Permissions::from_mode(0o666));
    let mut part = part.tempfile_in(folder)?;
    part.write_all(content)?;
    part.as_file().sync_data()?;
    part.persist(path).map(drop).map_err(|error| error.error)
}

/// Says which file an input/output error is about.
pub fn at(path: &Path) -> impl Fn(std::io::Error) -> Error + '_ {
    move |source| Error::File { path: path.display().to_string(), source }
}

/// The same for an error of another library.
pub fn other_at<E>(path: &Path) -> impl Fn(E) -> Error + '_
where
    E: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    move |e| Error::File { path: path.display().to_string(), source: std::io::Error::other(e) }
}

/// Simulated time in nanoseconds, the time stamp of every message.
pub fn nanoseconds(t_s: f64) -> u64 {
    (t_s * 1e9).round().max(0.0) as u64
}

/// Simulated time as viewers write it.
pub(crate) fn timestamp(t_s: f64) -> foxglove::messages::Timestamp {
    let now = nanoseconds(t_s);
    let seconds = u32::try_from(now / 1_000_000_000).unwrap_or(u32::MAX);
    foxglove::messages::Timestamp::new(seconds, (now % 1_000_000_000) as u32)
}
