//! `terraglue compare`: the product of strategies and soils, each run in a folder of its own.

use super::arguments::{CompareArguments, RunArguments};
use super::folder::results_folder;
use super::output::outln;
use super::progress::{self, Progress};
use super::{Exit, interrupt, run, soil_module};
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use terraglue::host::{Library, SearchPath};
use terraglue::observer::Observer;
use terraglue::recording::compare::{self, COMPARE_JSON, COMPARE_PAGE, CompareRow};
use terraglue::recording::{self, Status, SummaryObserver};
use terraglue::scenario::{InputError, Scenario, did_you_mean, keys::STRATEGIES};
use terraglue::subsystem::Kind;
use terraglue::{Error, Result};

/// One row before it ran.
struct Plan {
    strategy: String,
    soil: String,
    /// Whether the others are compared with it.
    is_reference: bool,
    /// Whether the comparison has several steps.
    name_step: bool,
    scenario: Scenario,
    folder: PathBuf,
    /// Why it cannot run: a row of the comparison.
    refused: Option<String>,
}

/// Runs all combinations and writes the comparison.
pub fn compare(arguments: &CompareArguments) -> Result<Exit> {
    let cancel = interrupt::cancel_flag();
    let mut plans = plan(arguments)?;
    refuse(&mut plans, &arguments.run, &cancel)?;
    let name = plans.first().map_or_else(String::new, |p| p.scenario.name.clone());
    let folder = results_folder(arguments.run.out.as_deref(), &name)?;
    for plan in &mut plans {
        let step = if plan.name_step { format!("_{}s", plan.scenario.time.step_s) } else { String::new() };
        let reference = if plan.is_reference { "reference_" } else { "" };
        plan.folder = folder.join(format!("{reference}{}_{}{step}", plan.strategy, file_name(&plan.soil)));
    }
    let bar = progress::bar(plans.iter().map(Plan::steps).sum(), arguments.run.quiet);
    let mut rows = run_all(&plans, &arguments.run, &cancel, &bar);
    bar.finish_and_clear();
    judge(&mut rows, arguments)?;
    compare::write(&folder, &rows)?;
    print(&arguments.run, &folder, &rows)?;
    Ok(if cancel.load(Ordering::Relaxed) { Exit::Interrupted } else { Exit::Done })
}

/// The errors of all rows against the reference, where there is one.
fn judge(rows: &mut [CompareRow], arguments: &CompareArguments) -> Result {
    let Some(reference) = &arguments.reference else { return Ok(()) };
    if !STRATEGIES.contains(&reference.as_str()) {
        return compare::judge(rows, None, Path::new(reference));
    }
    let runs: Vec<(String, PathBuf)> = rows
        .iter()
        .filter(|r| r.is_reference && r.failure().is_none())
        .filter_map(|r| Some((r.soil.clone(), r.folder.clone()?)))
        .collect();
    runs.iter().try_for_each(|(soil, folder)| compare::judge(rows, Some(soil), folder))
}

/// Wrong input shows before the first run starts; a strategy that cannot glue the scenario is a row that says so,
/// as long as another one can.
fn refuse(plans: &mut [Plan], arguments: &RunArguments, cancel: &Arc<AtomicBool>) -> Result {
    let mut first = None;
    for plan in plans.iter_mut() {
        if let Err(error) = run::build(&plan.scenario, &run::options(arguments, cancel)) {
            plan.refused = Some(format!("refused: {error}"));
            first = first.or(Some(error));
        }
    }
    match first {
        Some(error) if plans.iter().all(|p| p.refused.is_some()) => Err(error),
        _ => Ok(()),
    }
}

impl Plan {
    /// Whether the iteration also runs from zero, to show what the estimate saves.
    fn has_cold_start(&self) -> bool {
        self.strategy == "iterative" && self.scenario.gluing.start == "estimate"
    }

    /// Steps of all its runs.
    fn steps(&self) -> u64 {
        let time = self.scenario.time;
        let once = (time.duration_s / time.step_s).round() as u64;
        if self.refused.is_some() {
            return 0;
        }
        if self.has_cold_start() { 2 * once } else { once }
    }
}

/// All combinations in the order strategies × soils, each checked.
fn plan(arguments: &CompareArguments) -> Result<Vec<Plan>> {
    let file = &arguments.run.scenario.scenario;
    let base = Scenario::load(file, &arguments.run.sets())?;
    soil_module::check(&base, &arguments.run.scenario)?;
    for module in &arguments.soils {
        soil_module::require_soil(module, &base, &arguments.run.scenario)?;
    }
    let strategies =
        or_default(&arguments.strategies, || STRATEGIES.iter().map(|s| (*s).to_owned()).collect());
    if let Some(unknown) = strategies.iter().find(|s| !STRATEGIES.contains(&s.as_str())) {
        let help = did_you_mean(unknown, STRATEGIES.iter().copied());
        return Err(InputError::plain(format!("unknown strategy `{unknown}` in --strategies"), help).into());
    }
    let soil = soil_of(&base, &arguments.run)?;
    let soils = match (&soil, arguments.soils.is_empty()) {
        (Some(soil), true) => vec![soil.module.clone()],
        (Some(_), false) => arguments.soils.clone(),
        (None, true) => vec![String::new()],
        (None, false) => return Err(InputError::plain("--soils: the scenario has no soil", None).into()),
    };
    let steps: Vec<Option<f64>> = if arguments.steps.is_empty() {
        vec![None]
    } else {
        arguments.steps.iter().copied().map(Some).collect()
    };
    let mut wanted: Vec<(String, String, Option<f64>, bool)> = Vec::new();
    for strategy in &strategies {
        for module in &soils {
            wanted.extend(steps.iter().map(|step| (strategy.clone(), module.clone(), *step, false)));
        }
    }
    match &arguments.reference {
        Some(name) if STRATEGIES.contains(&name.as_str()) => {
            // of several steps the error is that against the step, so the reference must be finer than all of them
            let several = arguments.steps.len() > 1;
            let finest = arguments.steps.iter().copied().reduce(f64::min);
            let finest = finest.map(|h| if several { 0.5 * h } else { h });
            wanted.extend(soils.iter().map(|module| (name.clone(), module.clone(), finest, true)));
        }
        Some(path) if !Path::new(path).exists() => {
            let help = did_you_mean(path, STRATEGIES.iter().copied());
            let message = format!("--reference: `{path}` is no strategy and no folder of a run");
            return Err(InputError::plain(message, help).into());
        }
        _ => {}
    }
    let mut plans = Vec::new();
    for (strategy, module, step, is_reference) in wanted {
        let mut sets = arguments.run.sets();
        sets.push(("gluing.strategy".into(), strategy.clone()));
        if let Some(step) = step {
            sets.push(("time.step_s".into(), format!("{step:?}")));
        }
        if let Some(soil) = soil.as_ref().filter(|_| !arguments.soils.is_empty()) {
            sets.push((format!("{}.module", soil.name), module.clone()));
        }
        let scenario = Scenario::load(file, &sets)?;
        plans.push(Plan {
            strategy,
            soil: module,
            is_reference,
            name_step: arguments.steps.len() > 1,
            scenario,
            folder: PathBuf::new(),
            refused: None,
        });
    }
    Ok(plans)
}

fn or_default(given: &[String], default: impl FnOnce() -> Vec<String>) -> Vec<String> {
    if given.is_empty() { default() } else { given.to_vec() }
}

/// Name and module of the only subsystem of kind soil.
struct Soil {
    name: String,
    module: String,
}

fn soil_of(scenario: &Scenario, arguments: &RunArguments) -> Result<Option<Soil>> {
    let search = SearchPath::standard(&arguments.scenario.module_path, &scenario.folder);
    let mut soils = Vec::new();
    for spec in &scenario.subsystems {
        let module = Library::new().find(&spec.module, &search, &scenario.folder).map_err(|e| {
            let help = e.nearest().map(|n| format!("did you mean `{n}`?"));
            scenario.source.error_at_value(&[&spec.name, "module"], e.to_string(), help)
        })?;
        if module.schema().kind == Kind::Soil {
            soils.push(Soil { name: spec.name.clone(), module: spec.module.clone() });
        }
    }
    if soils.len() > 1 {
        let message = "the scenario has several soils: it is not clear which one --soils replaces";
        return Err(InputError::plain(message, None).into());
    }
    Ok(soils.pop())
}

/// A module's name without what a folder name may not hold.
fn file_name(module: &str) -> String {
    Path::new(module).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Runs the rows on as many threads as there are cores; their order stays.
fn run_all(
    plans: &[Plan],
    arguments: &RunArguments,
    cancel: &Arc<AtomicBool>,
    bar: &ProgressBar,
) -> Vec<CompareRow> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let workers = (cores / arguments.threads.max(1)).clamp(1, plans.len().max(1));
    let next = Mutex::new(plans.iter().enumerate());
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                // A poisoned lock means that another row panicked; its row is missing, the others go on.
                while let Some((i, plan)) = next.lock().ok().and_then(|mut n| n.next()) {
                    let row = run_one(plan, arguments, cancel, bar);
                    if let Ok(mut done) = done.lock() {
                        done.push((i, row));
                    }
                }
            });
        }
    });
    let mut rows = done.into_inner().unwrap_or_default();
    rows.sort_by_key(|(i, _)| *i);
    rows.into_iter().map(|(_, row)| row).collect()
}

fn run_one(plan: &Plan, arguments: &RunArguments, cancel: &Arc<AtomicBool>, bar: &ProgressBar) -> CompareRow {
    let mut row = CompareRow {
        strategy: plan.strategy.clone(),
        soil: plan.soil.clone(),
        step_s: plan.scenario.time.step_s,
        is_reference: plan.is_reference,
        name_step: plan.name_step,
        ..CompareRow::default()
    };
    if plan.refused.is_some() {
        row.error.clone_from(&plan.refused);
        return row;
    }
    if cancel.load(Ordering::Relaxed) {
        row.error = Some("not started: interrupted".into());
        return row;
    }
    match recorded(plan, arguments, cancel, bar) {
        Ok(outcome) => {
            row.error = outcome.error.map(|e| e.to_string());
            row.summary = Some(outcome.summary);
            row.folder = Some(plan.folder.clone());
            row.parts_s = Some(outcome.parts_s);
        }
        Err(e) => row.error = Some(e.to_string()),
    }
    if row.error.is_none() && plan.has_cold_start() && !cancel.load(Ordering::Relaxed) {
        row.cold_start_mean = cold_start_mean(plan, arguments, cancel, bar);
    }
    row
}

fn recorded(
    plan: &Plan,
    arguments: &RunArguments,
    cancel: &Arc<AtomicBool>,
    bar: &ProgressBar,
) -> Result<run::Outcome> {
    let testbed = run::build(&plan.scenario, &run::options(arguments, cancel))?;
    let label = format!("{} on {}: ", plan.strategy, file_name(&plan.soil));
    let mut progress = Progress::new(bar.clone(), plan.scenario.time.duration_s, &label);
    let outcome =
        run::run_testbed(testbed, None, &plan.scenario, &plan.folder, arguments.csv, &mut progress)?;
    recording::report::write(&plan.folder)?;
    Ok(outcome)
}

/// Mean evaluations of the soils of the same run when the iteration starts from zero; none where that fails.
fn cold_start_mean(
    plan: &Plan,
    arguments: &RunArguments,
    cancel: &Arc<AtomicBool>,
    bar: &ProgressBar,
) -> Option<f64> {
    let mut scenario = plan.scenario.clone();
    scenario.gluing.start = "zero".into();
    let mut testbed = run::build(&scenario, &run::options(arguments, cancel)).ok()?;
    let mut progress = Progress::new(bar.clone(), scenario.time.duration_s, "without the estimate: ");
    let mut figures = SummaryObserver::new(&scenario);
    testbed.view(|view| figures.started(view)).ok()?;
    testbed.run_until(scenario.time.duration_s, &mut [&mut figures, &mut progress]).ok()?;
    testbed.view(|view| figures.finished(view, None)).ok()?;
    (!testbed.cancelled()).then(|| figures.summary(0.0, 0.0, None, Status::Done).evaluations_soil_mean)
}

fn print(arguments: &RunArguments, folder: &Path, rows: &[CompareRow]) -> Result {
    if arguments.json {
        let path = folder.join(COMPARE_JSON);
        let at = |source| Error::File { path: path.display().to_string(), source };
        outln!("{}", std::fs::read_to_string(&path).map_err(at)?.trim_end());
    } else if !arguments.quiet {
        outln!("{}", compare::terminal_table(rows));
        outln!("comparison: {}", folder.join(COMPARE_PAGE).display());
    }
    Ok(())
}
