//! Figures of functional mock-up units: glued pairs, loops at the start, cycles of life, cost, the reference units.

mod cost;
mod cycles;
mod loops;
mod pair;
mod reference;
pub(super) mod units;

use super::{Context, Figure};
use crate::process::Outcome;
use std::path::Path;
use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue::testbed::Options;

/// All figures of the area.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let folder = context.scratch.join("fmi");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut all = pair::figures(&folder, !context.quick)?;
    all.extend(loops::figures(&folder)?);
    all.extend(cycles::figures(&folder, context.quick)?);
    all.extend(reference::figures(context)?);
    if context.timing {
        all.extend(cost::figures(&folder, context)?);
    }
    Ok(all)
}

/// A testbed from the text of a scenario that lies in `folder`.
fn testbed(folder: &Path, text: &str) -> Result<Testbed, terraglue::Error> {
    testbed_on(folder, text, 1)
}

/// The same on so many threads.
fn testbed_on(folder: &Path, text: &str, threads: usize) -> Result<Testbed, terraglue::Error> {
    let path = folder.join("scenario.toml").display().to_string();
    let scenario = Scenario::parse(text, &path, &[])?;
    Testbed::build(&scenario, &Options { threads, ..Options::default() })
}

/// The same where an error ends the measurement.
fn built(folder: &Path, text: &str) -> Outcome<Testbed> {
    testbed(folder, text).map_err(|e| e.to_string())
}
