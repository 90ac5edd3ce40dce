//! The Modelica Reference FMUs, built outside the repository: `TERRAGLUE_FMU_DIR` holds them and their tables
//! `NAME_out.csv`, in any subfolder.

use crate::process::{Outcome, command};
use crate::validate::{Context, Figure, Limit};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Largest difference of a real, as a share of its range.
const SHARE: f64 = 1e-3;

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let Some(folder) = std::env::var_os("TERRAGLUE_FMU_DIR") else {
        return Ok(vec![Figure::skipped("fmi.reference", "TERRAGLUE_FMU_DIR is not set")]);
    };
    let mut files = Vec::new();
    collect(Path::new(&folder), &mut files);
    files.sort();
    let stem = |p: &Path| p.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let is = |p: &Path, e: &str| p.extension().is_some_and(|x| x == e);
    let tables: BTreeMap<String, PathBuf> = files
        .iter()
        .filter(|p| is(p, "csv"))
        .filter_map(|p| Some((stem(p).strip_suffix("_out")?.to_owned(), p.clone())))
        .collect();
    let units = files.iter().filter(|p| is(p, "fmu"));
    let figure = |(number, unit): (usize, &PathBuf)| {
        let name = stem(unit);
        let id = format!("fmi.reference.{number}.{name}");
        match tables.get(&name) {
            None if name == "Clocks" => refused(id, unit),
            None => Figure::skipped(id, format!("{}: there is no {name}_out.csv", unit.display())),
            Some(table) => match worst(context, unit, table) {
                Ok(share) => Figure::new(
                    id,
                    share,
                    Limit::AtMost(SHARE),
                    "largest difference over the range, away from events",
                ),
                Err(why) => Figure::new(id, f64::NAN, Limit::AtMost(SHARE), why.replace(['\n', '\t'], " ")),
            },
        }
    };
    Ok(units.enumerate().map(figure).collect())
}

/// Whether a unit made for scheduled execution is refused by its name.
fn refused(id: String, unit: &Path) -> Figure {
    let said = terraglue_fmi::Fmu::inspect(unit).err().map(|e| e.to_string()).unwrap_or_default();
    let named = said.contains("`Clocks` is made for scheduled execution");
    let what = "refused by name as made for scheduled execution (1: yes)";
    Figure::new(id, f64::from(u8::from(named)), Limit::Equal(1.0), what)
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { collect(&path, files) } else { files.push(path) }
    }
}

type Table = (Vec<String>, Vec<Vec<String>>);

fn read(text: &str) -> Table {
    let mut lines =
        text.lines().map(|l| l.split(',').map(|w| w.trim().trim_matches('"').to_owned()).collect());
    (lines.next().unwrap_or_default(), lines.collect())
}

/// Runs a unit on the times of its table. Rows beside a jump are left out; texts and whole numbers must be equal.
fn worst(context: &Context, unit: &Path, table: &Path) -> Outcome<f64> {
    let (names, rows) = read(&std::fs::read_to_string(table).map_err(|e| e.to_string())?);
    let time = |row: &[String]| row.first().and_then(|t| t.parse::<f64>().ok()).unwrap_or(f64::NAN);
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Err("the table is empty".into());
    };
    let step = (time(last) - time(first)) / (rows.len() - 1) as f64;
    let mut run = command(&context.program, &["fmu", "run"]);
    run.arg(unit).args(["--stop", &time(last).to_string(), "--step", &step.to_string()]);
    // Tables are written for both versions; a unit of FMI 2 has some of their columns only.
    let (description, _) = terraglue_fmi::Fmu::inspect(unit).map_err(|e| e.to_string())?;
    let has = |name: &&String| description.position(name).is_some();
    let wanted: Vec<&String> = names[1..].iter().filter(has).collect();
    run.args(["--output", &wanted.iter().map(|n| n.as_str()).collect::<Vec<_>>().join(",")]);
    let input =
        table.with_file_name(table.file_name().unwrap_or_default().to_string_lossy().replace("_out", "_in"));
    if let Ok(text) = std::fs::read_to_string(&input) {
        run.arg("--input").arg(kept(context, &text, |name| description.position(name).is_some())?);
    }
    let done = run.output().map_err(|e| e.to_string())?;
    if !done.status.success() {
        return Err(String::from_utf8_lossy(&done.stderr).into_owned());
    }
    let (own, ours) = read(&String::from_utf8_lossy(&done.stdout));
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
        worst = worst.max(difference(name, &a, &b)?);
    }
    Ok(worst)
}

/// A copy of a table of inputs with the columns that a unit has.
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
    let range = numbers.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x))
        - numbers.iter().fold(f64::INFINITY, |m, x| m.min(*x));
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
