//! `terraglue fmu run --isolate`: the same command in a process of its own.

use super::Exit;
use super::arguments::FmuRunArguments;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use terraglue::host::isolation::{end_group, last_words};
use terraglue::scenario::InputError;
use terraglue::{Error, Result};

/// How often to look whether it has ended.
const LOOK: Duration = Duration::from_millis(5);

/// Variable with the file that a command writes when it has done all of its work.
const DONE: &str = "TERRAGLUE_DONE";

/// Whether another process waits for this one and tells how it ended.
pub fn is_child() -> bool {
    std::env::var_os(DONE).is_some()
}

/// Tells the process that waits for this one, if there is one, that all is done.
pub fn done() {
    if let Some(path) = std::env::var_os(DONE) {
        // Where it cannot be written, the run counts as failed.
        drop(std::fs::write(path, ""));
    }
}

/// File with the time of the last row.
const REACHED: &str = "reached";

/// Tells the process that waits for this one how far it has come: the row that is written now.
pub fn reached(row: &str) {
    let time = row.split(',').next().filter(|t| t.parse::<f64>().is_ok());
    if let (Some(path), Some(time)) = (std::env::var_os(DONE), time) {
        // It is missed only where the process is lost.
        drop(std::fs::write(Path::new(&path).with_file_name(REACHED), time));
    }
}

/// Runs the command again without `--isolate` and says how it ended.
pub fn run(arguments: &FmuRunArguments) -> Result<Exit> {
    let failed =
        |what: &dyn std::fmt::Display| Error::from(InputError::plain(format!("isolation: {what}"), None));
    let folder = tempfile::Builder::new().prefix("terraglue-worker-").tempdir().map_err(|e| failed(&e))?;
    let own = std::env::current_exe().map_err(|e| failed(&e))?;
    let words = std::env::args_os().skip(1).filter(|word| word != "--isolate");
    let mut child = Command::new(own)
        .args(words)
        .env("TMPDIR", folder.path())
        .env(DONE, folder.path().join(DONE))
        .process_group(0)
        .spawn()
        .map_err(|e| failed(&e))?;
    let end = Instant::now() + Duration::from_secs_f64(arguments.timeout.clamp(0.0, 1e7));
    let status = loop {
        match child.try_wait().map_err(|e| failed(&e))? {
            Some(status) => break Some(status),
            None if Instant::now() >= end => break None,
            None => std::thread::sleep(LOOK),
        }
    };
    end_group(child.id());
    drop(child.wait());
    let lost = |why: &str| {
        let reached = std::fs::read_to_string(folder.path().join(REACHED));
        let when = reached.map_or_else(|_| "before its first row".to_owned(), |t| format!("after t = {t} s"));
        eprintln!("error: {}: its process was lost {when}: {why}", arguments.unit.display());
        Exit::Failed
    };
    let Some(status) = status else {
        return Ok(lost(&format!("it did not end within {} s (--timeout) and was ended", arguments.timeout)));
    };
    // Its own errors are told already; success is believed where the command itself says so.
    Ok(match status.code() {
        Some(0) if folder.path().join(DONE).is_file() => Exit::Done,
        Some(1) => Exit::Failed,
        Some(2) => Exit::WrongInput,
        _ => lost(&last_words(status)),
    })
}
