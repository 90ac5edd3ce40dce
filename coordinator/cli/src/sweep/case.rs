//! One case of a sweep, in this process.

use crate::interrupt::Interrupt;
use crate::progress::{self, Progress, Waiting};
use crate::scenario_arguments::ScenarioArguments;
use crate::sweep_arguments::SweepRunArguments;
use crate::{Exit, apart, exit_of, run, show, soil_module, testbed};
use std::path::Path;
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::testbed::Testbed;
use terraglue_recording::Status;
use terraglue_scenario::Scenario;
use terraglue_sweep::{Case, CaseStatus, Claim, Outcome, Sweep, figures};

/// Runs the case that the arguments name; nothing where it is done.
pub fn run(arguments: &SweepRunArguments) -> Result<Exit> {
    if arguments.with_parent {
        apart::end_with_parent();
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
        return Ok(Exit::Failed);
    };
    if Outcome::is_there(&place) {
        return Ok(Exit::Done);
    }
    emptied(&place)?;
    let (scenario, testbed) = match made(&sweep, case, &interrupt) {
        Ok(made) => made,
        Err(error) => {
            let reason = match &error {
                Error::Input(input) => [Some(input.message.clone()), input.help.clone()]
                    .into_iter()
                    .flatten()
                    .collect::<Vec<_>>()
                    .join("; "),
                other => other.to_string(),
            };
            Outcome::without_figures(CaseStatus::Refused, reason).write(&place)?;
            return Err(error);
        }
    };
    interrupt.run();
    let steps = (scenario.time.duration_s / scenario.time.step_s).round() as u64;
    let bar = progress::bar(steps, arguments.quiet);
    let waiting = Waiting::standing(arguments.quiet, &bar, std::sync::Arc::default(), "");
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

fn made(sweep: &Sweep, case: &Case, interrupt: &Interrupt) -> Result<(Scenario, Testbed)> {
    let (path, sets, modules) = (sweep.scenario(), sweep.sets(case), &sweep.settings.module_paths);
    let scenario = Scenario::load(&path, &sets)?;
    let arguments = ScenarioArguments { scenario: path, sets, module_path: modules.clone() };
    soil_module::check(&scenario, &arguments)?;
    let testbed = testbed::build(&scenario, &testbed::options_of(1, modules, &interrupt.flag()))?;
    Ok((scenario, testbed))
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
