//! `terraglue fmu run | info | check`: one functional mock-up unit.

use super::arguments::{FmuCommand, FmuRunArguments};
use super::fmu_info::info;
use super::interrupt::Interrupt;
use super::output::{end_if_unread, outln};
use super::table_file::{self, TableFile};
use super::{Exit, apart};
use std::path::Path;
use std::sync::atomic::Ordering;
use terraglue_diagnostics::{Error, Result};
use terraglue_fmi::description::ModelDescription;
use terraglue_fmi::instance::Trace;
use terraglue_fmi::{Error as FmiError, Fmu};
use terraglue_fmu::simulate::{self, Settings, Table, Tables};
use terraglue_fmu::{references, trace};
use terraglue_host::crash::Beginning;
use terraglue_host::isolation::confine;
use terraglue_scenario::InputError;

/// Does the command.
pub fn fmu(command: &FmuCommand) -> Result<Exit> {
    match command {
        FmuCommand::Run(arguments) if arguments.isolate => apart::run(arguments),
        FmuCommand::Run(arguments) => run(arguments),
        FmuCommand::Info { fmu, json } => info(fmu, *json, input),
        FmuCommand::Check { fmu, run, within } => check(fmu, run.then_some(*within)),
    }
}

fn input(message: impl ToString) -> Error {
    let message = message.to_string();
    // an error of the system has a cure of its own
    let help =
        (!message.contains("(os error ")).then(|| "docs/fmi.md lists the supported parts of FMI".into());
    InputError::plain(message, help).into()
}

/// Bounds this process, which ends with the one that waits for it; false: that one has ended.
fn is_confined(arguments: &FmuRunArguments) -> bool {
    confine(arguments.memory_mb.saturating_mul(1 << 20));
    apart::end_with_parent(apart::parent())
}

fn run(arguments: &FmuRunArguments) -> Result<Exit> {
    let interrupt = Interrupt::listen();
    let stopped = interrupt.flag();
    if apart::is_child() && !is_confined(arguments) {
        return Ok(Exit::Interrupted);
    }
    let fmu = Fmu::open(&arguments.fmu).map_err(input)?;
    let settings = settings(arguments)?;
    if !settings.strict {
        for warning in fmu.description().warnings() {
            log::warn!(target: "terraglue_fmu", "{warning}");
        }
    }
    if let Err(error) = simulate::check(&fmu, &settings, arguments.intermediate.is_some()) {
        return Ok(failed(&arguments.fmu, &error));
    }
    interrupt.run();
    let file = arguments.csv.as_deref().map(TableFile::create).transpose()?;
    let between = arguments.intermediate.as_deref().map(TableFile::create).transpose()?;
    let tables: Vec<TableFile> = [&file, &between].into_iter().flatten().cloned().collect();
    let _exit_hook = table_file::exit_hook(&arguments.fmu, tables.clone());
    let mut report = apart::Report::of_child();
    // a worker's crash is told by the process that waits for it
    let _crash = report.is_none().then(|| Beginning::of_run(&arguments.fmu));
    let mut row = |text: &str| {
        if stopped.load(Ordering::Relaxed) {
            return Err(FmiError::Refused("stopped".into()));
        }
        match (&file, &report) {
            (Some(file), _) => line(file, text)?,
            (None, None) => outln!("{text}"),
            (None, Some(_)) => {}
        }
        let told = report.as_mut().map_or(Ok(()), |report| report.row(text, file.is_none()));
        told.inspect_err(end_if_unread).map_err(|e| FmiError::Refused(format!("the table: {e}")))
    };
    let mut row_between = between.as_ref().map(|file| |text: &str| line(file, text));
    let intermediate = row_between.as_mut().map(|row| row as simulate::Line);
    let ran = simulate::run(
        &fmu,
        &settings,
        Box::new(tell),
        &mut Tables { rows: &mut row, intermediate, keep: &|| keep(&tables) },
    );
    for table in &tables {
        table.flush().map_err(|source| Error::File { path: "the table".into(), source })?;
    }
    match ran {
        Ok(ended) => {
            let name = arguments.fmu.display();
            ended
                .iter()
                .for_each(|t| eprintln!("note: {name}: the FMU asked for the end of the run at t = {t} s"));
            Ok(Exit::Done)
        }
        Err(_) if stopped.load(Ordering::Relaxed) => Ok(Exit::Interrupted),
        Err(error) => Ok(failed(&arguments.fmu, &error)),
    }
}

fn traced(path: &Path) -> Result<Trace> {
    trace::to_file(path).map_err(|source| Error::File { path: path.display().to_string(), source })
}

/// Settings of a run from the options.
fn settings(arguments: &FmuRunArguments) -> Result<Settings> {
    Ok(Settings {
        start: arguments.start.clone(),
        start_time: arguments.start_time,
        stop: arguments.stop,
        step: arguments.step,
        tolerance: arguments.tolerance,
        outputs: arguments.output.clone(),
        event_mode: arguments.event_mode,
        input: arguments
            .input
            .as_deref()
            .map(|path| Table::read(path, false).map_err(input))
            .transpose()?
            .unwrap_or_default()
            .into(),
        hold_inputs: arguments.hold_inputs,
        no_rollback: arguments.no_rollback,
        log_categories: arguments.log_categories.clone(),
        strict: arguments.strict,
        trace: arguments.trace.as_deref().map(traced).transpose()?,
        on_nan: arguments.on_nan,
    })
}

/// Says why a run of an FMU ended, and whose fault it is.
fn failed(fmu: &Path, error: &FmiError) -> Exit {
    eprintln!("error: {}: {error}", fmu.display());
    let (help, exit) = match error {
        FmiError::WrongInput(_) => (
            "`terraglue fmu info` lists the variables of an FMU, `terraglue fmu run --help` the options",
            Exit::WrongInput,
        ),
        _ => (
            "`terraglue fmu check` lists what is wrong with an FMU, `--isolate` keeps it apart",
            Exit::Failed,
        ),
    };
    eprintln!("  help: {help}");
    exit
}

/// Puts all rows so far on disk: code of the FMU that could crash comes next.
fn keep(tables: &[TableFile]) -> terraglue_fmi::Result {
    tables
        .iter()
        .try_for_each(|table| table.flush().map_err(|e| FmiError::Refused(format!("the table: {e}"))))
}

fn line(file: &TableFile, text: &str) -> terraglue_fmi::Result {
    file.line(text).map_err(|e| FmiError::Refused(format!("the table: {e}")))
}

/// Hands a line of the FMU's log on.
fn tell(line: &terraglue_fmi::LogLine) {
    log::log!(target: "terraglue_fmu", level(line), "{}", line.text);
}

fn level(line: &terraglue_fmi::LogLine) -> log::Level {
    use terraglue_subsystem::LogLevel;
    match line.level {
        LogLevel::Error => log::Level::Error,
        LogLevel::Warning => log::Level::Warn,
        LogLevel::Info => log::Level::Info,
        LogLevel::Debug => log::Level::Debug,
    }
}

/// Lists what is wrong with an FMU; with a share also how far it is from the results that it brings with it, and whether that is more.
fn check(fmu: &Path, within: Option<f64>) -> Result<Exit> {
    let (d, entries) = Fmu::inspect(fmu).map_err(input)?;
    let mut problems = problems(&d, &entries);
    problems.extend(Fmu::library_defect(fmu, &d).map_err(input)?);
    for problem in &problems {
        outln!("{problem}");
    }
    let name = fmu.display();
    if problems.is_empty() {
        outln!("{name}: no problem found");
    }
    let exit = if problems.is_empty() { Exit::Done } else { Exit::Failed };
    let Some(within) = within else { return Ok(exit) };
    let opened = Fmu::open(fmu).map_err(input)?;
    let runs = match references::rerun(&opened, || Box::new(tell)) {
        Ok(runs) if runs.is_empty() => {
            let text = format!("{name}: it holds no results of its default experiment (FMI-LS-REF)");
            return Err(input(text));
        }
        Ok(runs) => runs,
        Err(error) => return Ok(failed(fmu, &error)),
    };
    let mut off = false;
    for run in &runs {
        outln!("{}: {} rows", run.file, run.rows);
        if !run.foreign.is_empty() {
            outln!("not compared, as the FMU has no such variable: {}", run.foreign.join(", "));
        }
        outln!("{}", deviations(run, within));
        if !run.lacking.is_empty() {
            outln!("without a reference: {}", run.lacking.join(", "));
        }
        if run.deviations.is_empty() {
            outln!("{}: nothing was compared: it holds no output of the FMU", run.file);
            off = true;
        }
        off |= run.deviations.iter().any(|d| !(d.share <= within));
    }
    Ok(if off { Exit::Failed } else { exit })
}

fn deviations(run: &references::Rerun, within: f64) -> comfy_table::Table {
    let mut table = comfy_table::Table::new();
    table.load_preset(comfy_table::presets::ASCII_MARKDOWN);
    table.set_header(["output", "largest difference", "at t, s", "of its range", ""]);
    for d in &run.deviations {
        let verdict = if d.share <= within { "" } else { "off" };
        let cells = [d.name.clone(), format!("{:.3e}", d.largest), d.at_s.to_string()];
        table.add_row(cells.into_iter().chain([format!("{:.3e}", d.share), verdict.to_owned()]));
    }
    table
}

fn problems(d: &ModelDescription, entries: &[String]) -> Vec<String> {
    let mut all = d.problems.clone();
    let library = terraglue_fmi::library_entry(d);
    if !entries.contains(&library) {
        let found = terraglue_fmi::platforms(entries.iter().map(String::as_str));
        all.push(format!("there is no library `{library}`; platforms: {}", found.join(", ")));
    }
    all.extend(d.defects().iter().map(ToString::to_string));
    all
}
