//! One case of a sweep, in this process.

use crate::interrupt::Interrupt;
use crate::progress::{self, Progress, Waiting};
use crate::show::{self, in_one_line};
use crate::sweep_arguments::SweepRunArguments;
use crate::{Exit, apart, exit_of, run, testbed};
use rustix::process::Pid;
use std::path::Path;
use terraglue_diagnostics::{Error, Result};
use terraglue_recording::Status;
use terraglue_sweep::{CaseStatus, Claim, Outcome, Sweep, figures};

/// Runs the case that the arguments name; nothing where it is done.
pub fn run(arguments: &SweepRunArguments) -> Result<Exit> {
    if let Some(parent) = arguments.with_parent
        && !apart::end_with_parent(Pid::from_raw(parent))
    {
        return Ok(Exit::Interrupted);
    }
    let interrupt = Interrupt::listen();
    let sweep = Sweep::open(&arguments.folder)?;
    let case = sweep.case(arguments.case.unwrap_or_default())?;
    let place = sweep.case_folder(case);
    if Outcome::is_there(&place) {
        return Ok(Exit::Done);
    }
    let Some(_claim) = Claim::take(&sweep, case)? else {
        eprintln!("error: another process runs case {}", case.number);
        return Ok(Exit::Elsewhere);
    };
    if Outcome::is_there(&place) {
        return Ok(Exit::Done);
    }
    emptied(&place)?;
    let modules = &sweep.settings.module_paths;
    let options = testbed::options_of(1, modules, &interrupt.flag());
    let (testbed, scenario) = match super::built(&sweep.scenario(), &sweep.sets(case), &options) {
        Ok(made) => made,
        Err(error) => {
            Outcome::without_figures(CaseStatus::Refused, in_one_line(&error)).write(&place)?;
            return Err(error);
        }
    };
    interrupt.run();
    let bar = progress::bar(scenario.time.steps(), arguments.quiet);
    let waiting = Waiting::standing(arguments.quiet, &bar, options.standing, "");
    let mut progress = Progress::new(bar.clone(), scenario.time.duration_s, "").after(waiting);
    let asked = &sweep.settings.collect;
    let records =
        run::Records { scenario: &scenario, folder: &place, csv: false, keeper: None, resumed: None, asked };
    let outcome = run::run_testbed(testbed, None, records, &mut progress)?;
    drop(progress);
    bar.finish_and_clear();
    finished(&outcome, &place, arguments.quiet)
}

/// Writes the outcome of a run; one that was interrupted has none.
fn finished(outcome: &run::Outcome, place: &Path, quiet: bool) -> Result<Exit> {
    if outcome.summary.status == Status::Stopped {
        return Ok(Exit::Interrupted);
    }
    let mut all = figures(&outcome.summary);
    all.extend(outcome.asked.iter().filter(|(_, value)| value.is_finite()).cloned());
    let status = if outcome.error.is_some() { CaseStatus::Failed } else { CaseStatus::Done };
    let reason = outcome.error.as_ref().map(ToString::to_string);
    Outcome { status, reason, figures: all }.write(place)?;
    match &outcome.error {
        Some(error) => {
            show::error(error);
            Ok(exit_of(error))
        }
        None => {
            if !quiet {
                crate::output::outln!("{}", show::summary(&outcome.summary));
            }
            Ok(Exit::Done)
        }
    }
}

/// An empty folder, whatever a process that was killed has left in it.
fn emptied(place: &Path) -> Result {
    let at = |source| Error::File { path: place.display().to_string(), source };
    match std::fs::remove_dir_all(place) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(at(e)),
        _ => {}
    }
    std::fs::create_dir_all(place).map_err(at)
}
