//! Whether an earlier run can be the reference of others: it must be a run of the same thing.

use crate::reference;
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_recording::Recording;
use terraglue_recording::fingerprints;
use terraglue_scenario::{InputError, Scenario, differences};

/// Tables whose keys say how something is computed or shown, not what.
const FREE_TABLES: [&str; 5] = ["gluing", "recording", "report", "sweep", "time"];
/// Keys of subsystems of that kind.
const FREE_KEYS: [&str; 8] = [
    "step_multiple",
    "isolate",
    "load_timeout_s",
    "step_timeout_s",
    "memory_mb",
    "python",
    "build",
    "sources",
];
/// More differences than this are not listed.
const LISTED: usize = 4;

/// Refuses a folder or recording as the reference of runs of a scenario.
///
/// Strategy, step and what is recorded may differ. All else of the scenario's text, the contents of the files that it
/// names, the numbers of the soil table and the reported body must be the same, and the run must be as long.
///
/// # Errors
/// The recording cannot be read ([`terraglue_diagnostics::Error::File`]); wrong input with what differs and the way out.
pub fn check_reference(scenario: &Scenario, folder: &Path) -> Result {
    let unreadable = |e: Error| {
        let help = "it takes a strategy, the folder of an earlier run, or its recording.mcap";
        InputError::plain(format!("--reference: {e}"), Some(help.into()))
    };
    let recording = reference::open(folder).map_err(unreadable)?;
    let differences = found(scenario, &recording);
    if differences.is_empty() {
        return Ok(());
    }
    let more = differences.len().saturating_sub(LISTED);
    let mut listed = differences[..differences.len() - more].join("; ");
    if more > 0 {
        listed += &format!("; and {more} more");
    }
    let message = format!(
        "--reference: the run in `{}` cannot be the reference of this one: {listed}",
        folder.display()
    );
    let help = "make one of the same scenario with `terraglue run`, at a smaller step and with the same --set, --duration \
                and soil; or give a strategy, which is run on each soil";
    Err(InputError::plain(message, Some(help.into())).into())
}

fn found(scenario: &Scenario, recording: &Recording) -> Vec<String> {
    let header = &recording.header;
    let Some(texts) = differences(&scenario.source.text, header.get("scenario_text")) else {
        return vec!["it does not say what was simulated".into()];
    };
    let mut all: Vec<String> = texts.iter().filter(|d| matters(&d.key)).map(ToString::to_string).collect();
    let own = fingerprints(scenario);
    // A recording of an earlier version has none.
    if header.entries.contains_key("inputs") && all.is_empty() {
        let other: Vec<&str> = header.get("inputs").lines().collect();
        let changed = own.lines().filter(|line| !other.contains(line)).filter_map(|l| l.split_once(' '));
        all.extend(changed.map(|(key, _)| format!("what `{key}` names has changed since")));
    }
    let body = |name: Option<&str>| name.filter(|n| !n.is_empty()).unwrap_or("the first body").to_owned();
    let (ours, theirs) = (body(scenario.report.body.as_deref()), body(Some(header.get("report_body"))));
    if ours != theirs {
        all.push(format!("it reports {theirs} and not {ours}"));
    }
    if recording.reported_body().is_none() {
        all.push("it has no body whose path could be compared".into());
    }
    let (end_s, wanted_s) = (recording.end_s(), scenario.time.duration_s);
    if end_s < wanted_s - 1e-9 {
        all.push(format!("it ends at t = {end_s} s and not at {wanted_s} s"));
    }
    all
}

fn matters(key: &str) -> bool {
    let mut parts = key.split('.');
    let table = parts.next().unwrap_or_default();
    let name = parts.next_back().unwrap_or_default();
    let glue_strategy = table == "glue" && name == "strategy";
    !FREE_TABLES.contains(&table) && !FREE_KEYS.contains(&name) && !glue_strategy
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    const TEXT: &str = "[time]\nstep_s = 0.001\nduration_s = 1.0\n[gluing]\nstrategy = \"iterative\"\n[soil]\n\
        module = \"soil-bekker\"\nisolate = false\n";

    /// Differences found against a reference with this text that ends at this time.
    fn against(text: &str, end_s: f64) -> Vec<String> {
        let scenario = Scenario::parse(TEXT, "walk.toml", &[]).expect("good");
        let mut recording = Recording::default();
        recording.first_frame = Some("robot/body".into());
        recording.header.entries = BTreeMap::from([("scenario_text".to_owned(), text.to_owned())]);
        let poses = recording.poses.entry("robot/body".into()).or_default();
        poses.t_s.push(end_s);
        found(&scenario, &recording)
    }

    #[test]
    fn how_it_is_computed_may_differ_what_is_computed_may_not() {
        let finer = TEXT.replace("0.001", "1e-4").replace("iterative", "monolithic").replace("false", "true");
        assert_eq!(against(&finer, 1.0), Vec::<String>::new());
        let soil = against(&TEXT.replace("bekker", "cellular-automaton"), 1.0);
        assert_eq!(soil, ["`soil.module` is \"soil-cellular-automaton\" and not \"soil-bekker\""]);
        assert_eq!(against(TEXT, 0.5), ["it ends at t = 0.5 s and not at 1 s"]);
        assert_eq!(against("[", 1.0), ["it does not say what was simulated"]);
    }
}
