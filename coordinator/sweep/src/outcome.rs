//! Outcome of a case: how it ended, and its figures.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use terraglue_diagnostics::error::Result;
use terraglue_recording::{Summary, at, other_at, replace};

/// Name of the file.
const FILE: &str = "case.json";

/// How a case ended. One that was interrupted or killed has no outcome: it is still to be run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CaseStatus {
    /// It reached its end.
    Done,
    /// The simulation stopped; figures are those up to then.
    Failed,
    /// Its values do not fit, so there was no step.
    Refused,
    /// The process crashed.
    Crashed,
}

impl CaseStatus {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Refused => "refused",
            Self::Crashed => "crashed",
        }
    }
}

/// The outcome of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// How it ended.
    pub status: CaseStatus,
    /// Why it did not reach its end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Numbers by name.
    #[serde(default)]
    pub figures: BTreeMap<String, f64>,
}

impl Outcome {
    /// Of a case without figures.
    pub fn without_figures(status: CaseStatus, reason: String) -> Self {
        Self { status, reason: Some(reason), figures: BTreeMap::new() }
    }

    /// Writes it into the folder of its case, in one go: it is there, or it is not.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, folder: &Path) -> Result {
        let path = folder.join(FILE);
        let mut text = serde_json::to_string_pretty(self).map_err(other_at(&path))?;
        text.push('\n');
        replace(&path, text.as_bytes()).map_err(at(&path))
    }

    /// That of a folder; none where the case is still to be run.
    ///
    /// # Errors
    /// The file is no outcome.
    pub fn read(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(FILE);
        match std::fs::read(&path) {
            Ok(text) => serde_json::from_slice(&text).map(Some).map_err(other_at(&path)),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(at(&path)(e)),
        }
    }

    /// Whether a folder has one.
    pub fn is_there(folder: &Path) -> bool {
        folder.join(FILE).is_file()
    }
}

/// A key of a summary that depends on the machine and its load, not on the case, beside those of its times.
const COST: &str = "cpu_per_step_s";

/// All numbers of a summary by their key, those of inner tables with a dot between.
pub fn figures(summary: &Summary) -> BTreeMap<String, f64> {
    let number = |(key, value): (String, Value)| Some((key, value.as_f64()?));
    flat(summary).into_iter().filter_map(number).collect()
}

/// The keys of all numbers that a summary can have.
pub fn keys(summary: &Summary) -> Vec<String> {
    let is_number = |value: &Value| value.is_number() || value.is_null();
    flat(summary).into_iter().filter(|(_, value)| is_number(value)).map(|(key, _)| key).collect()
}

/// Figures that do not depend on the machine, without inner tables.
fn flat(summary: &Summary) -> Vec<(String, Value)> {
    let mut all = Vec::new();
    if let (Ok(Value::Object(table)), Ok(times)) =
        (serde_json::to_value(summary), serde_json::to_value(summary.times))
    {
        let own = table.into_iter().filter(|(key, _)| key != COST && times.get(key).is_none());
        own.for_each(|(key, value)| flatten(key, value, &mut all));
    }
    all
}

fn flatten(key: String, value: Value, all: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(table) => {
            table.into_iter().for_each(|(name, value)| flatten(format!("{key}.{name}"), value, all));
        }
        other => all.push((key, other)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outcome_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().expect("folder");
        assert_eq!(Outcome::read(folder.path()).expect("none yet"), None);
        let figures = BTreeMap::from([("distance_m".to_owned(), 0.1 + 0.2)]);
        let own = Outcome { status: CaseStatus::Failed, reason: Some("t = 1 s".into()), figures };
        own.write(folder.path()).expect("written");
        assert_eq!(Outcome::read(folder.path()).expect("read"), Some(own));
        std::fs::write(folder.path().join(FILE), "{").expect("written");
        assert!(Outcome::read(folder.path()).expect_err("refused").to_string().contains(FILE));
    }

    #[test]
    fn inner_tables_have_dots() {
        let mut all = Vec::new();
        let value = serde_json::json!({ "friction_j": 2.0, "of": { "n": 3 } });
        flatten("energies".into(), value, &mut all);
        assert_eq!(all, [("energies.friction_j".into(), 2.0.into()), ("energies.of.n".into(), 3.into())]);
    }
}
