//! Exports soils, a robot and a scenario as FMUs, runs them with the program's own master and hashes their tables.

use super::Hashes;
use super::digest::Digest;
use std::path::Path;
use xtask_start::process::{Outcome, command, must, write};

/// Soil of the exported soils.
const ROW: &str = "soil.parameters=lunar_nominal_Apollo";

/// (name, what `terraglue export` is given, whether a foot is driven).
const CASES: [(&str, &[&str], bool); 5] = [
    ("automaton-fmi3", &["soil-cellular-automaton", "--scalars", "--set", ROW], true),
    ("bekker-fmi2", &["soil-bekker", "--fmi", "2", "--set", ROW], true),
    ("robot-fmi2", &["rigid-body", "--fmi", "2", "--set", "robot.model=models/hexapod.urdf"], false),
    ("walk-fmi3", &["scenarios/moon_walk.toml"], false),
    ("walk-fmi2", &["scenarios/moon_walk.toml", "--fmi", "2"], false),
];

/// A sphere that is pressed down, dragged and lifted: time, x, y, z.
const WAY: &str = "time,\"foot.position[1,1]\",\"foot.position[1,2]\",\"foot.position[1,3]\"\n\
                   0,0,0,0.05\n0.1,0,0,0.035\n0.2,0.03,0.01,0.03\n0.3,0,0,0.06\n";

/// Hashes of the tables of all FMUs.
pub fn hashes(program: &Path, scratch: &Path) -> Outcome<Hashes> {
    let way = scratch.join("way.csv");
    write(&way, WAY)?;
    let mut all = Hashes::new();
    for (name, what, driven) in CASES {
        let (fmu, table) = (scratch.join(format!("{name}.fmu")), scratch.join(format!("{name}.csv")));
        let (fmu, csv) = (fmu.display().to_string(), table.display().to_string());
        must(command(program, &["export"]).args(what).args(["-o", &fmu]))?;
        let mut run =
            command(program, &["fmu", "run", &fmu, "--csv", &csv, "--stop", "0.3", "--step", "0.001"]);
        if driven {
            run.args(["--start", "foot.position[1,3]=0.05", "--input", &way.display().to_string()]);
        }
        must(&mut run)?;
        let bytes = std::fs::read(&table).map_err(|e| format!("{csv}: {e}"))?;
        let mut digest = Digest::new();
        digest.bytes(&bytes);
        all.insert(format!("fmu.{name}"), digest.text());
    }
    Ok(all)
}
