//! F2, F6, F15: the scenarios of the forest as they are shipped, from the wheels on the soil to the pose that is believed.

use super::{Context, Figure, Limit};
use crate::columns;
use crate::parallel::in_parallel;
use crate::process::{Outcome, run_scenario};
use std::path::PathBuf;
use terraglue_numerics::extremes::larger;

/// A pose that is believed and farther from the truth is a wrong one, m.
const WRONG: f64 = 1.0;
/// When the head swings in the view, before and behind the switch of the mask, s.
const UNMASKED: [f64; 2] = [3.0, 12.0];
const MASKED: [f64; 2] = [13.0, 24.0];

/// Time for which the pace is measured, s.
const PACE_S: &str = "10";

/// A scenario with the time for which it runs in quick figures and in all of them, s.
const RUNS: [(&str, f64, f64); 4] = [
    ("forest_drive", 30.0, 115.0),
    ("forest_blind", 30.0, 60.0),
    ("forest_kidnapped", 32.0, 45.0),
    ("forest_head_in_view", 16.0, 24.0),
];

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let runs = in_parallel(&RUNS, |run| RunResult::of(context, run, 1));
    let runs: Vec<RunResult> = runs.into_iter().collect::<Outcome<_>>()?;
    let mut all = Vec::new();
    for (run, (name, quick, whole)) in runs.iter().zip(RUNS) {
        let time = if context.quick { quick } else { whole };
        all.extend(run.poses(name, time));
    }
    all.extend(runs[3].head());
    all.push(same_bytes(context, &runs[0])?);
    if context.timing {
        all.push(pace(context)?);
    }
    Ok(all)
}

/// Results of a run.
struct RunResult {
    folder: PathBuf,
    time: Vec<f64>,
    known: Vec<f64>,
    error: Vec<f64>,
    own_stems: Vec<f64>,
    hidden: Vec<f64>,
}

impl RunResult {
    fn of(context: &Context, (name, quick, whole): &(&str, f64, f64), threads: usize) -> Outcome<Self> {
        let id = format!("{name}.{threads}");
        let folder = context.scratch.join(&id);
        let time = if context.quick { quick } else { whole };
        let (time, threads) = (time.to_string(), threads.to_string());
        let options = ["--csv", "--duration", time.as_str(), "--threads", threads.as_str()];
        let summary =
            run_scenario(&context.program, &id, &format!("scenarios/{name}.toml"), &folder, &options)?;
        if summary["status"] != "done" {
            return Err(format!("{id}: {}", summary["error"]));
        }
        let path = folder.join("variables.csv");
        let column = |wanted: &str| -> Outcome<Vec<f64>> {
            let found = columns(&path, |name| name == wanted)?;
            let first =
                found.into_iter().next().ok_or_else(|| format!("{id}: there is no column {wanted}"))?;
            Ok(first.1)
        };
        Ok(Self {
            time: column("t_s")?,
            known: column("locator.is_known")?,
            error: column("locator.error")?,
            own_stems: column("locator.own_stems")?,
            hidden: column("locator.hidden")?,
            folder,
        })
    }

    /// Error of the poses that were believed; how many of them are wrong; since when there is one.
    fn poses(&self, name: &str, time: f64) -> Vec<Figure> {
        let believed = self.error.iter().zip(&self.known).filter(|(_, known)| **known > 0.5);
        let mut errors: Vec<f64> = believed.map(|(error, _)| *error).collect();
        errors.sort_by(f64::total_cmp);
        let p95 = errors.get(errors.len() * 95 / 100).copied().unwrap_or(f64::NAN);
        let wrong = errors.iter().filter(|e| !(**e <= WRONG)).count();
        let share = errors.len() as f64 / self.known.len().max(1) as f64;
        let id = |what: &str| format!("forest.{name}.{what}");
        let mut all = vec![Figure::new(
            id("located"),
            share,
            Limit::AtLeast(0.5),
            format!("share of the time with a pose that is believed, {name}, {time} s"),
        )];
        // whoever is carried off is wrong until he can notice it
        if name != "forest_kidnapped" {
            let what =
                format!("F15 error of the poses that are believed, quantile 0.95, m, {name}, {time} s");
            all.push(Figure::new(id("p95"), p95, Limit::AtMost(0.5), what));
            let what = format!(
                "F15 samples that believe a pose more than {WRONG} m off, of {}, {name}",
                errors.len()
            );
            all.push(Figure::new(id("wrong"), wrong as f64, Limit::Equal(0.0), what));
        } else {
            let last = self.error.last().zip(self.known.last()).filter(|(_, known)| **known > 0.5);
            let what =
                format!("F15 error at the end, m: found again after it was carried off, {name}, {time} s");
            all.push(Figure::new(id("found"), last.map_or(f64::NAN, |(e, _)| *e), Limit::AtMost(0.5), what));
        }
        all
    }

    /// F6 in a run: the head is a tree while nothing is masked, and none afterwards.
    fn head(&self) -> Vec<Figure> {
        let most = |[from, to]: [f64; 2], of: &[f64]| {
            let inside = self.time.iter().zip(of).filter(|(t, _)| **t > from && **t < to);
            inside.map(|(_, v)| *v).fold(0.0, larger)
        };
        vec![
            Figure::new(
                "forest.forest_head_in_view.unmasked",
                most(UNMASKED, &self.own_stems),
                Limit::AtLeast(1.0),
                "F6 stems of a scan where the machine itself is, mask off, most",
            ),
            Figure::new(
                "forest.forest_head_in_view.masked",
                most(MASKED, &self.own_stems),
                Limit::Equal(0.0),
                "F6 the same, mask on",
            ),
            Figure::new(
                "forest.forest_head_in_view.hidden",
                most(MASKED, &self.hidden),
                Limit::AtLeast(0.05),
                "F6 sectors that the machine hides, most, rad",
            ),
        ]
    }
}

/// F2: `forest_drive` with two scanners OS1-64 at 10 Hz, and the share of each part.
fn pace(context: &Context) -> Outcome<Figure> {
    let id = "forest_drive.os1";
    let folder = context.scratch.join(id);
    let scanners = ["scanner1", "scanner2"].map(|name| {
        ["--set".into(), format!("{name}.pattern=os1-64"), "--set".into(), format!("{name}.rate_hz=10")]
    });
    let mut options = vec!["--duration", PACE_S, "--threads", "2"];
    options.extend(scanners.iter().flatten().map(String::as_str));
    let summary = run_scenario(&context.program, id, "scenarios/forest_drive.toml", &folder, &options)?;
    let path = folder.join("timing.csv");
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let part = |line: &str| {
        let mut fields = line.split(',');
        let (name, wall) = (fields.next()?, fields.next()?.parse::<f64>().ok()?);
        (!name.starts_with("subsystem") && wall > 0.05).then(|| format!("{name} {wall:.2}"))
    };
    let parts: Vec<String> = text.lines().filter_map(part).collect();
    let what = format!(
        "F2 simulated time by real time, forest_drive with two OS1-64 at 10 Hz on two threads, {PACE_S} s; s of real time by part: {}",
        parts.join(", ")
    );
    let pace = summary["real_time_factor"].as_f64().unwrap_or(f64::NAN);
    Ok(Figure::new("forest.forest_drive.pace", pace, Limit::AtLeast(1.0), what).timed())
}

/// Whether two threads give the bytes of one.
fn same_bytes(context: &Context, one: &RunResult) -> Outcome<Figure> {
    let two = RunResult::of(context, &RUNS[0], 2)?;
    let read = |told: &RunResult| std::fs::read(told.folder.join("variables.csv")).map_err(|e| e.to_string());
    let differ = f64::from(u8::from(read(one)? != read(&two)?));
    let what = "F15 whether the variables of forest_drive differ between one thread and two";
    Ok(Figure::new("forest.forest_drive.threads", differ, Limit::Equal(0.0), what))
}
