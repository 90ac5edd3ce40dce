//! `terraglue fmu run --isolate`: the same command in a process of its own.

use super::Exit;
use super::arguments::FmuRunArguments;
use super::interrupt::Interrupt;
use rustix::process::{Signal, set_parent_process_death_signal};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use terraglue_diagnostics::{Error, Result};
use terraglue_fmi::Folder;
use terraglue_host::isolation::{end_group, last_words};
use terraglue_scenario::InputError;

/// How often to look whether it has ended.
const LOOK: Duration = Duration::from_millis(5);

/// Variable with the file that a command writes when it has done all of its work.
const DONE: &str = "TERRAGLUE_DONE";

/// Whether another process waits for this one and tells how it ended.
pub fn is_child() -> bool {
    std::env::var_os(DONE).is_some()
}

/// Ends with the process that waits for this one, whatever ends it.
pub fn end_with_parent() {
    // Where the system does not know it, a signal to the group ends both.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
}

/// Tells the process that waits for this one, if there is one, that all was done and said, with this exit code.
pub fn done(code: u8) {
    if let Some(path) = std::env::var_os(DONE) {
        // Where it cannot be written, the process counts as lost.
        drop(std::fs::write(path, code.to_string()));
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
    let interrupt = Interrupt::listen();
    interrupt.run();
    let stopped = interrupt.flag();
    let folder = Folder::new("worker").map_err(|e| failed(&e))?;
    let own = std::env::current_exe().map_err(|e| failed(&e))?;
    let words = std::env::args_os().skip(1).filter(|word| word != "--isolate");
    let mut child = Command::new(own)
        .args(words)
        .env("TMPDIR", folder.path())
        .env(DONE, folder.path().join(DONE))
        .process_group(0)
        .spawn()
        .map_err(|e| failed(&e))?;
    let end = Instant::now() + Duration::from_secs_f64(arguments.timeout.min(1e7));
    let status = loop {
        match child.try_wait().map_err(|e| failed(&e))? {
            Some(status) => break Some(status),
            None if stopped.load(Ordering::Relaxed) => {
                end_group(child.id());
                drop(child.wait());
                return Ok(Exit::Interrupted);
            }
            None if Instant::now() >= end => break None,
            None => std::thread::sleep(LOOK),
        }
    };
    end_group(child.id());
    drop(child.wait());
    let lost = |why: &str| {
        let reached = std::fs::read_to_string(folder.path().join(REACHED));
        let reached = reached.ok().filter(|t| !t.is_empty());
        let when = reached.map_or_else(|| "before its first row".to_owned(), |t| format!("after t = {t} s"));
        eprintln!("error: {}: its process was lost {when}: {why}", arguments.fmu.display());
        Exit::Failed
    };
    let Some(status) = status else {
        return Ok(lost(&format!("it did not end within {} s (--timeout) and was ended", arguments.timeout)));
    };
    // How it ended is believed where the command itself says so: its errors are told then.
    let said = std::fs::read_to_string(folder.path().join(DONE)).ok().and_then(|t| t.parse().ok());
    Ok(match status.code().filter(|code| said == Some(*code)) {
        Some(0) => Exit::Done,
        Some(1) => Exit::Failed,
        Some(2) => Exit::WrongInput,
        Some(130) => Exit::Interrupted,
        _ => lost(&last_words(status)),
    })
}
