//! `exchange.json`: how values go round in a run, for the report.

use super::layout::{EXCHANGE, at, other_at};
use std::path::Path;
use terraglue_diagnostics::error::Result;
use terraglue_engine::testbed::Explanation;

/// Writes the explanation of a run into its folder.
///
/// # Errors
/// The file cannot be written.
pub fn write_exchange(folder: &Path, explanation: &Explanation) -> Result {
    let path = folder.join(EXCHANGE);
    let text = serde_json::to_string_pretty(explanation).map_err(other_at(&path))?;
    std::fs::write(&path, text + "\n").map_err(at(&path))
}

/// The explanation in a folder, if there is one.
pub(crate) fn read_exchange(folder: &Path) -> Option<Explanation> {
    serde_json::from_slice(&std::fs::read(folder.join(EXCHANGE)).ok()?).ok()
}
