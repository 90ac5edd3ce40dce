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
use terraglue_diagnostics::{Error, Result};
use terraglue_sweep::{Case, CaseStatus, Claim, Outcome, Sweep};

/// Bytes that are kept of the output of a case.
const MOST_SAID: u64 = 1 << 18;

/// Runs what is missing, then collects.
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
    let next = Mutex::new(missing.iter());
    let broken = Mutex::new(None);
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while !cancel.load(Ordering::Relaxed) {
                    let Some(case) = next.lock().ok().and_then(|mut next| next.next()) else { break };
                    if let Err(error) = one(&sweep, case, &cancel) {
                        broken.lock().iter_mut().for_each(|broken| **broken = Some(error.to_string()));
                        break;
                    }
                    bar.inc(1);
                }
            });
        }
    });
    bar.finish_and_clear();
    if let Some(error) = broken.into_inner().ok().flatten() {
        eprintln!("error: {error}");
        return Ok(Exit::Failed);
    }
    if cancel.load(Ordering::Relaxed) {
        eprintln!("`terraglue sweep run {}` goes on from here", sweep.folder().display());
        return Ok(Exit::Interrupted);
    }
    let all = super::collected(&sweep, false)?;
    let unlike = all.rows.len() - all.count("done");
    if all.missing() > 0 {
        let n = all.missing();
        eprintln!(
            "error: {n} cases were killed, or another process runs them; `terraglue sweep run` does what is missing"
        );
    }
    Ok(if unlike > 0 { Exit::Failed } else { Exit::Done })
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
fn one(sweep: &Sweep, case: &Case, cancel: &AtomicBool) -> Result {
    let failed = |source| Error::File { path: format!("the process of case {}", case.number), source };
    let mut child = Command::new(apart::own_program())
        .args(["sweep", "run"])
        .arg(sweep.folder())
        .args(["--case", &case.number.to_string(), "--quiet", "--with-parent"])
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
    let folder = sweep.case_folder(case);
    let said = String::from_utf8_lossy(&said);
    if !said.is_empty() && folder.is_dir() {
        let path = folder.join("log.txt");
        std::fs::write(&path, said.as_bytes())
            .map_err(|source| Error::File { path: path.display().to_string(), source })?;
    }
    if Outcome::is_there(&folder) || cancel.load(Ordering::Relaxed) || was_killed(status) {
        return Ok(());
    }
    let Some(_claim) = Claim::take(sweep, case)? else { return Ok(()) };
    let last = said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default();
    std::fs::create_dir_all(&folder).map_err(failed)?;
    let reason = format!("the process ended without a result ({status}): {last}");
    Outcome::without_figures(CaseStatus::Crashed, reason).write(&folder)
}

/// Whether someone ended the process, and not a fault of its own.
fn was_killed(status: ExitStatus) -> bool {
    let from_outside = [Signal::KILL, Signal::TERM, Signal::INT, Signal::HUP];
    status.signal().is_some_and(|signal| from_outside.iter().any(|own| own.as_raw() == signal))
        || status.code() == Some(130)
}
