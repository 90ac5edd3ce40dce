//! `terraglue report`: the report of any recording, also of one that was cut off.

use super::Exit;
use std::path::Path;
use terraglue::Result;
use terraglue::recording::{self, RECORDING};
use terraglue::scenario::InputError;

/// Mends the recording of a folder where its end is missing, then writes the report.
pub fn report(folder: &Path) -> Result<Exit> {
    if !folder.join(RECORDING).is_file() {
        let message = format!("there is no {RECORDING} in `{}`", folder.display());
        let help = Some("give the folder of a run, e.g. runs/moon_walk".into());
        return Err(InputError::plain(message, help).into());
    }
    recording::mend(folder)?;
    println!("report: {}", recording::report::write(folder)?.display());
    Ok(Exit::Done)
}
