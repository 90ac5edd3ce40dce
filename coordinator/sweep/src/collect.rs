//! One table of all cases: their values, how they ended, and their figures.

use crate::folder::{RESULTS, Sweep, write_table};
use crate::outcome::{CaseStatus, Outcome};
use std::collections::BTreeSet;
use std::path::PathBuf;
use terraglue_diagnostics::did_you_mean;
use terraglue_diagnostics::error::Result;
use terraglue_recording::other_at;

/// Figures that are shown first where a plan names none and cases have them.
const USUAL: [&str; 6] = [
    "distance_m",
    "energy_j_per_m",
    "mean_sinkage_m",
    "max_sinkage_m",
    "max_pitch_rad",
    "peak_force_over_weight",
];
/// Word of a case without an outcome.
const MISSING: &str = "missing";

/// A case with its outcome.
#[derive(Clone, Debug)]
pub struct Row {
    /// Number of the case.
    pub number: usize,
    /// A value for each varied key.
    pub values: Vec<String>,
    /// Its outcome; none where it is still to be run.
    pub outcome: Option<Outcome>,
    /// Its folder, from that of the sweep.
    pub folder: PathBuf,
}

impl Row {
    /// A figure of it.
    pub fn figure(&self, name: &str) -> Option<f64> {
        self.outcome.as_ref()?.figures.get(name).copied()
    }

    /// How it ended.
    pub fn status(&self) -> &'static str {
        self.outcome.as_ref().map_or(MISSING, |outcome| outcome.status.name())
    }

    /// Whether it reached its end.
    pub fn is_done(&self) -> bool {
        self.outcome.as_ref().is_some_and(|outcome| outcome.status == CaseStatus::Done)
    }
}

/// All results of a sweep.
#[derive(Clone, Debug)]
pub struct Collected {
    /// Name of the scenario.
    pub scenario: String,
    /// Varied keys.
    pub keys: Vec<String>,
    /// Figures that are shown first.
    pub shown: Vec<String>,
    /// All figures that any case has: those that are shown first, then the others by name.
    pub figures: Vec<String>,
    /// All cases.
    pub rows: Vec<Row>,
}

impl Collected {
    /// How many cases have a status.
    pub fn count(&self, status: &str) -> usize {
        self.rows.iter().filter(|row| row.status() == status).count()
    }

    /// How many are still to be run.
    pub fn missing(&self) -> usize {
        self.count(MISSING)
    }
}

/// Reads what is there of a sweep and writes its table.
///
/// # Errors
/// Files that cannot be read or written.
pub fn collect(sweep: &Sweep) -> Result<Collected> {
    let row = |case: &crate::Case| {
        let outcome = Outcome::read(&sweep.case_folder(case))?;
        let folder = sweep.relative_folder(case);
        Ok(Row { number: case.number, values: case.values.clone(), outcome, folder })
    };
    let rows: Vec<Row> = sweep.cases.iter().map(row).collect::<Result<_>>()?;
    let names = rows.iter().flat_map(|row| &row.outcome).flat_map(|outcome| outcome.figures.keys());
    let known: BTreeSet<&String> = names.collect();
    let mut shown: Vec<String> = sweep.settings.collect.clone();
    if !known.is_empty() {
        for name in sweep.settings.collect.iter().filter(|name| !known.contains(name)) {
            let help = did_you_mean(name, known.iter().map(|k| k.as_str())).unwrap_or_default();
            log::warn!("no case has the figure `{name}` of `sweep.collect`; {help}");
        }
    }
    shown.retain(|name| known.contains(name));
    if shown.is_empty() {
        let usual = USUAL.iter().filter(|name| known.contains(&(**name).to_owned()));
        shown = usual.map(|name| (*name).to_owned()).collect();
    }
    let others = known.into_iter().filter(|name| !shown.contains(name)).cloned();
    let figures = shown.iter().cloned().chain(others).collect();
    let scenario = sweep.settings.scenario.file_stem().map(|s| s.to_string_lossy().into_owned());
    let scenario = scenario.unwrap_or_default();
    let all = Collected { scenario, keys: sweep.keys.clone(), shown, figures, rows };
    write(sweep, &all)?;
    Ok(all)
}

fn write(sweep: &Sweep, all: &Collected) -> Result {
    let path = sweep.folder().join(RESULTS);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let titles = ["case"].into_iter().chain(all.keys.iter().map(String::as_str));
    let titles = titles.chain(["status", "reason"]).chain(all.figures.iter().map(String::as_str));
    writer.write_record(titles).map_err(other_at(&path))?;
    for row in &all.rows {
        let reason = row.outcome.as_ref().and_then(|o| o.reason.as_deref()).unwrap_or_default();
        let figure = |name: &String| row.figure(name).map(|x| format!("{x:?}")).unwrap_or_default();
        let fields = std::iter::once(row.number.to_string())
            .chain(row.values.iter().cloned())
            .chain([row.status().to_owned(), reason.replace('\n', "; ")])
            .chain(all.figures.iter().map(figure));
        writer.write_record(fields).map_err(other_at(&path))?;
    }
    write_table(&path, writer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Settings;
    use crate::points::Points;

    #[test]
    fn the_table_has_every_case_and_says_what_is_missing() {
        let place = tempfile::tempdir().expect("folder");
        let rows = ["1", "2", "3"].map(|v| vec![v.to_owned()]).to_vec();
        let points = Points { keys: vec!["a".into()], rows };
        let settings = Settings {
            scenario: "walk.toml".into(),
            collect: vec!["distance_m".into(), "robot.x".into()],
            ..Settings::default()
        };
        let sweep = Sweep::create(&place.path().join("sweep"), settings, points).expect("made");
        let first = sweep.case_folder(&sweep.cases[0]);
        std::fs::create_dir_all(&first).expect("made");
        let figures = [("b".to_owned(), 2.0), ("distance_m".to_owned(), 0.5)].into();
        Outcome { status: CaseStatus::Done, reason: None, figures }.write(&first).expect("written");
        let third = sweep.case_folder(&sweep.cases[2]);
        std::fs::create_dir_all(&third).expect("made");
        let reason = "no module\nof that name".to_owned();
        Outcome::without_figures(CaseStatus::Refused, reason).write(&third).expect("written");
        let all = collect(&sweep).expect("collected");
        assert_eq!((all.missing(), all.count("done"), all.count("refused")), (1, 1, 1));
        assert_eq!(
            (all.shown, all.figures),
            (vec!["distance_m".to_owned()], vec!["distance_m".to_owned(), "b".into()])
        );
        let text = std::fs::read_to_string(sweep.folder().join(RESULTS)).expect("there");
        assert_eq!(
            text,
            "case,a,status,reason,distance_m,b\n1,1,done,,0.5,2.0\n2,2,missing,,,\n3,3,refused,no module; of that name,,\n"
        );
    }
}
