//! The folder of a sweep: what is run, the list of its cases, a folder for each.

use crate::outcome::Outcome;
use crate::points::Points;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use terraglue_diagnostics::InputError;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_recording::{at, other_at, replace};

/// The list of cases: their number and the value of each varied key, with tabs between.
pub const CASES: &str = "cases.tsv";
/// The table of all results.
pub const RESULTS: &str = "sweep.csv";
/// The page of all results.
pub const PAGE: &str = "sweep.html";
/// Name of the file of [`Settings`].
const SETTINGS: &str = "sweep.json";
/// Title of the first column.
const NUMBER: &str = "case";

/// Settings shared by all cases.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The scenario, from the folder of the sweep or absolute.
    pub scenario: PathBuf,
    /// Edits of every case.
    pub sets: Vec<(String, String)>,
    /// Folders in which modules are searched first.
    pub module_paths: Vec<PathBuf>,
    /// Keys of `summary.json` and variables that are shown first.
    pub collect: Vec<String>,
}

/// A run of the sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// From 1 on.
    pub number: usize,
    /// A value for each varied key.
    pub values: Vec<String>,
}

/// A sweep in its folder.
#[derive(Clone, Debug)]
pub struct Sweep {
    folder: PathBuf,
    /// Settings shared by all cases.
    pub settings: Settings,
    /// Varied keys.
    pub keys: Vec<String>,
    /// Its cases in the order of their numbers.
    pub cases: Vec<Case>,
}

impl Sweep {
    /// Makes the folder. The list comes last: a folder without it is no sweep.
    ///
    /// # Errors
    /// Files that cannot be written, or a folder in which there is something.
    pub fn create(folder: &Path, settings: Settings, points: Points) -> Result<Self> {
        if std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
            let message = format!("`{}` is there and not empty", folder.display());
            let help = match folder.join(CASES).is_file() {
                true => format!(
                    "`terraglue sweep run {}` does what is missing of the sweep in it; a new one needs a new folder",
                    folder.display()
                ),
                false => "name a new folder with --out".to_owned(),
            };
            return Err(InputError::plain(message, Some(help)).into());
        }
        std::fs::create_dir_all(folder).map_err(at(folder))?;
        let path = folder.join(SETTINGS);
        let mut text = serde_json::to_string_pretty(&settings).map_err(other_at(&path))?;
        text.push('\n');
        std::fs::write(&path, text).map_err(at(&path))?;
        let cases = points.rows.into_iter().enumerate().map(|(k, values)| Case { number: k + 1, values });
        let own = Self { folder: folder.to_owned(), settings, keys: points.keys, cases: cases.collect() };
        own.write_list()?;
        Ok(own)
    }

    fn write_list(&self) -> Result {
        let path = self.folder.join(CASES);
        let mut table = csv::WriterBuilder::new().delimiter(b'\t').from_writer(Vec::new());
        let first = [NUMBER.to_owned()].into_iter().chain(self.keys.iter().cloned());
        table.write_record(first).map_err(other_at(&path))?;
        for case in &self.cases {
            let row = [case.number.to_string()].into_iter().chain(case.values.iter().cloned());
            table.write_record(row).map_err(other_at(&path))?;
        }
        write_table(&path, table)
    }

    /// The sweep of a folder.
    ///
    /// # Errors
    /// There is none, or its files are damaged.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(CASES);
        if !path.is_file() {
            let message = format!("there is no sweep in `{}`: it has no {CASES}", folder.display());
            let help = "`terraglue sweep PLAN -o DIR` makes one".to_owned();
            return Err(InputError::plain(message, Some(help)).into());
        }
        let damaged = |path: &Path, what: String| -> Error {
            let help = "make the sweep again in a new folder".to_owned();
            InputError::plain(format!("`{}` is damaged: {what}", path.display()), Some(help)).into()
        };
        let settings = folder.join(SETTINGS);
        let text = std::fs::read(&settings).map_err(at(&settings))?;
        let settings: Settings =
            serde_json::from_slice(&text).map_err(|e| damaged(&settings, e.to_string()))?;
        let mut reader =
            csv::ReaderBuilder::new().delimiter(b'\t').from_path(&path).map_err(other_at(&path))?;
        let titles = reader.headers().map_err(|e| damaged(&path, e.to_string()))?.clone();
        let keys = titles.iter().skip(1).map(Into::into).collect();
        let mut cases = Vec::new();
        for row in reader.records() {
            let row = row.map_err(|e| damaged(&path, e.to_string()))?;
            let number = cases.len() + 1;
            if row.get(0) != Some(&number.to_string()) {
                return Err(damaged(&path, format!("row {number} is not that of case {number}")));
            }
            cases.push(Case { number, values: row.iter().skip(1).map(Into::into).collect() });
        }
        Ok(Self { folder: folder.to_owned(), settings, keys, cases })
    }

    /// Its folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// File of the scenario.
    pub fn scenario(&self) -> PathBuf {
        self.folder.join(&self.settings.scenario)
    }

    /// The folder of a case, for its results.
    pub fn case_folder(&self, case: &Case) -> PathBuf {
        self.folder.join(self.relative_folder(case))
    }

    /// The same from the folder of the sweep.
    pub fn relative_folder(&self, case: &Case) -> PathBuf {
        // names have one length, so that their order is that of the cases
        let digits = self.cases.len().to_string().len().max(4);
        Path::new("cases").join(format!("{:0digits$}", case.number))
    }

    /// All edits of a case: those of every case, then its own.
    pub fn sets(&self, case: &Case) -> Vec<(String, String)> {
        let own = self.keys.iter().cloned().zip(case.values.iter().cloned());
        self.settings.sets.iter().cloned().chain(own).collect()
    }

    /// The case of a number.
    ///
    /// # Errors
    /// There is none.
    pub fn case(&self, number: usize) -> Result<&Case> {
        let found = number.checked_sub(1).and_then(|k| self.cases.get(k));
        found.ok_or_else(|| {
            let help = format!("cases are numbered from 1 to {}", self.cases.len());
            InputError::plain(format!("there is no case {number}"), Some(help)).into()
        })
    }

    /// The cases without an outcome.
    pub fn missing(&self) -> impl Iterator<Item = &Case> {
        self.cases.iter().filter(|case| !Outcome::is_there(&self.case_folder(case)))
    }
}

/// Puts a table in its place.
pub(crate) fn write_table(path: &Path, table: csv::Writer<Vec<u8>>) -> Result {
    let bytes = table.into_inner().map_err(|e| other_at(path)(e.to_string()))?;
    replace(path, &bytes).map_err(at(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_is_opened_as_it_was_made() {
        let place = tempfile::tempdir().expect("folder");
        let folder = place.path().join("sweep");
        let points = Points {
            keys: vec!["soil.module".into(), "a.b".into()],
            rows: vec![vec!["soil-bekker".into(), "\"x\ty\"".into()], vec!["other".into(), "[1, 2]".into()]],
        };
        let settings = Settings {
            scenario: "/s.toml".into(),
            collect: vec!["distance_m".into()],
            ..Settings::default()
        };
        let made = Sweep::create(&folder, settings, points.clone()).expect("made");
        let again = Sweep::open(&folder).expect("opened");
        assert_eq!((&again.keys, &again.cases, &again.settings), (&made.keys, &made.cases, &made.settings));
        assert_eq!(again.missing().count(), 2);
        let second = again.case(2).expect("there");
        assert!(again.case_folder(second).ends_with("cases/0002"));
        assert_eq!(again.sets(second)[1], ("a.b".into(), "[1, 2]".into()));
        assert!(again.case(3).is_err() && again.case(0).is_err());
        let error = Sweep::create(&folder, Settings::default(), points).expect_err("refused");
        assert!(error.to_string().contains("not empty"), "{error}");
    }

    #[test]
    fn damaged_lists_are_refused() {
        let place = tempfile::tempdir().expect("folder");
        let points = Points { keys: vec!["a".into()], rows: vec![vec!["1".into()], vec!["2".into()]] };
        let folder = place.path().join("sweep");
        Sweep::create(&folder, Settings::default(), points).expect("made");
        for text in ["case\ta\n2\t1\n", "case\ta\n1\t1\t1\n"] {
            std::fs::write(folder.join(CASES), text).expect("written");
            assert!(Sweep::open(&folder).expect_err(text).to_string().contains("damaged"), "{text}");
        }
        assert!(Sweep::open(place.path()).expect_err("none").to_string().contains("no sweep"));
    }
}
