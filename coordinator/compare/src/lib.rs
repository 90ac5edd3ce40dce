//! Several runs side by side: a table in the terminal, `compare.html`, `compare.csv` and `compare.json`.
//!
//! A run that diverged is data: its row says so and when, and keeps the figures up to then.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod columns;
mod grounds;
mod overview;
mod page;
mod reference;
mod same;
mod scatter;
mod table;

pub use reference::judge;
pub use same::check_reference;

use serde_json::{Map, Value};
use std::path::{Path, PathBuf};
use terraglue_diagnostics::error::Result;
use terraglue_recording::{Status, Summary, at, other_at};

/// The comparison as a page.
pub const COMPARE_PAGE: &str = "compare.html";
/// The comparison as a table for other programs.
pub const COMPARE_TABLE: &str = "compare.csv";
/// The comparison with all of every summary.
pub const COMPARE_JSON: &str = "compare.json";

/// Key paths of a scenario with the values of one run.
pub type Varied = Vec<(String, String)>;

/// One run of a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompareRow {
    /// Gluing strategy.
    pub strategy: String,
    /// Soil module.
    pub soil: String,
    /// Other varied keys: key paths of the scenario and their values.
    pub varied: Varied,
    /// Its figures; `None` where the run could not even start.
    pub summary: Option<Summary>,
    /// Its results folder, for the curves and the link to its report.
    pub folder: Option<PathBuf>,
    /// Error message.
    pub error: Option<String>,
    /// Communication step, s.
    pub step_s: f64,
    /// Whether the other rows are compared with it.
    pub is_reference: bool,
    /// Largest distance of the reported body from the reference, m.
    pub reference_error_m: Option<f64>,
    /// Observed order of that error against the same run with the next smaller step.
    pub order: Option<f64>,
    /// Observed orders of figures of the whole run.
    pub orders: Orders,
    /// Whether the comparison has several steps, so that names say which.
    pub name_step: bool,
    /// Wall time per step of the exchange with the subsystems, of Jacobians, and of all else, s.
    pub parts_s: Option<[f64; 3]>,
    /// Mean evaluations of the soils per step when the iteration does not start from the estimate.
    pub cold_start_mean: Option<f64>,
}

/// Order at which figures of the whole run approach those of the reference, each against the same run with the next
/// smaller step; none where a figure is unknown or has arrived.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orders {
    /// Of the mean sinkage.
    pub sinkage: Option<f64>,
    /// Of the soil's heat.
    pub heat: Option<f64>,
    /// Of the length of the body's way.
    pub path: Option<f64>,
}

/// A varied value in a name: itself where it is a word, with its key where it is a number, a truth value or a list.
fn choice(key: &str, value: &str) -> String {
    let plain = value.trim_matches(|c| c == '"' || c == '\'');
    let word = plain.starts_with(char::is_alphabetic) && !["true", "false", "inf", "nan"].contains(&plain);
    let name = key.rsplit('.').next().unwrap_or(key);
    if word { plain.to_owned() } else { format!("{name} {plain}") }
}

impl CompareRow {
    /// Whether another row simulates the same, by another strategy or step.
    pub fn is_like(&self, other: &Self) -> bool {
        self.soil == other.soil && self.varied == other.varied
    }

    /// Name of the run.
    pub fn name(&self) -> String {
        let mut name = self.strategy.clone();
        if !self.soil.is_empty() {
            name += &format!(" · {}", self.soil);
        }
        name.extend(self.varied.iter().map(|(key, value)| format!(" · {}", choice(key, value))));
        if self.name_step {
            name += &format!(" · {} ms", (1e9 * self.step_s).round() / 1e6);
        }
        if self.is_reference { name + " (reference)" } else { name }
    }

    /// `failed at t = … s: …`, unless the reason says the time itself; `None` where the run reached its end.
    pub fn failure(&self) -> Option<String> {
        let recorded = self.summary.as_ref().and_then(|s| s.error.as_ref());
        let message = self.error.as_deref().or(recorded.map(|e| e.message.as_str()));
        match (&self.summary, message) {
            (Some(s), message) if s.status == Status::Failed => {
                let t_s = recorded.and_then(|e| e.time_s).unwrap_or(s.simulated_s);
                let message = message.unwrap_or("no message");
                let is_timed = message.contains(" at t = ");
                Some(if is_timed { message.into() } else { format!("failed at t = {t_s:.4} s: {message}") })
            }
            (Some(s), None) if s.status == Status::Stopped => {
                Some(format!("stopped at t = {:.4} s", s.simulated_s))
            }
            (_, Some(message)) => Some(message.to_owned()),
            (None, None) => Some("no result".into()),
            (Some(_), None) => None,
        }
    }
}

/// Reads the recordings of all rows and writes `compare.html`, `compare.csv` and `compare.json` into a folder.
///
/// # Errors
/// [`Error::File`](terraglue_diagnostics::Error::File): a file cannot be written.
pub fn write(folder: &Path, rows: &[CompareRow]) -> Result {
    std::fs::create_dir_all(folder).map_err(at(folder))?;
    let runs = page::open(rows);
    let path = folder.join(COMPARE_TABLE);
    table::write_csv(&path, rows).map_err(other_at(&path))?;
    let path = folder.join(COMPARE_JSON);
    let mut text = serde_json::to_string_pretty(&json(folder, rows)).map_err(other_at(&path))?;
    text.push('\n');
    std::fs::write(&path, text).map_err(at(&path))?;
    let path = folder.join(COMPARE_PAGE);
    std::fs::write(&path, page::render(folder, rows, &runs)).map_err(at(&path))
}

/// The comparison for a terminal: one line per run with the main figures; `details`: all figures, one column per run.
pub fn terminal_table(rows: &[CompareRow], details: bool) -> String {
    if details { table::terminal(rows) } else { overview::terminal(rows) }
}

/// The folder of a row as it is seen from the comparison's folder.
fn relative(folder: &Path, row: &CompareRow) -> Option<String> {
    let inside = row.folder.as_deref()?.strip_prefix(folder).ok()?;
    Some(inside.to_string_lossy().replace('\\', "/"))
}

fn json(folder: &Path, rows: &[CompareRow]) -> Value {
    let one = |row: &CompareRow| {
        let mut object = Map::new();
        object.insert("strategy".into(), row.strategy.as_str().into());
        object.insert("soil".into(), row.soil.as_str().into());
        let varied = row.varied.iter().map(|(key, value)| (key.clone(), value.as_str().into()));
        object.insert("varied".into(), Value::Object(varied.collect()));
        object.insert("error".into(), row.failure().into());
        for column in columns::ALL {
            object.insert(column.key.into(), (column.value)(row).into());
        }
        object.insert("folder".into(), relative(folder, row).into());
        object.insert("summary".into(), serde_json::to_value(&row.summary).unwrap_or_default());
        Value::Object(object)
    };
    let scenario = rows.iter().find_map(|r| r.summary.as_ref()).map(|s| s.scenario.as_str());
    serde_json::json!({ "scenario": scenario, "rows": rows.iter().map(one).collect::<Vec<_>>() })
}
