//! A table of values: `case, parameters, t, quantity, value, source`. Cases go by their prefix.

use super::answers::Answers;
use super::extrapolate::batches;
use super::parameters::Parameters;
use super::{Figure, Limit, foot, oscillator, planar, six_feet};
use crate::process::{Outcome, read};
use std::path::Path;

/// Said of every file that cannot be read.
const COLUMNS: &str = "its columns are case, parameters, t, quantity, value, source, with one row per value";

/// One row.
struct ReferenceRow {
    case: String,
    parameters: String,
    t: Option<f64>,
    quantity: String,
    value: f64,
}

/// A figure per row of a file.
pub fn figures(file: &Path) -> Outcome<Vec<Figure>> {
    let rows = rows(&read(file)?).map_err(|e| format!("{}: {e}; {COLUMNS}", file.display()))?;
    let mut all = Vec::new();
    for group in rows.chunk_by(|a, b| a.case == b.case && a.parameters == b.parameters) {
        all.extend(judge(group));
    }
    Ok(all)
}

/// All rows of a case; those whose times have a step in common share one set of runs.
fn judge(group: &[ReferenceRow]) -> Vec<Figure> {
    let times: Vec<Option<f64>> = group.iter().map(|r| r.t).collect();
    let mut all: Vec<(usize, Figure)> = Vec::new();
    for batch in batches(&times) {
        let rows: Vec<&ReferenceRow> = batch.iter().map(|k| &group[*k]).collect();
        all.extend(batch.into_iter().zip(judge_together(&rows)));
    }
    all.sort_by_key(|(k, _)| *k);
    all.into_iter().map(|(_, figure)| figure).collect()
}

/// Rows of one set of runs. Where they cannot be answered each is tried alone; one that cannot is a row that fails.
fn judge_together(rows: &[&ReferenceRow]) -> Vec<Figure> {
    match (answer(rows), rows) {
        (Ok(answers), _) => rows.iter().enumerate().map(|(k, row)| figure(row, &answers, k)).collect(),
        (Err(why), [row]) => {
            let note = why.lines().next().unwrap_or_default().to_owned();
            let none = Answers { values: vec![f64::NAN], tolerance: vec![0.0], relative: false, note };
            vec![figure(row, &none, 0)]
        }
        (Err(_), _) => rows.iter().flat_map(|row| judge_together(&[row])).collect(),
    }
}

fn answer(rows: &[&ReferenceRow]) -> Outcome<Answers> {
    let Some(first) = rows.first() else { return Err("no row".into()) };
    let wanted: Vec<(Option<f64>, String)> = rows.iter().map(|r| (r.t, r.quantity.clone())).collect();
    let p = Parameters(&first.parameters);
    let case = first.case.as_str();
    match case.split('-').next().unwrap_or_default() {
        "OSC" => oscillator::answer(p, &wanted),
        "PEND" | "DP" | "FB" => planar::answer(case, p, &wanted),
        "FOOT" => foot::answer(p, &wanted),
        "TABLE" => six_feet::answer(case, p, &wanted),
        other => Err(format!("no case begins with `{other}`")),
    }
}

fn figure(row: &ReferenceRow, answers: &Answers, k: usize) -> Figure {
    // a difference from nothing is no share of it
    let relative = answers.relative && row.value != 0.0;
    let scale = if relative { row.value.abs() } else { row.value.abs().max(1.0) };
    let difference = (answers.values[k] - row.value).abs() / scale;
    let at = row.t.map_or_else(String::new, |t| format!(".t{t}"));
    let what = format!("{} against {}; {}", answers.values[k], row.value, answers.note);
    let id = format!("gluing.{}{at}.{}", row.case, row.quantity);
    Figure::new(id, difference, Limit::AtMost(answers.tolerance[k]), what)
}

fn rows(text: &str) -> Outcome<Vec<ReferenceRow>> {
    let mut lines = text.lines().filter(|l| !l.trim().is_empty()).enumerate();
    let head = lines.next().map(|(_, l)| fields(l)).unwrap_or_default();
    if head.len() < 5 || head[..5] != ["case", "parameters", "t", "quantity", "value"] {
        return Err("the header is another".into());
    }
    let rows: Vec<ReferenceRow> = lines
        .map(|(k, line)| {
            let f = fields(line);
            let wrong = |what: &str| format!("line {}: {what}", k + 1);
            let [case, parameters, t, quantity, value, ..] = f.as_slice() else {
                return Err(wrong("five fields are needed"));
            };
            let t = match t.is_empty() {
                true => None,
                false => Some(t.parse().map_err(|_| wrong("t is no number"))?),
            };
            if t.is_some_and(|t: f64| !(t.is_finite() && t > 0.0)) {
                return Err(wrong("t is no time after the start, s"));
            }
            let value = value.parse().map_err(|_| wrong("the value is no number"))?;
            Ok(ReferenceRow {
                case: case.clone(),
                parameters: parameters.clone(),
                t,
                quantity: quantity.clone(),
                value,
            })
        })
        .collect::<Outcome<_>>()?;
    if rows.is_empty() { Err("there is no row below the header".into()) } else { Ok(rows) }
}

/// Fields of a line; quotes hold commas together.
fn fields(line: &str) -> Vec<String> {
    let mut out = vec![String::new()];
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => out.push(String::new()),
            c => {
                if let Some(last) = out.last_mut() {
                    last.push(c);
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_values_is_named_with_the_columns_that_it_needs() {
        let head = "case,parameters,t,quantity,value,source\n";
        let folder = tempfile::tempdir().expect("a folder");
        let said = |text: &str| {
            let path = folder.path().join("values.csv");
            std::fs::write(&path, text).expect("written");
            figures(&path).expect_err("no values")
        };
        for (text, why) in [(head, "no row"), ("", "header"), ("a,b\n1,2\n", "header")] {
            let said = said(text);
            assert!(
                said.contains("values.csv")
                    && said.contains(why)
                    && said.contains("case, parameters, t, quantity"),
                "{said}"
            );
        }
    }
}
