//! The Modelica Reference FMUs, built outside the repository: `TERRAGLUE_FMU_DIR` holds them and their tables
//! `NAME_out.csv`, in any subfolder.
//!
//! The table of Feedthrough was made without its inputs; with them every whole number, truth value and text must come out as it
//! went in. Roberts has no table of its own: it is held against the solution in the literature.

use super::folder;
use crate::process::{Outcome, command};
use crate::{Context, Figure, Limit};
use std::path::{Path, PathBuf};
use terraglue_numerics::extremes::{larger, smaller};

/// Largest difference of a real, as a share of its range.
const SHARE: f64 = 1e-3;

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let Some(fmus) = folder::fmus() else {
        return Ok(vec![Figure::skipped("fmi.reference", folder::NOT_SET)]);
    };
    if fmus.reference.is_empty() {
        return Ok(vec![Figure::skipped("fmi.reference", "TERRAGLUE_FMU_DIR holds no reference FMUs")]);
    }
    let figure = |(number, fmu): (usize, &PathBuf)| {
        let name = folder::stem(fmu);
        let id = format!("fmi.reference.{number}.{name}");
        match fmus.tables.get(&name) {
            None if name == "Clocks" => refused(id, fmu),
            Some(table) if name != "Roberts" => judged(id, worst(context, fmu, table)),
            _ => judged(id, roberts(context, fmu)),
        }
    };
    Ok(fmus.reference.iter().enumerate().map(figure).collect())
}

fn judged(id: String, share: Outcome<f64>) -> Figure {
    let what = "largest difference over the range, away from events";
    match share {
        Ok(share) => Figure::new(id, share, Limit::AtMost(SHARE), what),
        Err(why) => Figure::new(id, f64::NAN, Limit::AtMost(SHARE), why.replace(['\n', '\t'], " ")),
    }
}

/// Robertson's reaction from 0 s to 40 s in steps of 0.4 s, against y1 and y3 at 0.4, 4 and 40 s (Hindmarsh 1980, ODEPACK).
fn roberts(context: &Context, fmu: &Path) -> Outcome<f64> {
    const KNOWN: [(usize, f64, f64); 3] =
        [(1, 9.8517e-1, 1.4794e-2), (10, 9.0551e-1, 9.4462e-2), (100, 7.1583e-1, 2.8416e-1)];
    let mut run = command(&context.program, &["fmu", "run"]);
    run.arg(fmu).args(["--start-time", "0", "--stop", "40", "--step", "0.4", "--output", "y1,y3"]);
    let (_, rows) = read(&output(&mut run)?);
    let mut worst = 0.0_f64;
    for (row, y1, y3) in KNOWN {
        let cell = |k: usize| rows.get(row).and_then(|r| r.get(k)?.parse::<f64>().ok()).unwrap_or(f64::NAN);
        let off = larger((cell(1) - y1).abs(), (cell(2) - y3).abs());
        worst = larger(worst, off);
    }
    Ok(worst)
}

/// Standard output of a run.
fn output(run: &mut std::process::Command) -> Outcome<String> {
    let done = run.output().map_err(|e| e.to_string())?;
    if !done.status.success() {
        return Err(String::from_utf8_lossy(&done.stderr).into_owned());
    }
    Ok(String::from_utf8_lossy(&done.stdout).into_owned())
}

/// Whether an FMU made for scheduled execution is refused by its name.
fn refused(id: String, fmu: &Path) -> Figure {
    let said = terraglue_fmi::Fmu::inspect(fmu).err().map(|e| e.to_string()).unwrap_or_default();
    let named = said.contains("`Clocks` is made for scheduled execution");
    let what = "refused by name as made for scheduled execution (1: yes)";
    Figure::new(id, f64::from(u8::from(named)), Limit::Equal(1.0), what)
}

type ReferenceTable = (Vec<String>, Vec<Vec<String>>);

fn read(text: &str) -> ReferenceTable {
    let mut lines =
        text.lines().map(|l| l.split(',').map(|w| w.trim().trim_matches('"').to_owned()).collect());
    (lines.next().unwrap_or_default(), lines.collect())
}

/// Runs an FMU on the times of its table. Rows next to a jump are left out; texts and whole numbers must be equal.
fn worst(context: &Context, fmu: &Path, table: &Path) -> Outcome<f64> {
    let (names, rows) = expanded(read(&std::fs::read_to_string(table).map_err(|e| e.to_string())?));
    let time = |row: &[String]| row.first().and_then(|t| t.parse::<f64>().ok()).unwrap_or(f64::NAN);
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Err("the table is empty".into());
    };
    let step = (time(last) - time(first)) / (rows.len() - 1) as f64;
    let mut run = command(&context.program, &["fmu", "run"]);
    run.arg(fmu).args(["--stop", &time(last).to_string(), "--step", &step.to_string()]);
    // Tables are written for both versions; an FMU of FMI 2 has some of their columns only.
    let (description, _) = terraglue_fmi::Fmu::inspect(fmu).map_err(|e| e.to_string())?;
    let mut wanted: Vec<&str> = names[1..].iter().map(|n| n.split('[').next().unwrap_or(n)).collect();
    wanted.retain(|name| description.position(name).is_some());
    wanted.dedup();
    let outputs = ["--output".to_owned(), wanted.join(",")];
    run.args(&outputs);
    let input =
        table.with_file_name(table.file_name().unwrap_or_default().to_string_lossy().replace("_out", "_in"));
    let (own, ours) = read(&output(&mut run)?);
    if let Ok(text) = std::fs::read_to_string(&input) {
        let kept = kept(context, &text, |name| description.position(name).is_some())?;
        let mut fed = command(&context.program, &["fmu", "run"]);
        fed.arg(fmu).args(["--stop", &time(last).to_string(), "--step", &step.to_string()]);
        fed.arg("--input").arg(&kept).args(&outputs);
        let inputs = read(&std::fs::read_to_string(&kept).map_err(|e| e.to_string())?);
        fed_through(&inputs, &read(&output(&mut fed)?))?;
    }
    if ours.len() != rows.len() {
        return Err(format!("{} rows, the table has {}", ours.len(), rows.len()));
    }
    let mut worst = 0.0_f64;
    for (column, name) in own.iter().enumerate().skip(1) {
        let theirs =
            names.iter().position(|n| n == name).ok_or_else(|| format!("`{name}` is not in the table"))?;
        let [a, b] = [(&rows, theirs), (&ours, column)].map(|(table, c)| {
            table.iter().map(|r| r.get(c).cloned().unwrap_or_default()).collect::<Vec<_>>()
        });
        worst = larger(worst, difference(name, &a, &b)?);
    }
    Ok(worst)
}

/// Splits columns whose cells are arrays of numbers into one for each element.
fn expanded((names, rows): ReferenceTable) -> ReferenceTable {
    let split = |cell: &str| -> Option<Vec<String>> {
        let words: Vec<String> = cell.split_whitespace().map(str::to_owned).collect();
        (words.len() > 1 && words.iter().all(|w| w.parse::<f64>().is_ok())).then_some(words)
    };
    let sizes: Vec<usize> = (0..names.len())
        .map(|c| rows.first().and_then(|r| split(r.get(c)?)).map_or(0, |w| w.len()))
        .collect();
    let name = |(name, size): (&String, &usize)| match size {
        0 => vec![name.clone()],
        n => (1..=*n).map(|k| format!("{name}[{k}]")).collect(),
    };
    let row = |row: &Vec<String>| {
        let cells = row.iter().zip(&sizes);
        cells
            .flat_map(|(c, size)| split(c).filter(|_| *size > 0).unwrap_or_else(|| vec![c.clone()]))
            .collect()
    };
    (names.iter().zip(&sizes).flat_map(name).collect(), rows.iter().map(row).collect())
}

/// Whether every whole number comes out of `NAME_output` as it went into `NAME_input` a step before.
fn fed_through((names, inputs): &ReferenceTable, (outputs, rows): &ReferenceTable) -> Outcome {
    let time = |row: &[String]| row.first().and_then(|t| t.parse::<f64>().ok()).unwrap_or(f64::NAN);
    for (column, name) in names.iter().enumerate().skip(1) {
        let output = name.replace("_input", "_output");
        let Some(place) = outputs.iter().position(|n| *n == output) else { continue };
        for pair in rows.windows(2) {
            let told = inputs.iter().rev().find(|r| time(r) <= time(&pair[0]) + 1e-9).or(inputs.first());
            let told = told.and_then(|r| r.get(column)).cloned().unwrap_or_default();
            let found = &pair[1][place];
            if told.parse::<i128>().is_ok() && *found != told {
                return Err(format!("`{output}` is {found} after {told} at t = {} s", pair[0][0]));
            }
        }
    }
    Ok(())
}

/// A copy of a table of inputs with the columns that an FMU has.
fn kept(context: &Context, text: &str, has: impl Fn(&str) -> bool) -> Outcome<PathBuf> {
    let (names, rows) = read(text);
    let columns: Vec<usize> = (0..names.len()).filter(|k| *k == 0 || has(&names[*k])).collect();
    let line =
        |row: &[String]| columns.iter().map(|k| row.get(*k).map_or("", |c| c)).collect::<Vec<_>>().join(",");
    let all: Vec<String> = std::iter::once(line(&names)).chain(rows.iter().map(|r| line(r))).collect();
    let path = context.scratch.join("input.csv");
    crate::process::write(&path, &(all.join("\n") + "\n"))?;
    Ok(path)
}

fn difference(name: &str, rows: &[String], ours: &[String]) -> Outcome<f64> {
    let cell = |table: &[String], k: usize| table[k].clone();
    let numbers: Option<Vec<f64>> = (0..rows.len()).map(|k| truth(&cell(rows, k))).collect();
    let Some(numbers) = numbers else {
        return match (0..rows.len()).find(|k| cell(rows, *k) != cell(ours, *k)) {
            Some(k) => Err(format!("`{name}` is `{}` in row {k}, not `{}`", cell(ours, k), cell(rows, k))),
            None => Ok(0.0),
        };
    };
    let range = numbers.iter().fold(f64::NEG_INFINITY, |m, x| larger(m, *x))
        - numbers.iter().fold(f64::INFINITY, |m, x| smaller(m, *x));
    let range = if range > 0.0 { range } else { 1.0 };
    // A jump: a change between neighbours that is far larger than usual.
    let jumps = |k: usize| k > 0 && (numbers[k] - numbers[k - 1]).abs() > 0.1 * range;
    let mut worst = 0.0_f64;
    for k in 0..rows.len() {
        let beside = [k.wrapping_sub(1), k, k + 1, k + 2].iter().any(|j| *j < rows.len() && jumps(*j));
        if !beside {
            let found = truth(&cell(ours, k)).unwrap_or(f64::NAN);
            worst =
                worst.max(if found.is_nan() { f64::INFINITY } else { (found - numbers[k]).abs() / range });
        }
    }
    Ok(worst)
}

fn truth(text: &str) -> Option<f64> {
    match text {
        "true" => Some(1.0),
        "false" => Some(0.0),
        other => other.parse().ok(),
    }
}
