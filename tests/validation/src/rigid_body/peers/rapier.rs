//! Rapier's column: a small program of its own workspace, built here on its first use.

use super::reference;
use crate::process::{Outcome, cargo, command as start, root, target};
use std::process::Command;

/// The command that measures it.
pub fn command() -> Outcome<Command> {
    let (manifest, place) =
        (root().join("tests/validation/peers/rapier/Cargo.toml"), target().join("peers/rapier"));
    let manifest = manifest.display().to_string();
    let mut build = cargo(&["build", "--release", "--quiet", "--manifest-path", &manifest]);
    let output = build.env("CARGO_TARGET_DIR", &place).output().map_err(|e| format!("cargo: {e}"))?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        let first = text.lines().find(|l| l.starts_with("error")).unwrap_or("no reason given");
        return Err(format!("Rapier cannot be built: {first}"));
    }
    let program = place.join("release/peer-rapier");
    let (folder, robot) = (reference("").display().to_string(), root().join("models/hexapod.urdf"));
    Ok(start(program, &[&folder, &robot.display().to_string()]))
}
