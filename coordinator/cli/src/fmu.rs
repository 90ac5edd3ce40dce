//! `terraglue fmu run | info | check`: one functional mock-up unit.

use super::arguments::{FmuCommand, FmuRunArguments};
use super::interrupt::Interrupt;
use super::output::outln;
use super::table_file::{self, TableFile};
use super::{Exit, apart, show};
use std::fmt::Debug;
use std::path::Path;
use std::sync::atomic::Ordering;
use terraglue_diagnostics::{Error, Result};
use terraglue_fmi::description::ModelDescription;
use terraglue_fmi::{Error as FmiError, Fmu};
use terraglue_fmu::simulate::{self, InputRow, Settings, Table, Tables};
use terraglue_host::isolation::confine;
use terraglue_scenario::InputError;

/// Does the command.
pub fn fmu(command: &FmuCommand) -> Result<Exit> {
    match command {
        FmuCommand::Run(arguments) if arguments.isolate => apart::run(arguments),
        FmuCommand::Run(arguments) => run(arguments),
        FmuCommand::Info { fmu } => info(fmu),
        FmuCommand::Check { fmu } => check(fmu),
    }
}

fn input(message: impl ToString) -> Error {
    let message = message.to_string();
    // what the system says has a cure of its own
    let help = (!message.contains("(os error "))
        .then(|| "docs/fmi.md tells what is read of FMUs, and how they are run".into());
    InputError::plain(message, help).into()
}

fn run(arguments: &FmuRunArguments) -> Result<Exit> {
    let interrupt = Interrupt::listen();
    let stopped = interrupt.flag();
    if apart::is_child() {
        apart::end_with_parent();
        confine(arguments.memory_mb.saturating_mul(1 << 20));
    }
    let fmu = Fmu::open(&arguments.fmu).map_err(input)?;
    for problem in &fmu.description().problems {
        log::warn!(target: "terraglue_fmu", "{problem}");
    }
    let settings = settings(arguments)?;
    if let Err(error) = simulate::check(&fmu, &settings, arguments.intermediate.is_some()) {
        return Ok(failed(&arguments.fmu, &error));
    }
    interrupt.run();
    let file = arguments.csv.as_deref().map(TableFile::create).transpose()?;
    let between = arguments.intermediate.as_deref().map(TableFile::create).transpose()?;
    let tables: Vec<TableFile> = [&file, &between].into_iter().flatten().cloned().collect();
    let _exit_hook = table_file::exit_hook(&arguments.fmu, tables.clone());
    let sink = Box::new(|line: &terraglue_fmi::LogLine| {
        log::log!(target: "terraglue_fmu", level(line), "{}", line.text);
    });
    let child = apart::is_child();
    let mut row = |text: &str| {
        if stopped.load(Ordering::Relaxed) {
            return Err(FmiError::Refused("stopped".into()));
        }
        match &file {
            None => outln!("{text}"),
            Some(file) => line(file, text)?,
        }
        if child {
            apart::reached(text);
        }
        Ok(())
    };
    let mut row_between = between.as_ref().map(|file| |text: &str| line(file, text));
    let intermediate = row_between.as_mut().map(|row| row as simulate::Line);
    let ran = simulate::run(&fmu, &settings, sink, &mut Tables { rows: &mut row, intermediate });
    for table in &tables {
        table.flush().map_err(|source| Error::File { path: "the table".into(), source })?;
    }
    match ran {
        Ok(ended) => {
            if let Some(t) = ended {
                eprintln!(
                    "note: {}: the FMU asked for the end of the run at t = {t} s",
                    arguments.fmu.display()
                );
            }
            Ok(Exit::Done)
        }
        Err(_) if stopped.load(Ordering::Relaxed) => Ok(Exit::Interrupted),
        Err(error) => Ok(failed(&arguments.fmu, &error)),
    }
}

/// What the options say of a run.
fn settings(arguments: &FmuRunArguments) -> Result<Settings> {
    Ok(Settings {
        start: arguments.start.clone(),
        start_time: arguments.start_time,
        stop: arguments.stop,
        step: arguments.step,
        tolerance: arguments.tolerance,
        outputs: arguments.output.clone(),
        event_mode: arguments.event_mode,
        input: arguments.input.as_deref().map(table).transpose()?.unwrap_or_default().into(),
        hold_inputs: arguments.hold_inputs,
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

fn line(file: &TableFile, text: &str) -> terraglue_fmi::Result {
    file.line(text).map_err(|e| FmiError::Refused(format!("the table: {e}")))
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

fn table(path: &Path) -> Result<Table> {
    let wrong = |e: &dyn std::fmt::Display| input(format!("{}: {e}", path.display()));
    let file = terraglue_subsystem::files::open(path).map_err(|e| wrong(&e))?;
    let mut reader = csv::Reader::from_reader(file);
    let header = reader.headers().map_err(|e| wrong(&e))?.clone();
    if header.get(0) != Some("time") {
        return Err(wrong(&"the first column is not `time`"));
    }
    let mut rows: Vec<InputRow> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| wrong(&e))?;
        let line = rows.len() + 2;
        let mut cells = record.iter().map(|t| t.trim().to_owned());
        let time = cells.next().and_then(|t| t.parse().ok()).filter(|t: &f64| t.is_finite());
        let time = time.ok_or_else(|| wrong(&format!("line {line}: the time is no number")))?;
        if rows.last().is_some_and(|before| before.time >= time) {
            return Err(wrong(&format!("line {line}: the time does not grow")));
        }
        let cells: Vec<String> = cells.collect();
        let numbers = cells.iter().map(|t| t.parse().unwrap_or(f64::NAN)).collect();
        rows.push(InputRow { time, cells, numbers });
    }
    Ok(Table { names: header.iter().skip(1).map(str::to_owned).collect(), rows })
}

fn info(fmu: &Path) -> Result<Exit> {
    let (d, entries) = Fmu::inspect(fmu).map_err(input)?;
    let platforms = terraglue_fmi::platforms(entries.iter().map(String::as_str));
    outln!("{}: `{}`, {}", fmu.display(), d.model_name, words(&d.version));
    let facts = [("made by", &d.generation_tool), ("about", &d.description), ("author", &d.author)];
    for (name, text) in facts.iter().filter(|(_, text)| !text.is_empty()) {
        outln!("{name}: {text}");
    }
    outln!("platforms: {}", if platforms.is_empty() { "none".into() } else { platforms.join(", ") });
    outln!("experiment: {}", words(&d.experiment));
    outln!("capabilities: {}", words(&d.capabilities));
    let mut table =
        show::table(&["variable", "reference", "type", "causality", "variability", "unit", "start"]);
    for v in &d.variables {
        let kind = if v.sizes.is_empty() {
            words(&v.value_type)
        } else {
            format!("{:?}{:?}", v.value_type, v.sizes)
        };
        let unit = v.unit.clone().unwrap_or_default();
        let start = words(&v.start);
        let reference = v.reference.to_string();
        table.add_row([
            &v.name,
            &reference,
            &kind,
            &words(&v.causality),
            &words(&v.variability),
            &unit,
            &start,
        ]);
    }
    outln!("{table}");
    for t in &d.terminals {
        let members: Vec<&str> = t.members.iter().map(|(_, k)| d.variables[*k].name.as_str()).collect();
        outln!("terminal `{}` ({}): {}", t.name, t.kind, members.join(", "));
    }
    Ok(Exit::Done)
}

fn words(value: &impl Debug) -> String {
    format!("{value:?}")
}

fn check(fmu: &Path) -> Result<Exit> {
    let (d, entries) = Fmu::inspect(fmu).map_err(input)?;
    let problems = problems(&d, &entries);
    for problem in &problems {
        outln!("{problem}");
    }
    let name = fmu.display();
    if problems.is_empty() {
        outln!("{name}: no problem found");
        return Ok(Exit::Done);
    }
    Ok(Exit::Failed)
}

fn problems(d: &ModelDescription, entries: &[String]) -> Vec<String> {
    let mut all = d.problems.clone();
    let library = terraglue_fmi::library_entry(d);
    if !entries.contains(&library) {
        let found = terraglue_fmi::platforms(entries.iter().map(String::as_str));
        all.push(format!("there is no library `{library}`; platforms: {}", found.join(", ")));
    }
    for v in &d.variables {
        if v.has_start()
            && v.start == terraglue_fmi::description::Start::None
            && !v.alias
            && v.value_type != terraglue_subsystem::ValueType::Clock
        {
            all.push(format!("line {}: `{}` needs a start value", v.line, v.name));
        }
        if let Some(unit) = v.unit.as_ref().filter(|u| !d.units.iter().any(|(n, _)| n == *u)) {
            all.push(format!(
                "line {}: `{}` has the unit `{unit}`, whose base units are not given",
                v.line, v.name
            ));
        }
    }
    all
}
