//! Folders of the workspace, child processes that must succeed, and runs of scenarios.

use serde_json::Value;
use std::path::Path;
pub use xtask_start::process::*;

/// Runs a scenario as a user does and reads `summary.json` from standard output; `name` appears in errors.
pub fn run_scenario(
    program: &Path,
    name: &str,
    scenario: &str,
    out: &Path,
    options: &[&str],
) -> Outcome<Value> {
    let out = out.display().to_string();
    let mut child = command(program, &["run", scenario, "--json", "--out", &out]);
    let output = child.args(options).output().map_err(|e| format!("{name}: {e}"))?;
    serde_json::from_slice(&output.stdout)
        .map_err(|_| format!("{name} gave no summary: {}", String::from_utf8_lossy(&output.stderr).trim()))
}
