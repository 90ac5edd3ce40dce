//! Figures of functional mock-up units: glued pairs, bodies that turn, loops at the start, the order of a step and its error over cost,
//! cycles of life, cost, the reference FMUs, those of other tools.

mod cost;
mod cycles;
mod error_over_cost;
pub(super) mod fmus;
mod folder;
mod hostile;
mod loops;
mod master;
mod order;
mod pair;
mod reference;
mod setup;
mod third_party;
mod turning;
mod watched;

use super::{Context, Part};
use crate::process::Outcome;
use std::path::{Path, PathBuf};
use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue::testbed::Options;

/// The parts, in the order of the table.
pub const PARTS: [Part; 13] = [
    ("pair", |context| pair::figures(&workplace(context)?, !context.quick)),
    ("turning", |context| turning::figures(&workplace(context)?)),
    ("loops", |context| loops::figures(&workplace(context)?)),
    ("order", |context| order::figures(&workplace(context)?)),
    ("error-over-cost", |context| error_over_cost::figures(&workplace(context)?, !context.quick)),
    ("master", |context| master::figures(&workplace(context)?, context)),
    ("cycles", |context| cycles::figures(&workplace(context)?, context.quick)),
    ("archives", |context| hostile::archives::figures(&workplace(context)?, context)),
    ("behaviour", |context| hostile::behaviour::figures(&workplace(context)?, context)),
    ("reference", reference::figures),
    ("setup", |context| setup::figures(&workplace(context)?, context)),
    ("third-party", |context| third_party::figures(&workplace(context)?, context)),
    ("cost", |context| cost::figures(&workplace(context)?, context)),
];

/// Where the FMUs are made.
fn workplace(context: &Context) -> Outcome<PathBuf> {
    let folder = context.scratch.join("fmi");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    Ok(folder)
}

/// A testbed from the text of a scenario that lies in `folder`.
fn testbed(folder: &Path, text: &str) -> Result<Testbed, terraglue::Error> {
    testbed_on(folder, text, 1)
}

/// The same on so many threads.
fn testbed_on(folder: &Path, text: &str, threads: usize) -> Result<Testbed, terraglue::Error> {
    let path = folder.join("scenario.toml").display().to_string();
    let scenario = Scenario::parse(text, &path, &[])?;
    Testbed::build_with(&scenario, &Options { threads, ..Options::default() }, &terraglue::library())
}

/// The same where an error ends the measurement.
fn built(folder: &Path, text: &str) -> Outcome<Testbed> {
    testbed(folder, text).map_err(|e| e.to_string())
}
