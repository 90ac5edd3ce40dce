//! A scenario as a functional mock-up unit.
//!
//! [`write()`] packs a scenario, its modules and its files; [`open`] makes an instance from them inside the FMU.
//! A single module is exported as a small scenario around it: a soil gets ground and `feet` that another program
//! moves.

mod bundle;
mod page;
mod whole;
mod wrap;

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use terraglue_engine::testbed::{Options, Testbed};
use terraglue_fmi::Version;
use terraglue_fmi::export::{Layout, Opened, Opening, Origin};
use terraglue_scenario::Scenario;
use whole::Whole;

pub use bundle::{Exported, write};
pub use wrap::wrap;

/// States that a master can keep at a time, one for the FMU's own use among them.
const SLOTS: u32 = 33;

/// Names in the resources of an FMU.
const SCENARIO: &str = "scenario.toml";
const SETTINGS: &str = "settings.json";

/// Target and options of an export.
#[derive(Clone, Debug)]
pub struct Request {
    /// A scenario file, or the name of a module.
    pub target: String,
    /// Edits of the scenario.
    pub sets: Vec<(String, String)>,
    /// Folders searched for modules before all others.
    pub module_paths: Vec<PathBuf>,
    /// Version of the standard.
    pub version: Version,
    /// Arrays element by element also in FMI 3.0.
    pub scalars: bool,
    /// Author, version and date of the model for the description.
    pub origin: Origin,
    /// Whether results of its first steps go into it.
    pub reference: bool,
    /// Where the FMU goes.
    pub out: PathBuf,
}

/// Settings that the FMU's own library needs beside the scenario.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExportSettings {
    /// 2 or 3.
    version: u32,
    scalars: bool,
    token: String,
    /// Subsystem whose variables have no prefix.
    bare: Option<String>,
}

impl ExportSettings {
    fn fmi(&self) -> Version {
        if self.version == 2 { Version::V2 } else { Version::V3 }
    }
}

/// Makes an instance from the resources of an FMU.
///
/// # Errors
/// A resource that is missing or wrong, in words.
pub fn open(opening: &Opening) -> Result<Opened, String> {
    let path = opening.resources.join(SETTINGS);
    let text =
        terraglue_subsystem::files::read_text(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let settings: ExportSettings =
        serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
    let whole = instance(opening, &settings).map_err(|e| e.to_string())?;
    let subsystem = whole.map_err(|e| e.to_string())?;
    let layout =
        Layout::new(settings.fmi(), settings.scalars, terraglue_subsystem::Subsystem::variables(&subsystem));
    let (joints, token) = (subsystem.joints(), settings.token);
    Ok(Opened { layout, token, slots: SLOTS, settles: true, joints, subsystem: Box::new(subsystem) })
}

fn instance(
    opening: &Opening,
    settings: &ExportSettings,
) -> terraglue_diagnostics::Result<terraglue_subsystem::Result<Whole>> {
    let scenario = Scenario::load(&opening.resources.join(SCENARIO), &[])?;
    // Nothing but the FMU's own modules: not what the program that runs it happens to have beside it.
    let options = Options { threads: 1, ..Options::default() };
    let log = opening.log.clone();
    let testbed = Testbed::build_hosted(&scenario, &options, &crate::library(), |services| {
        terraglue_host::HostServices {
            slots: SLOTS,
            log: Some(Arc::new(move |name, level, text| log.put(level, &format!("{name}: {text}")))),
            ..services
        }
    })?;
    Ok(Whole::new(testbed, settings.bare.as_deref(), SLOTS))
}

/// Writes a file below a folder, with the folders on the way.
fn place(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), String> {
    let path = folder.join(name);
    let made = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    made.and_then(|()| std::fs::write(&path, bytes)).map_err(|e| format!("{}: {e}", path.display()))
}
