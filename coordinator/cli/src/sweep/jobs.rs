//! The missing cases of a sweep, several at a time, each in a process of its own: one that crashes costs its own case only.

use crate::interrupt::Interrupt;
use crate::sweep_arguments::SweepRunArguments;
use crate::{Exit, apart};
use indicatif::{ProgressBar, ProgressStyle};
use rustix::process::Signal;
use std::io::{IsTerminal, Read};
use std::os::unix::process::ExitStatusExt;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use terraglue_diagnostics::{Error, Result};
use terraglue_sweep::{Case, CaseStatus, Claim, Outcome, Sweep};

/// Bytes that are kept of the output of a case.
const MOST_SAID: u64 = 1 << 18;

/// How often to look whether another process has ended a case.
const LOOK: Duration = Duration::from_millis(50);

/// Runs what is missing, waits for the cases that other processes run, then collects.
pub fn run(arguments: &SweepRunArguments) -> Result<Exit> {
    let sweep = Sweep::open(&arguments.folder)?;
    if arguments.again {
        forget_failed(&sweep)?;
    }
    let missing: Vec<&Case> = sweep.missing().collect();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.map_or(cores, usize::from).clamp(1, missing.len().max(1));
    let interrupt = Interrupt::listen();
    let cancel = interrupt.flag();
    interrupt.run();
    if !arguments.quiet {
        let done = sweep.cases.len() - missing.len();
        eprintln!(
            "note: {} of {} cases are to be run, {jobs} at a time",
            missing.len(),
            done + missing.len()
        );
    }
    let bar = bar(&sweep, missing.len(), arguments.quiet);
    let ran = all(&sweep, missing, jobs, &cancel, &bar);
    bar.finish_and_clear();
    if let Err(error) = ran {
        eprintln!("error: {error}");
        return Ok(Exit::Failed);
    }
    if cancel.load(Ordering::Relaxed) {
        eprintln!("`terraglue sweep run {}` goes on from here", sweep.folder().display());
        return Ok(Exit::Interrupted);
    }
    let table = super::collected(&sweep, false)?;
    let unlike = table.rows.len() - table.count("done");
    if table.missing() > 0 {
        let n = table.missing();
        eprintln!("error: {n} cases were killed; `terraglue sweep run` does what is missing");
    }
    Ok(if unlike > 0 { Exit::Failed } else { Exit::Done })
}

/// Runs cases, several at a time; those that another process runs come last, when it has ended with them.
fn all(sweep: &Sweep, missing: Vec<&Case>, jobs: usize, cancel: &AtomicBool, bar: &ProgressBar) -> Result {
    let waiting: Vec<(&Case, bool)> = missing.into_iter().rev().map(|case| (case, false)).collect();
    let cases = Mutex::new(waiting);
    let next = || cases.lock().ok().and_then(|mut cases| cases.pop());
    let broken = Mutex::new(Ok(()));
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some((case, taken)) = next().filter(|_| !cancel.load(Ordering::Relaxed)) {
                    let ran = if taken { waited(sweep, case, cancel) } else { one(sweep, case, cancel) };
                    match ran {
                        Ok(Ran::Here) => bar.inc(1),
                        Ok(Ran::Elsewhere) => {
                            if !taken {
                                log::info!(target: "terraglue_sweep", "case {} is run by another process", case.number);
                            }
                            if let Ok(mut cases) = cases.lock() {
                                cases.insert(0, (case, true));
                            }
                        }
                        Err(error) => {
                            if let Ok(mut broken) = broken.lock() {
                                *broken = Err(error);
                            }
                            break;
                        }
                    }
                }
            });
        }
    });
    broken.into_inner().unwrap_or(Ok(()))
}

/// Looks again for a case that another process ran, after a while.
fn waited(sweep: &Sweep, case: &Case, cancel: &AtomicBool) -> Result<Ran> {
    std::thread::sleep(LOOK);
    if Outcome::is_there(&sweep.case_folder(case)) {
        return Ok(Ran::Here);
    }
    let free = Claim::take(sweep, case)?.is_some();
    if free { one(sweep, case, cancel) } else { Ok(Ran::Elsewhere) }
}

/// Who has run a case.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ran {
    /// This process, or nobody needs to.
    Here,
    /// Another process runs it now.
    Elsewhere,
}

fn bar(sweep: &Sweep, missing: usize, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:32} {pos} of {len} cases  {per_sec}  {eta} left");
    let bar = ProgressBar::new(sweep.cases.len() as u64)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_position((sweep.cases.len() - missing) as u64);
    bar.reset_eta();
    bar
}

/// Removes the outcomes of cases that did not reach their end.
fn forget_failed(sweep: &Sweep) -> Result {
    for case in &sweep.cases {
        let folder = sweep.case_folder(case);
        if Outcome::read(&folder)?.is_some_and(|outcome| outcome.status != CaseStatus::Done) {
            std::fs::remove_dir_all(&folder)
                .map_err(|source| Error::File { path: folder.display().to_string(), source })?;
        }
    }
    Ok(())
}

/// Runs a case in a process. A crash is its outcome; where it was killed it stays missing.
fn one(sweep: &Sweep, case: &Case, cancel: &AtomicBool) -> Result<Ran> {
    let folder = sweep.case_folder(case);
    let failed = |source| Error::File { path: format!("the process of case {}", case.number), source };
    let mut child = Command::new(apart::own_program())
        .args(["sweep", "run"])
        .arg(sweep.folder())
        .args(["--case", &case.number.to_string(), "--quiet"])
        .args(["--with-parent", &std::process::id().to_string()])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let mut said = Vec::new();
    if let Some(mut pipe) = child.stderr.take() {
        // what is beyond the bound is read and left, or the process would wait
        let kept = pipe.by_ref().take(MOST_SAID).read_to_end(&mut said);
        let _ = kept.and_then(|_| std::io::copy(&mut pipe, &mut std::io::sink()));
    }
    let status = child.wait().map_err(failed)?;
    if status.code() == Some(Exit::Elsewhere.code().into()) {
        return Ok(Ran::Elsewhere);
    }
    let said = String::from_utf8_lossy(&said);
    if !said.is_empty() && folder.is_dir() {
        let path = folder.join("log.txt");
        std::fs::write(&path, said.as_bytes())
            .map_err(|source| Error::File { path: path.display().to_string(), source })?;
    }
    if Outcome::is_there(&folder) || cancel.load(Ordering::Relaxed) || was_killed(status) {
        return Ok(Ran::Here);
    }
    let Some(_claim) = Claim::take(sweep, case)? else { return Ok(Ran::Elsewhere) };
    let last = said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default();
    std::fs::create_dir_all(&folder).map_err(failed)?;
    let reason = format!("the process ended without a result ({status}): {last}");
    Outcome::without_figures(CaseStatus::Crashed, reason).write(&folder)?;
    Ok(Ran::Here)
}

/// Whether someone ended the process, and not a fault of its own.
fn was_killed(status: ExitStatus) -> bool {
    let from_outside = [Signal::KILL, Signal::TERM, Signal::INT, Signal::HUP];
    status.signal().is_some_and(|signal| from_outside.iter().any(|own| own.as_raw() == signal))
        || status.code() == Some(130)
}
