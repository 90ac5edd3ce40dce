//! Reference results inside an FMU: run again, and written when one is exported (layered standard FMI-LS-REF).
//!
//! A file with the role `result` holds the outputs of the default experiment, as in the Modelica Reference FMUs; the inputs of this
//! experiment are those of a file with the role `experiment`, where there is one. Both are tables as `fmu run` reads and writes them.

use super::map::element_name;
use super::simulate::{self, Settings, Tables};
use super::table::{InputRow, Table};
use std::fmt::Write;
use std::sync::Arc;
use terraglue_fmi::description::{Causality, Variable};
use terraglue_fmi::instance::Sink;
use terraglue_fmi::references::{FOLDER, MANIFEST, Related, related};
use terraglue_fmi::{Error, Fmu, Result};
use terraglue_subsystem::ValueType;

/// How far an output is from its reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviation {
    /// Name of the output, or of an element.
    pub name: String,
    /// Largest difference, in its unit; infinite where texts differ.
    pub largest: f64,
    /// Time of it, s.
    pub at_s: f64,
    /// The same over the range of the reference, or over its largest value where it is constant.
    pub share: f64,
}

/// A reference result that was run again.
#[derive(Clone, Debug, PartialEq)]
pub struct Rerun {
    /// File in the FMU.
    pub file: String,
    /// Rows that were compared.
    pub rows: usize,
    /// Of each column.
    pub deviations: Vec<Deviation>,
    /// Outputs for which it has no column.
    pub lacking: Vec<String>,
    /// Columns for which the FMU has no variable, as where one file serves FMUs of both versions.
    pub foreign: Vec<String>,
}

/// Runs the default experiment of an FMU as often as it holds results of it, and compares.
///
/// # Errors
/// A file that is not there or no table, an unknown output, or what the FMU does wrong.
pub fn rerun(fmu: &Arc<Fmu>, sink: impl Fn() -> Sink) -> Result<Vec<Rerun>> {
    let files = related(fmu)?;
    let table = |file: &Related| {
        let path = fmu.folder().join(&file.path);
        Table::read(&path, true).map_err(|message| {
            let message = message.replace(&path.display().to_string(), &file.path.display().to_string());
            Error::Refused(format!("reference result: {message}"))
        })
    };
    let tables = |role: &'static str| {
        files.iter().filter(move |f| f.role.split('/').next() == Some(role) && f.media_type == "text/csv")
    };
    let input = Arc::new(tables("experiment").next().map(table).transpose()?.unwrap_or_default());
    let mut all = Vec::new();
    for file in tables("result") {
        let (wanted, foreign) = fitted(fmu, &table(file)?)?;
        let (Some(first), Some(last)) = (wanted.rows.first(), wanted.rows.last()) else { continue };
        let settings = Settings {
            outputs: variables(fmu, &wanted.names),
            start_time: Some(first.time),
            stop: Some(last.time),
            input: Arc::clone(&input),
            ..Settings::default()
        };
        let (found, _) = fitted(fmu, &run(fmu, &settings, sink())?)?;
        let deviations =
            wanted.names.iter().enumerate().map(|(k, name)| deviation(name, (&wanted, k), &found));
        let deviations = deviations.collect::<Result<_>>()?;
        all.push(Rerun {
            file: file.path.display().to_string(),
            rows: wanted.rows.len(),
            lacking: lacking(fmu, &wanted.names),
            deviations,
            foreign,
        });
    }
    Ok(all)
}

/// Outputs for which there is no column.
fn lacking(fmu: &Fmu, columns: &[String]) -> Vec<String> {
    let compared = variables(fmu, columns);
    let output = |v: &&Variable| {
        v.causality == Causality::Output && v.value_type != ValueType::Clock && !compared.contains(&v.name)
    };
    fmu.description().variables.iter().filter(output).map(|v| v.name.clone()).collect()
}

/// The variable of a column, which may be an element of it.
fn variable<'a>(fmu: &'a Fmu, column: &str) -> Option<&'a Variable> {
    let description = fmu.description();
    let base = column.rfind('[').map_or(column, |at| &column[..at]);
    let k = description.position(column).or_else(|| description.position(base))?;
    Some(&description.variables[k])
}

/// Names of the variables of columns, each once.
fn variables(fmu: &Fmu, columns: &[String]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for v in columns.iter().filter_map(|column| variable(fmu, column)) {
        if names.iter().all(|n| *n != v.name) {
            names.push(v.name.clone());
        }
    }
    names
}

/// A table with a column for each element of an array, which results may hold in one cell, and numbers for truth values; and the columns
/// for which the FMU has no variable.
fn fitted(fmu: &Fmu, table: &Table) -> Result<(Table, Vec<String>)> {
    let mut fitted = Table {
        path: table.path.clone(),
        names: Vec::new(),
        rows: table.rows.iter().map(|row| InputRow { time: row.time, ..InputRow::default() }).collect(),
    };
    let mut foreign = Vec::new();
    for (k, name) in table.names.iter().enumerate() {
        let Some(v) = variable(fmu, name) else {
            foreign.push(name.clone());
            continue;
        };
        let whole = !v.sizes.is_empty()
            && v.name == *name
            && !matches!(v.value_type, ValueType::String | ValueType::Binary);
        match whole {
            true => fitted.names.extend((0..v.len()).map(|element| element_name(v, element))),
            false => fitted.names.push(name.clone()),
        }
        for (row, from) in fitted.rows.iter_mut().zip(&table.rows) {
            let cell = from.cells[k].as_str();
            let words: Vec<&str> = if whole { cell.split_whitespace().collect() } else { vec![cell] };
            if whole && words.len() != v.len() {
                let (count, time) = (words.len(), from.time);
                return Err(Error::Refused(format!(
                    "reference result: `{name}` has {count} values at t = {time} s, and {} elements",
                    v.len()
                )));
            }
            let plain = |word: &str| match (v.value_type, word) {
                (ValueType::Bool, "true") => "1".to_owned(),
                (ValueType::Bool, "false") => "0".to_owned(),
                _ => word.to_owned(),
            };
            row.cells.extend(words.into_iter().map(plain));
        }
    }
    if let (true, Some(name)) = (fitted.names.is_empty(), foreign.first()) {
        return Err(Error::Refused(format!("reference result: the FMU has no output `{name}`")));
    }
    for row in &mut fitted.rows {
        row.numbers = row.cells.iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
    }
    Ok((fitted, foreign))
}

/// The table of a run.
fn run(fmu: &Arc<Fmu>, settings: &Settings, sink: Sink) -> Result<Table> {
    let mut text = String::new();
    let mut row = |line: &str| {
        text.push_str(line);
        text.push('\n');
        Ok(())
    };
    simulate::run(fmu, settings, sink, &mut Tables { rows: &mut row, intermediate: None, keep: &|| Ok(()) })?;
    Table::parse(text.as_bytes(), true).map_err(Error::Refused)
}

/// Share of the size of an array below which differences are rounding.
const ROUNDING: f64 = 1e-9;

fn deviation(name: &str, (wanted, column): (&Table, usize), found: &Table) -> Result<Deviation> {
    let own = found.names.iter().position(|n| n == name || n.strip_suffix("[1]") == Some(name));
    let own =
        own.ok_or_else(|| Error::Refused(format!("reference result: the FMU has no output `{name}`")))?;
    let (mut low, mut high, mut largest, mut at_s) =
        (f64::INFINITY, f64::NEG_INFINITY, 0.0, wanted.rows[0].time);
    for row in &wanted.rows {
        let number = row.numbers[column];
        (low, high) = (low.min(number), high.max(number));
        let off = match number.is_nan() {
            true if row.cells[column] == found.cell(row.time, own) => 0.0,
            true => f64::INFINITY,
            false => (found.number(row.time, own) - number).abs(),
        };
        if off > largest || off.is_nan() {
            (largest, at_s) = (off, row.time);
        }
    }
    // what the elements of an array have in common is a size: differences of its rounding are none
    let base = |name: &str| name.split('[').next().unwrap_or(name).to_owned();
    let alike = |k: &usize| base(&wanted.names[*k]) == base(name);
    let columns = (0..wanted.names.len()).filter(alike);
    let size =
        columns.flat_map(|k| wanted.rows.iter().map(move |row| row.numbers[k].abs())).fold(0.0, f64::max);
    let range = if high > low { high - low } else { high.abs() }.max(ROUNDING * size);
    let share = if largest == 0.0 { 0.0 } else { largest / range.max(f64::MIN_POSITIVE) };
    Ok(Deviation { name: name.to_owned(), largest, at_s, share })
}

/// Steps of the reference result of an export, and every how many there is a row.
const STEPS: [usize; 2] = [100, 5];

/// End of the reference result of an export, s.
pub(super) fn stop_s(fmu: &Fmu) -> f64 {
    let experiment = fmu.description().experiment;
    let (start, step) = (experiment.start.unwrap_or(0.0), experiment.step.unwrap_or(0.001));
    experiment.stop.unwrap_or(1.0).min(start + STEPS[0] as f64 * step)
}

/// The files that let an exported FMU be checked, by their paths in the archive: the first steps of its default experiment.
///
/// # Errors
/// Errors of the FMU.
pub(super) fn files(fmu: &Arc<Fmu>, inputs: &str, sink: Sink) -> Result<Vec<(String, String)>> {
    let input = match inputs.is_empty() {
        true => Table::default(),
        false => Table::parse(inputs.as_bytes(), false).map_err(Error::Refused)?,
    };
    let settings = Settings { stop: Some(stop_s(fmu)), input: Arc::new(input), ..Settings::default() };
    let (mut rows, mut count) = (String::new(), 0_usize);
    let mut row = |line: &str| {
        // the header, then the row of the start
        if count <= 1 || (count - 1).is_multiple_of(STEPS[1]) {
            rows.push_str(line);
            rows.push('\n');
        }
        count += 1;
        Ok(())
    };
    simulate::run(
        fmu,
        &settings,
        sink,
        &mut Tables { rows: &mut row, intermediate: None, keep: &|| Ok(()) },
    )?;
    let mut manifest = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiReferences xmlns:fmi-ls=\"http://fmi-standard.org/fmi-ls-manifest\" \
        fmi-ls:fmi-ls-name=\"org.fmi-standard.fmi-ls-ref\" fmi-ls:fmi-ls-version=\"1.0.0-alpha.1\" fmi-ls:fmi-ls-description=\"Layered \
        Standard providing information on related files included in an FMU.\">\n"
        .to_owned();
    let mut all = vec![("result.csv", "result", "Outputs of the default experiment", rows)];
    if !inputs.is_empty() {
        all.push((
            "inputs.csv",
            "experiment/smoke-test",
            "Inputs of the default experiment",
            inputs.to_owned(),
        ));
    }
    for (name, role, description, _) in &all {
        // a text is written without an error
        let _ = writeln!(
            manifest,
            "  <Related type=\"text/csv\" source=\"{name}\" role=\"{role}\" description=\"{description}\"/>"
        );
    }
    all.push((MANIFEST, "", "", manifest + "</fmiReferences>\n"));
    Ok(all.into_iter().map(|(name, _, _, text)| (format!("{FOLDER}/{name}"), text)).collect())
}

/// How far feet are pressed in and dragged, m.
const WAY: [f64; 2] = [0.01, 0.02];

/// Inputs that press the feet of a soil in and drag them, as a table from 0 to `stop_s`; `places`: where each touches the ground, m. Empty
/// without feet.
pub(super) fn pressed(places: &[[f64; 3]], stop_s: f64) -> String {
    if places.is_empty() {
        return String::new();
    }
    let mut text = "time".to_owned();
    for (foot, axis) in (1..=places.len()).flat_map(|foot| (1..=3).map(move |axis| (foot, axis))) {
        text += &format!(",\"foot.position[{foot},{axis}]\"");
    }
    for (part, [down, along]) in [(0.0, [0.0, 0.0]), (0.5, [WAY[0], 0.0]), (1.0, WAY)] {
        text += &format!("\n{}", part * stop_s);
        for [x, y, z] in places {
            text += &format!(",{},{y},{}", x + along, z - down);
        }
    }
    text + "\n"
}
