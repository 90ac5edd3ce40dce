//! `terraglue fmu run --isolate`: the same command in a process of its own.

use super::Exit;
use super::arguments::FmuRunArguments;
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::time::{Duration, Instant};
use terraglue::host::isolation::{end_group, last_words};
use terraglue::scenario::InputError;
use terraglue::{Error, Result};

/// How often to look whether it has ended.
const LOOK: Duration = Duration::from_millis(5);

/// Variable with the file that a command writes when it has done all of its work.
const DONE: &str = "TERRAGLUE_DONE";

/// Tells the process that waits for this one, if there is one, that all is done.
pub fn done() {
    if let Some(path) = std::env::var_os(DONE) {
        // Where it cannot be written, the run counts as failed.
        drop(std::fs::write(path, ""));
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
    let Some(status) = status else {
        return Ok(lost(
            arguments,
            &format!("it did not end within {} s (--timeout) and was ended", arguments.timeout),
        ));
    };
    // Its own errors are told already; success is believed where the command itself says so.
    Ok(match status.code() {
        Some(0) if folder.path().join(DONE).is_file() => Exit::Done,
        Some(1) => Exit::Failed,
        Some(2) => Exit::WrongInput,
        _ => lost(arguments, &last_words(status)),
    })
}

fn lost(arguments: &FmuRunArguments, why: &str) -> Exit {
    eprintln!("error: {}: its process was lost: {why}", arguments.unit.display());
    Exit::Failed
}
