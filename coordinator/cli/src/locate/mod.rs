//! `terraglue locate`: where a scanner stands among the trees of a map.

pub mod arguments;
mod picture;
mod scan_file;

use super::output::outln;
use super::{Exit, show};
use arguments::LocateArguments;
use serde_json::{Value, json};
use std::path::Path;
use terraglue_diagnostics::{Error, Result};
use terraglue_scenario::InputError;
use terraglue_tree_localisation::{
    Answer, Detection, Detector, Found, LocalTree, MatchModel, Matcher, Reason, TreeMap, merged,
};

/// Finds stems, matches them and prints.
pub fn locate(a: &LocateArguments) -> Result<Exit> {
    if ![0, 1, a.scans.len()].contains(&a.scanner.len()) {
        let message = format!("{} scans and {} places of scanners", a.scans.len(), a.scanner.len());
        let help = "name --scanner once for all scans, or once for each".to_owned();
        return Err(InputError::plain(message, Some(help)).into());
    }
    let map = read_map(&a.map)?;
    let mut detections = Vec::new();
    for (number, path) in a.scans.iter().enumerate() {
        let eye = a.scanner.get(number).or(a.scanner.first()).copied();
        detections.push(Detector::default().detect(&scan_file::read(path, eye)?));
    }
    let maps: Vec<Vec<LocalTree>> =
        detections.iter().map(|d| d.stems.iter().map(LocalTree::from).collect()).collect();
    let local = merged(&maps);
    let model = MatchModel { noise_m: a.map_noise, matched: 1.0 - a.missing, diameter_m: a.map_diameter };
    let matcher = Matcher::with(map, model);
    let answer = matcher.find(&local, a.prior().as_ref());
    if let Some(path) = &a.picture {
        let text = picture::svg(matcher.map(), &local, &answer);
        let failed = |source| Error::File { path: path.display().to_string(), source };
        terraglue_subsystem::files::can_create(path)
            .and_then(|()| std::fs::write(path, text))
            .map_err(failed)?;
    }
    if a.json {
        outln!("{}", as_json(&detections, &local, &answer));
        return Ok(Exit::Done);
    }
    print(a, &detections, &local, &answer);
    Ok(Exit::Done)
}

/// Reads a table of trees.
fn read_map(path: &Path) -> Result<TreeMap> {
    let failed = |source| Error::File { path: path.display().to_string(), source };
    let text = terraglue_subsystem::files::read_text(path).map_err(failed)?;
    let map = TreeMap::from_table(&text).map_err(|e| {
        let help = "a map is a table with the columns x and y in metres, and dbh_m where diameters are known";
        InputError::plain(format!("{}: {e}", path.display()), Some(help.into()))
    })?;
    Ok(map)
}

/// Name of an answer, and its reason.
fn named(answer: &Answer) -> (&'static str, Option<&Reason>) {
    match answer {
        Answer::Located(_) => ("located", None),
        Answer::Ambiguous(reason, _) => ("ambiguous", Some(reason)),
        Answer::Lost(reason) => ("lost", Some(reason)),
    }
}

/// Poses of an answer, the best first.
fn poses(answer: &Answer) -> Vec<&Found> {
    match answer {
        Answer::Located(found) => vec![&found.found],
        Answer::Ambiguous(_, all) => all.iter().collect(),
        Answer::Lost(_) => Vec::new(),
    }
}

fn print(a: &LocateArguments, detections: &[Detection], local: &[LocalTree], answer: &Answer) {
    for (path, detection) in a.scans.iter().zip(detections) {
        let why = detection.nothing.map_or(String::new(), |n| format!(": {n}"));
        let dropped = detection.dropped.total();
        outln!("{}: {} stems, {dropped} points left out{why}", path.display(), detection.stems.len());
    }
    let (name, reason) = named(answer);
    outln!("{} trees around; {name}{}", local.len(), reason.map_or(String::new(), |r| format!(": {r}")));
    let mut table = show::table(&["x, m", "y, m", "yaw, deg", "deviation, m", "score, nats", "matched"]);
    for found in poses(answer) {
        let deviation = (0.5 * (found.covariance[(0, 0)] + found.covariance[(1, 1)])).sqrt();
        table.add_row([
            format!("{:.2}", found.pose.x),
            format!("{:.2}", found.pose.y),
            format!("{:.1}", found.pose.yaw.to_degrees()),
            format!("{deviation:.3}"),
            format!("{:.1}", found.score),
            format!("{} of {}", found.matched, found.seen),
        ]);
    }
    if !poses(answer).is_empty() {
        outln!("{table}");
    }
    if let Answer::Located(found) = answer {
        let (next, chance) = (found.runner_up, found.false_matches);
        outln!("next best pose: {next:.1} nats; false matches expected by chance: {chance:.1e}");
    }
}

fn as_json(detections: &[Detection], local: &[LocalTree], answer: &Answer) -> Value {
    let (name, reason) = named(answer);
    let scan = |d: &Detection| {
        json!({
            "stems": d.stems.len(),
            "dropped": d.dropped.total(),
            "nothing": d.nothing.map(|n| n.to_string()),
        })
    };
    let tree = |t: &LocalTree| json!({"x": t.place[0], "y": t.place[1], "deviation": t.deviation, "diameter": t.diameter});
    let pose = |f: &&Found| {
        json!({
            "x": f.pose.x, "y": f.pose.y, "yaw": f.pose.yaw, "score": f.score,
            "matched": f.matched, "seen": f.seen, "covariance": f.covariance.as_slice(),
        })
    };
    let mut out = json!({
        "answer": name,
        "reason": reason.map(ToString::to_string),
        "poses": poses(answer).iter().map(pose).collect::<Vec<_>>(),
        "scans": detections.iter().map(scan).collect::<Vec<_>>(),
        "trees": local.iter().map(tree).collect::<Vec<_>>(),
    });
    if let Answer::Located(found) = answer {
        out["runner_up"] = json!(found.runner_up);
        out["false_matches"] = json!(found.false_matches);
    }
    out
}
