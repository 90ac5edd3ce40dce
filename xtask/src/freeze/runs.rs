//! Runs every scenario on both soils by three strategies and hashes the numbers of its recording.

use super::Hashes;
use super::digest::Digest;
use std::path::Path;
use terraglue::recording::{GluingRecord, GroundRecord, PortRecord, Recording, Table};
use xtask_start::process::{Outcome, command, root};

const SOILS: [&str; 2] = ["soil-cellular-automaton", "soil-bekker"];
const STRATEGIES: [&str; 3] = ["cooperative", "cooperative-compliant", "iterative"];
/// Simulated time of a run, s: feet and wheels are in the ground and move by then.
const DURATION: &str = "time.duration_s=1.5";

/// Hashes of the channels of all runs.
pub fn hashes(program: &Path, scratch: &Path) -> Outcome<Hashes> {
    let mut all = Hashes::new();
    for scenario in scenarios()? {
        for soil in SOILS {
            for strategy in strategies(&scenario)? {
                let name = format!("run.{scenario}.{soil}.{strategy}");
                let recording = run(program, scratch, &scenario, soil, strategy)?;
                all.extend(channels(&recording).map(|(channel, hash)| (format!("{name}.{channel}"), hash)));
            }
        }
    }
    Ok(all)
}

/// The strategies of a scenario: single passes glue no joints.
fn strategies(scenario: &str) -> Outcome<&'static [&'static str]> {
    let path = root().join(format!("scenarios/{scenario}.toml"));
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let joints = text.lines().any(|line| line.trim() == "[[glue]]");
    Ok(if joints { &["iterative"] } else { &STRATEGIES })
}

fn scenarios() -> Outcome<Vec<String>> {
    let folder = root().join("scenarios");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let name = |path: std::path::PathBuf| {
        let toml = path.extension().is_some_and(|e| e == "toml");
        toml.then(|| path.file_stem().map(|s| s.to_string_lossy().into_owned())).flatten()
    };
    let mut names: Vec<String> = entries.flatten().filter_map(|entry| name(entry.path())).collect();
    names.sort();
    Ok(names)
}

fn run(program: &Path, scratch: &Path, scenario: &str, soil: &str, strategy: &str) -> Outcome<Recording> {
    let out = scratch.join(format!("{scenario}-{soil}-{strategy}"));
    let _ = std::fs::remove_dir_all(&out);
    let file = format!("scenarios/{scenario}.toml");
    let (soil, strategy) = (format!("soil.module={soil}"), format!("gluing.strategy={strategy}"));
    let folder = out.display().to_string();
    let mut arguments = vec!["run", &file, "--json", "--out", &folder];
    for change in [&soil, &strategy, DURATION, "recording.digits=17"] {
        arguments.extend(["--set", change]);
    }
    let output = command(program, &arguments).output().map_err(|e| format!("{file}: {e}"))?;
    if !output.status.success() {
        return Err(format!(
            "{file}, {soil}, {strategy}: {}",
            String::from_utf8_lossy(&output.stderr).trim()
        ));
    }
    Recording::open(&out).map_err(|e| format!("{file}: {e}"))
}

fn channels(recording: &Recording) -> impl Iterator<Item = (String, String)> {
    let variables =
        recording.variables.iter().map(|(subsystem, t)| (format!("variables.{subsystem}"), table(t)));
    let rest = [
        ("energy".to_owned(), table(&recording.energy)),
        ("poses".to_owned(), poses(recording)),
        ("gluing".to_owned(), gluing(&recording.gluing)),
        ("ground".to_owned(), ground(recording.final_ground.as_ref())),
    ];
    variables.chain(rest)
}

fn table(table: &Table) -> String {
    let mut digest = Digest::new();
    digest.numbers(&table.t_s);
    for (name, column) in table.names.iter().zip(&table.columns) {
        digest.name(name);
        digest.numbers(column);
    }
    digest.text()
}

fn poses(recording: &Recording) -> String {
    let mut digest = Digest::new();
    for (frame, series) in &recording.poses {
        digest.name(frame);
        digest.numbers(&series.t_s);
        digest.numbers(series.position.iter().flatten());
        digest.numbers(series.orientation.iter().flatten());
    }
    digest.text()
}

fn gluing(records: &[GluingRecord]) -> String {
    let mut digest = Digest::new();
    for r in records {
        let unknown = |x: Option<f64>| x.unwrap_or(f64::INFINITY);
        let counts = [f64::from(r.evaluations_bodies), f64::from(r.evaluations_soil)];
        let numbers = [
            r.t,
            r.max_action_reaction_gap_n,
            r.residual,
            r.kappa_max,
            r.estimate_gap_n,
            unknown(r.max_gap_m),
            unknown(r.interface_work_error_j),
        ];
        digest.numbers(counts.iter().chain(&numbers));
        digest.bytes(&[u8::from(r.xt_form), r.converged.map_or(2, u8::from)]);
        r.ports.iter().for_each(|p| port(p, &mut digest));
    }
    digest.text()
}

fn port(port: &PortRecord, digest: &mut Digest) {
    digest.name(&format!("{}.{}", port.subsystem, port.body));
    let at = port.origin;
    digest.numbers(&[f64::from(port.shape), at.x, at.y, at.z, port.t_star_n, port.gap_m]);
    digest.numbers(port.frame.iter().chain(&port.wrench));
}

fn ground(record: Option<&GroundRecord>) -> String {
    let mut digest = Digest::new();
    if let Some(record) = record {
        let heights = record.height.iter().chain(&record.sinkage);
        heights.for_each(|h| digest.bytes(&h.to_bits().to_le_bytes()));
    }
    digest.text()
}
