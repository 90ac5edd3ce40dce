//! One way to set up an FMU: alone and as the only subsystem of a scenario it ends with the same row, to the last digit. (Items of
//! enumerations are left out: a scenario counts them, an FMU gives them numbers.)
//! The FMUs lie in
//! `TERRAGLUE_FMU_DIR`; the reference FMUs make steps of five sizes.

use super::folder;
use super::watched::watched;
use crate::parallel::in_parallel;
use crate::process::{Outcome, command, write};
use crate::{Context, Figure, Limit};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;
use terraglue::subsystem::ValueType;
use terraglue_fmi::Fmu;

/// Steps of a run.
const STEPS: u32 = 60;
/// Step where an FMU names none, s.
const USUAL_STEP: f64 = 0.01;
/// Steps of a reference FMU as multiples of the one that it names.
const SIZES: [f64; 5] = [1.0, 0.5, 0.1, 1.5, 3.0];
const LONGEST: Duration = Duration::from_secs(120);

/// Outcome of a run of either kind.
enum RunOutcome {
    Equal,
    Different(String),
    /// It runs in neither.
    Neither,
}

pub fn figures(place: &Path, context: &Context) -> Outcome<Vec<Figure>> {
    let Some(fmus) = folder::fmus() else {
        return Ok(vec![Figure::skipped("fmi.setup", folder::NOT_SET)]);
    };
    let reference = fmus.reference.iter().flat_map(|fmu| SIZES.map(|size| (fmu.clone(), size)));
    let others = fmus.third_party.iter().map(|fmu| (fmu.clone(), 1.0));
    let mut all = Vec::new();
    for (name, runs) in [("reference", reference.collect()), ("third_party", others.collect::<Vec<_>>())] {
        all.extend(counted(place, context, name, runs));
    }
    Ok(all)
}

fn counted(place: &Path, context: &Context, name: &str, runs: Vec<(PathBuf, f64)>) -> Vec<Figure> {
    let numbered: Vec<(usize, (PathBuf, f64))> = runs.into_iter().enumerate().collect();
    let judge = |(number, (fmu, size)): &(usize, (PathBuf, f64))| {
        let own = place.join(format!("setup-{name}-{number}"));
        let fate = std::fs::create_dir_all(&own)
            .map_err(|e| e.to_string())
            .and_then(|()| fate(&own, context, fmu, *size))
            .unwrap_or_else(RunOutcome::Different);
        drop(std::fs::remove_dir_all(&own));
        (format!("{} x {size}", folder::stem(fmu)), fate)
    };
    let fates = in_parallel(&numbered, judge);
    let run = fates.iter().filter(|(_, fate)| !matches!(fate, RunOutcome::Neither)).count();
    let told = |(name, fate): &(String, RunOutcome)| match fate {
        RunOutcome::Different(why) => Some(format!("{name}: {why}")),
        _ => None,
    };
    let different: Vec<String> = fates.iter().filter_map(told).collect();
    let list = if different.is_empty() { String::new() } else { format!(": {}", different.join("; ")) };
    let what = format!("runs of FMUs alone that end with another row than in a scenario, of {run}{list}");
    vec![Figure::new(
        format!("fmi.setup.{name}"),
        different.len() as f64,
        Limit::Equal(0.0),
        what.replace(['\n', '\t'], " "),
    )]
}

fn fate(place: &Path, context: &Context, fmu: &Path, size: f64) -> Outcome<RunOutcome> {
    let Ok((description, _)) = Fmu::inspect(fmu) else { return Ok(RunOutcome::Neither) };
    let fmu = fmu.canonicalize().map_err(|e| e.to_string())?;
    let step = size * description.experiment.step.filter(|h| *h > 0.0).unwrap_or(USUAL_STEP);
    let stop = f64::from(STEPS) * step;
    let table = place.join("alone.csv");
    let mut alone =
        command(&context.program, &["fmu", "run", "--isolate", "--start-time", "0", "--event-mode", "off"]);
    alone
        .arg(&fmu)
        .args(["--step", &format!("{step:?}"), "--stop", &format!("{stop:?}")])
        .arg("--csv")
        .arg(&table);
    let alone = watched(&mut alone, place, LONGEST)?;
    let text = format!(
        "[time]\nstep_s = {step:?}\nduration_s = {stop:?}\n[x]\nfmu = {:?}\nisolate = true\n",
        fmu.display().to_string()
    );
    let scenario = place.join("s.toml");
    write(&scenario, &text)?;
    let mut within = command(&context.program, &["run", "--csv", "--quiet", "--no-report", "--out"]);
    within.arg(place.join("out")).arg(&scenario);
    let within = watched(&mut within, place, LONGEST)?;
    // one that asks for the end has its last row there; alone this ends a run, in a scenario it is an error
    let asks = within.error().contains("asks for the end of the simulation");
    let is_item = |name: &str| {
        description
            .position(name)
            .is_some_and(|k| description.variables[k].value_type == ValueType::Enumeration)
    };
    let differ = || -> Outcome<Option<String>> {
        let alone = last(&table, "")?;
        let of_numbers = alone.into_iter().filter(|(name, _)| !is_item(name)).collect();
        Ok(difference(&of_numbers, &last(&place.join("out/variables.csv"), "x.")?))
    };
    Ok(match [alone.code == Some(0), within.code == Some(0) || asks] {
        [true, true] => differ()?.map_or(RunOutcome::Equal, RunOutcome::Different),
        [false, false] => RunOutcome::Neither,
        [true, false] => RunOutcome::Different(format!("runs alone only: {}", within.error())),
        [false, true] => RunOutcome::Different(format!("runs in a scenario only: {}", alone.error())),
    })
}

/// The last row of a table by the names of its columns, without their prefix.
fn last(path: &Path, prefix: &str) -> Outcome<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let names = reader.headers().map_err(|e| e.to_string())?.clone();
    let row = reader.records().last().ok_or("the table has no row")?.map_err(|e| e.to_string())?;
    let own = names.iter().zip(&row).filter_map(|(name, cell)| Some((name.strip_prefix(prefix)?, cell)));
    Ok(own.map(|(name, cell)| (name.to_owned(), cell.to_owned())).collect())
}

/// The first value of the run alone that the scenario has differently; none: there is no such value.
fn difference(alone: &BTreeMap<String, String>, within: &BTreeMap<String, String>) -> Option<String> {
    let same = |a: &str, b: &str| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a == b || a.is_nan() && b.is_nan(),
        _ => a == b,
    };
    let pairs = alone.iter().filter_map(|(name, a)| Some((name, a, within.get(name)?)));
    let (name, a, b) = pairs.into_iter().find(|(_, a, b)| !same(a, b))?;
    Some(format!("`{name}` is {a} alone and {b} in the scenario"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_equal_to_the_last_digit_however_they_are_written() {
        let row = |cell: &str| BTreeMap::from([("x".to_owned(), cell.to_owned())]);
        assert!(difference(&row("0"), &row("0.0")).is_none() && difference(&row("a"), &row("a")).is_none());
        assert!(difference(&row("0.1"), &row("0.10000000000000002")).is_some_and(|why| why.contains("`x`")));
        assert!(difference(&row("a"), &row("b")).is_some());
        assert!(difference(&row("1"), &BTreeMap::new()).is_none());
    }
}
