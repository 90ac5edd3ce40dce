//! A table of values: `case, parameters, t, quantity, value, source`. Cases go by their prefix.

use super::extrapolate::Limits;
use super::parameters::Parameters;
use super::{Figure, Limit, foot, oscillator, planar, six_feet};
use crate::process::{Outcome, read};
use std::path::Path;

/// What the strategies say about the rows of one case.
pub struct Answers {
    /// One per row.
    pub values: Vec<f64>,
    /// Allowed difference by row.
    pub tolerance: Vec<f64>,
    /// Relative to the value; else to max(1, |value|).
    pub relative: bool,
    /// Strategy, integrator, step, extrapolation.
    pub note: String,
}

impl Answers {
    /// From runs with halved steps.
    pub fn extrapolated(limits: Limits, h: f64, halvings: u32, integrator: &str) -> Self {
        let note = format!(
            "iterative, {integrator}, h = {h:.3e} s halved {halvings} times and extrapolated, last change {:.1e}",
            limits.apart
        );
        Self { tolerance: vec![1e-6; limits.values.len()], values: limits.values, relative: false, note }
    }
}

/// Said of every file that cannot be read.
const COLUMNS: &str = "its columns are case, parameters, t, quantity, value, source, with one row per value";

/// One row.
struct Row {
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

/// All rows of a case, which share one set of runs. A case that cannot be run is rows that fail.
fn judge(group: &[Row]) -> Vec<Figure> {
    let Some(first) = group.first() else { return Vec::new() };
    let wanted: Vec<(Option<f64>, String)> = group.iter().map(|r| (r.t, r.quantity.clone())).collect();
    let p = Parameters(&first.parameters);
    let case = first.case.as_str();
    let answers = match case.split('-').next().unwrap_or_default() {
        "OSC" => oscillator::answer(p, &wanted),
        "PEND" | "DP" | "FB" => planar::answer(case, p, &wanted),
        "FOOT" => foot::answer(p, &wanted),
        "TABLE" => six_feet::answer(case, p, &wanted),
        other => Err(format!("no case begins with `{other}`")),
    };
    let answers = answers.unwrap_or_else(|e| Answers {
        values: vec![f64::NAN; group.len()],
        tolerance: vec![0.0; group.len()],
        relative: false,
        note: e.lines().next().unwrap_or_default().to_owned(),
    });
    let figure = |(k, row): (usize, &Row)| {
        let scale = if answers.relative { row.value.abs() } else { row.value.abs().max(1.0) };
        let difference = (answers.values[k] - row.value).abs() / scale;
        let at = row.t.map_or_else(String::new, |t| format!(".t{t}"));
        let what = format!("{} against {}; {}", answers.values[k], row.value, answers.note);
        Figure::new(
            format!("gluing.{case}{at}.{}", row.quantity),
            difference,
            Limit::AtMost(answers.tolerance[k]),
            what,
        )
    };
    group.iter().enumerate().map(figure).collect()
}

fn rows(text: &str) -> Outcome<Vec<Row>> {
    let mut lines = text.lines().filter(|l| !l.trim().is_empty()).enumerate();
    let head = lines.next().map(|(_, l)| fields(l)).unwrap_or_default();
    if head.len() < 5 || head[..5] != ["case", "parameters", "t", "quantity", "value"] {
        return Err("the header is another".into());
    }
    let rows: Vec<Row> = lines
        .map(|(k, line)| {
            let f = fields(line);
            let wrong = |what: &str| format!("line {}: {what}", k + 1);
            let [case, parameters, t, quantity, value, ..] = f.as_slice() else {
                return Err(wrong("five fields are needed"));
            };
            let t = if t.is_empty() { None } else { Some(t.parse().map_err(|_| wrong("t is no number"))?) };
            let value = value.parse().map_err(|_| wrong("the value is no number"))?;
            Ok(Row {
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
