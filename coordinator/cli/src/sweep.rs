//! `terraglue sweep`: a list of runs in a folder, and one table of their results.

mod case;
mod jobs;

use super::output::outln;
use super::sweep_arguments::{SweepArguments, SweepCommand};
use super::{Exit, soil_module, testbed};
use crate::scenario_arguments::ScenarioArguments;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::observer::Observer;
use terraglue_engine::testbed::{Options, Testbed};
use terraglue_recording::{Status, SummaryObserver};
use terraglue_scenario::{InputError, Scenario, SweepPlan, did_you_mean};
use terraglue_sweep::{
    CASES, Collected, Points, RESULTS, Settings, Sweep, collect, keys, points, write_page,
};

/// Values of one key that are tried before the list is written, and of those the ones that a testbed is built with; a value that
/// does not fit is found at its case, too.
const MOST_TRIED: usize = 16;
/// See [`MOST_TRIED`].
const MOST_BUILT: usize = 8;

/// Runs the command of the arguments.
pub fn sweep(arguments: &SweepArguments) -> Result<Exit> {
    match &arguments.command {
        None => list(arguments),
        Some(SweepCommand::Run(run)) if run.case.is_some() => case::run(run),
        Some(SweepCommand::Run(run)) => jobs::run(run),
        Some(SweepCommand::Collect { folder, json }) => {
            let all = collected(&Sweep::open(folder)?, *json)?;
            Ok(if all.missing() == all.rows.len() { Exit::Failed } else { Exit::Done })
        }
    }
}

/// Writes the list of cases.
fn list(arguments: &SweepArguments) -> Result<Exit> {
    let (Some(path), Some(out)) = (&arguments.plan, &arguments.out) else {
        return Err(InputError::plain("sweep: a plan and --out are wanted", None).into());
    };
    let (of_plan, sets): (Vec<_>, Vec<_>) =
        arguments.sets.iter().cloned().partition(|(key, _)| key.starts_with("sweep."));
    let plan = SweepPlan::load(path, &of_plan)?;
    let points = points(&plan.spec)?;
    tried(&plan, &points, &sets, &arguments.module_path)?;
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let settings = Settings {
        scenario: absolute(&plan.scenario),
        sets,
        module_paths: arguments.module_path.iter().map(|path| absolute(path)).collect(),
        collect: plan.spec.collect.clone(),
    };
    let sweep = Sweep::create(out, settings, points)?;
    let folder = absolute(sweep.folder());
    let n = sweep.cases.len();
    if arguments.slurm {
        outln!("{}", slurm(&folder, n));
    } else if arguments.commands {
        (1..=n).for_each(|k| outln!("{}", command(&folder, &k.to_string())));
    } else {
        outln!("{n} cases: {}", sweep.folder().join(CASES).display());
        outln!("run:     terraglue sweep run {}", quoted(sweep.folder()));
        outln!("collect: terraglue sweep collect {}", quoted(sweep.folder()));
    }
    Ok(Exit::Done)
}

/// The command of a case; `number` may be a word of a script.
fn command(folder: &Path, number: &str) -> String {
    let program = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("terraglue"));
    format!("{} sweep run {} --case {number} --quiet", quoted(&program), quoted(folder))
}

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+".contains(c);
    if text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

fn slurm(folder: &Path, cases: usize) -> String {
    // a directive takes its path as it is, without quotes
    format!(
        "#!/bin/sh\n#SBATCH --job-name=terraglue-sweep\n#SBATCH --array=1-{cases}\n#SBATCH --ntasks=1\n#SBATCH --cpus-per-task=1\n#SBATCH --output={}/slurm-%a.out\nexec {}",
        folder.display(),
        command(folder, "\"$SLURM_ARRAY_TASK_ID\"")
    )
}

/// Finds out, before anything is written, whether the scenario can be built, each of the varied keys is one, and what is to be
/// collected is there.
fn tried(plan: &SweepPlan, points: &Points, sets: &[(String, String)], modules: &[PathBuf]) -> Result {
    let Some(first) = points.rows.first() else { return Ok(()) };
    let of = |row: &[String]| -> Vec<(String, String)> {
        sets.iter().cloned().chain(points.keys.iter().cloned().zip(row.iter().cloned())).collect()
    };
    let options = testbed::options_of(1, modules, &Arc::new(AtomicBool::new(false)));
    let built = |row: &[String]| built(&plan.scenario, &of(row), &options);
    let (testbed, scenario) = built(first).map_err(|e| of_plan(plan, points, first, e))?;
    known(&testbed, &scenario, &plan.spec.collect)?;
    drop(testbed);
    for k in 0..points.keys.len() {
        let mut seen = vec![first[k].as_str()];
        for row in &points.rows {
            if seen.len() > MOST_TRIED || seen.contains(&row[k].as_str()) {
                continue;
            }
            seen.push(&row[k]);
            let mut own = first.clone();
            own[k].clone_from(&row[k]);
            let tried = match seen.len() <= MOST_BUILT {
                true => built(&own).map(drop),
                false => Scenario::load(&plan.scenario, &of(&own)).map(drop).map_err(Error::from),
            };
            tried.map_err(|error| at_key(plan, (&points.keys[k], &row[k]), error))?;
        }
    }
    Ok(())
}

/// The scenario of a case with its testbed.
fn built(scenario: &Path, sets: &[(String, String)], options: &Options) -> Result<(Testbed, Scenario)> {
    let arguments = ScenarioArguments {
        scenario: scenario.to_owned(),
        sets: sets.to_vec(),
        module_path: options.module_paths.clone(),
    };
    let loaded = Scenario::load(scenario, sets)?;
    soil_module::check(&loaded, &arguments)?;
    Ok((testbed::build(&loaded, options)?, loaded))
}

/// An error of the first case, at the key whose edit it is about.
fn of_plan(plan: &SweepPlan, points: &Points, first: &[String], error: Error) -> Error {
    let Error::Input(input) = &error else { return error };
    let text = input.source_code.inner();
    let about = points.keys.iter().zip(first).find(|(key, value)| *text == format!("{key}={value}"));
    match about {
        Some(about) => at_key(plan, about, error),
        None => error,
    }
}

/// An error that a value of a key makes, at the key in the plan.
fn at_key(plan: &SweepPlan, (key, value): (&String, &String), error: Error) -> Error {
    match error {
        Error::Input(input) => {
            plan.error(key, format!("{key} = {value}: {}", input.message), input.help.clone()).into()
        }
        other => plan.error(key, format!("{key} = {value}: {other}"), None).into(),
    }
}

/// Checks that each collected name is a variable that is a number, or a key of the summary.
fn known(testbed: &Testbed, scenario: &Scenario, names: &[String]) -> Result {
    if names.is_empty() {
        return Ok(());
    }
    let mut summary = SummaryObserver::new(scenario);
    testbed.view(|view| summary.started(view))?;
    let keys = keys(&summary.summary(0.0, 0.0, None, Status::Done));
    let variables = testbed.signals().directory.names();
    let Some(name) = names.iter().find(|name| !keys.contains(name) && testbed.read(name).is_none()) else {
        return Ok(());
    };
    let all = variables.iter().chain(&keys).map(String::as_str);
    let message =
        format!("sweep.collect: `{name}` is no variable that is a number, and no key of summary.json");
    Err(InputError::plain(message, did_you_mean(name, all)).into())
}

/// Writes table and page of what is there, and says so.
fn collected(sweep: &Sweep, json: bool) -> Result<Collected> {
    let all = collect(sweep)?;
    let page = write_page(sweep, &all)?;
    let counts =
        ["done", "failed", "refused", "crashed", "missing"].map(|status| (status, all.count(status)));
    let table = sweep.folder().join(RESULTS);
    if json {
        let mut value: serde_json::Map<String, serde_json::Value> =
            counts.iter().map(|(status, n)| ((*status).to_owned(), (*n).into())).collect();
        value.insert("table".into(), table.display().to_string().into());
        value.insert("page".into(), page.display().to_string().into());
        outln!("{}", serde_json::Value::Object(value));
    } else {
        let counts: Vec<String> =
            counts.iter().filter(|(_, n)| *n > 0).map(|(status, n)| format!("{n} {status}")).collect();
        outln!("cases: {}", counts.join(", "));
        outln!("table: {}", table.display());
        outln!("page:  {}", page.display());
    }
    Ok(all)
}
