//! `terraglue compare`: the product of strategies, soils and other keys, each run in a folder of its own.

mod plan;

use super::arguments::{CompareArguments, RunArguments};
use super::folder::results_folder;
use super::interrupt::Interrupt;
use super::output::outln;
use super::progress::{self, Progress, Waiting};
use super::{Exit, logger, run, show, testbed};
use indicatif::ProgressBar;
use plan::Plan;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use terraglue_compare::{self as side_by_side, COMPARE_JSON, COMPARE_PAGE, CompareRow};
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::observer::Observer;
use terraglue_recording as recording;
use terraglue_recording::{Status, SummaryObserver};
use terraglue_scenario::keys::STRATEGIES;

/// Runs all combinations and writes the comparison.
pub fn compare(arguments: &CompareArguments) -> Result<Exit> {
    let interrupt = Interrupt::listen();
    let cancel = interrupt.flag();
    let warnings = logger::collect();
    let mut plans = plan::plan(arguments)?;
    let loading = Waiting::loading(arguments.run.quiet);
    plan::refuse(&mut plans, &arguments.run, &cancel)?;
    drop(loading);
    warnings.tell();
    let name = plans.first().map_or_else(String::new, |p| p.scenario.name.clone());
    interrupt.run();
    // apart from that of `run`, whose results it would rename
    let folder = results_folder(arguments.run.out.as_deref(), &format!("{name}-compare"))?;
    for k in 0..plans.len() {
        let name = folder_name(&plans[k].row);
        let taken = |name: &str| plans[..k].iter().any(|p| p.folder.ends_with(name));
        let numbered = (2..).map(|n| format!("{name}_{n}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|name| !taken(name));
        plans[k].folder = folder.join(free.unwrap_or(name));
    }
    if !arguments.run.quiet {
        eprintln!("note: {}", announced(&plans));
    }
    let bar = progress::bar(plans.iter().map(Plan::steps).sum(), arguments.run.quiet);
    let mut rows = run_all(&plans, &arguments.run, &cancel, &bar);
    bar.finish_and_clear();
    warnings.tell();
    judge(&mut rows, arguments)?;
    side_by_side::write(&folder, &rows)?;
    print(arguments, &folder, &rows)?;
    // what is interrupted while it loads is no wrong value
    let is_wrong = !cancel.load(Ordering::Relaxed) && tell_wrong(&plans);
    Ok(if cancel.load(Ordering::Relaxed) {
        Exit::Interrupted
    } else {
        match exit(&rows, !(arguments.run.quiet || arguments.run.json)) {
            Exit::Done if is_wrong => Exit::WrongInput,
            other => other,
        }
    })
}

/// Says which values of `--vary` do not fit, each once; whether there are any.
fn tell_wrong(plans: &[Plan]) -> bool {
    let mut told = Vec::new();
    for plan in plans.iter().filter(|plan| plan.is_wrong) {
        let Some(error) = &plan.refused else { continue };
        let text = error.to_string();
        if !told.contains(&text) {
            show::error(error);
            told.push(text);
        }
    }
    let (wrong, rows) = (plans.iter().filter(|p| p.is_wrong).count(), plans.len());
    if wrong > 0 {
        eprintln!("error: {wrong} of {rows} runs did not start: their value of --vary does not fit");
    }
    wrong > 0
}

/// Every run that was started must reach its end; a strategy that cannot glue the scenario is a row that says so.
fn exit(rows: &[CompareRow], is_shown: bool) -> Exit {
    let started = |row: &&CompareRow| row.error.as_ref().is_none_or(|e| !e.starts_with(plan::REFUSED));
    let failed = rows.iter().filter(started).filter_map(|row| Some((row.name(), row.failure()?)));
    let failed: Vec<(String, String)> = failed.collect();
    // the table shows it, too
    for (name, why) in failed.iter().filter(|_| !is_shown) {
        eprintln!("error: {name}: {why}");
    }
    for lost in rows.iter().filter(|r| r.is_reference && r.failure().is_some()) {
        let name = lost.name();
        eprintln!("error: {name} did not reach its end: the rows of its soil have no error against it");
    }
    match (failed.len(), rows.iter().filter(started).count()) {
        (0, _) => return Exit::Done,
        (n, all) if n == all => eprintln!("error: no run reached its end"),
        (n, all) => eprintln!("error: {n} of {all} runs did not reach the end; the others can be compared"),
    }
    eprintln!(
        "  help: `terraglue run` with the --set of a row runs it alone; a smaller time.step_s may help"
    );
    Exit::Failed
}

/// The runs about to start, in words.
fn announced(plans: &[Plan]) -> String {
    let runs = plans.iter().filter(|p| p.refused.is_none()).count();
    let references = plans.iter().filter(|p| p.row.is_reference).count();
    let steps: u64 = plans.iter().map(Plan::steps).sum();
    let of_them =
        if references > 0 { format!(" ({references} of them for reference)") } else { String::new() };
    let wrong = plans.iter().filter(|p| p.is_wrong).count();
    let more = |count, what| if count > 0 { format!("; {count} more {what}") } else { String::new() };
    let refused = more(plans.len() - runs - wrong, "cannot be glued so")
        + &more(wrong, "cannot start with their value of --vary");
    format!("{runs} run{}{of_them}, {steps} steps in all{refused}", if runs == 1 { "" } else { "s" })
}

/// The errors of all rows against the reference, where there is one.
fn judge(rows: &mut [CompareRow], arguments: &CompareArguments) -> Result {
    let Some(reference) = &arguments.reference else { return Ok(()) };
    if !STRATEGIES.contains(&reference.as_str()) {
        return side_by_side::judge(rows, None, Path::new(reference));
    }
    let runs = rows.iter().filter(|r| r.is_reference && r.failure().is_none()).cloned();
    let runs: Vec<(CompareRow, PathBuf)> = runs.filter_map(|r| Some((r.clone(), r.folder?))).collect();
    runs.iter().try_for_each(|(run, folder)| side_by_side::judge(rows, Some(run), folder))
}

/// Longest part of the name of a folder that a value takes.
const LONGEST_VALUE: usize = 40;

/// Name of the folder of a run.
fn folder_name(row: &CompareRow) -> String {
    let reference = if row.is_reference { "reference_" } else { "" };
    let soil = if row.soil.is_empty() { String::new() } else { format!("_{}", file_name(&row.soil)) };
    let plain = |c: char| if c.is_alphanumeric() || matches!(c, '.' | '-' | '_') { c } else { '-' };
    let value =
        |value: &String| value.trim_matches('"').chars().take(LONGEST_VALUE).map(plain).collect::<String>();
    let varied: String = row.varied.iter().map(|(_, v)| format!("_{}", value(v))).collect();
    let step = if row.name_step { format!("_{}s", row.step_s) } else { String::new() };
    format!("{reference}{}{soil}{varied}{step}", row.strategy)
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
    let mut row = plan.row.clone();
    let _said = logger::of_run(&plan.name);
    if let Some(error) = &plan.refused {
        row.error = Some(plan::reason(error));
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
    let options = testbed::options(arguments, cancel);
    let testbed = testbed::build(&plan.scenario, &options)?;
    let label = format!("{}: ", plan.name);
    let waiting = Waiting::standing(arguments.quiet, bar, options.standing, &label);
    let mut progress = Progress::new(bar.clone(), plan.scenario.time.duration_s, &label).after(waiting);
    let records = run::Records {
        scenario: &plan.scenario,
        folder: &plan.folder,
        csv: arguments.csv,
        keeper: None,
        resumed: None,
        asked: &[],
    };
    let outcome = run::run_testbed(testbed, None, records, &mut progress)?;
    let written = recording::report::write(&plan.folder);
    // a run that failed reports why, and not that it left too little for a report
    if outcome.error.is_none() {
        written?;
    }
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
    scenario.gluing.start = terraglue_scenario::StartChoice::Zero;
    let mut testbed = super::testbed::build(&scenario, &testbed::options(arguments, cancel)).ok()?;
    let mut progress = Progress::new(bar.clone(), scenario.time.duration_s, "without the estimate: ");
    let mut figures = SummaryObserver::new(&scenario);
    testbed.begin().ok()?;
    testbed.view(|view| figures.started(view)).ok()?;
    testbed.run_until(scenario.time.duration_s, &mut [&mut figures, &mut progress]).ok()?;
    testbed.view(|view| figures.finished(view, None)).ok()?;
    (!testbed.cancelled()).then(|| figures.summary(0.0, 0.0, None, Status::Done).gluing.evaluations_soil_mean)
}

fn print(arguments: &CompareArguments, folder: &Path, rows: &[CompareRow]) -> Result {
    if arguments.run.json {
        let path = folder.join(COMPARE_JSON);
        let at = |source| Error::File { path: path.display().to_string(), source };
        outln!("{}", std::fs::read_to_string(&path).map_err(at)?.trim_end());
    } else if !arguments.run.quiet {
        outln!("{}", side_by_side::terminal_table(rows, false));
        if arguments.details {
            outln!("{}", side_by_side::terminal_table(rows, true));
        }
        outln!("comparison: {}", folder.join(COMPARE_PAGE).display());
    }
    Ok(())
}
