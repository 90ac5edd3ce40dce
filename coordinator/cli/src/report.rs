//! `terraglue report`: the report of any recording, also of one that was cut off.

use super::Exit;
use super::folder::free;
use super::output::outln;
use super::points;
use std::path::Path;
use terraglue_diagnostics::Result;
use terraglue_recording as recording;
use terraglue_recording::{CHECKPOINT, RECORDING, Recording};
use terraglue_scenario::InputError;

/// Mends the recording of a folder where its end is missing and nothing goes on with it, then writes the report, and the points of its scanners
/// where a file is named.
pub fn report(folder: &Path, points: Option<&Path>) -> Result<Exit> {
    points.map(points::check).transpose()?;
    let path = folder.join(RECORDING);
    if !path.is_file() {
        let message = format!("there is no {RECORDING} in `{}`", folder.display());
        let help = Some("give the folder of a run, e.g. runs/moon_walk".into());
        return Err(InputError::plain(message, help).into());
    }
    // what writes it, now or after --resume, counts on the file as it is
    let goes_on = folder.join(CHECKPOINT).is_file() || free(folder).is_err();
    let mended = !goes_on && recording::mend(folder)?;
    let recorded = Recording::open(folder)?;
    if goes_on && !recording::has_end(folder)? {
        let (path, t_s) = (path.display(), recorded.end_s());
        eprintln!(
            "note: `{path}` has no end yet and is left as it is: the report shows what arrived whole, up to t = {t_s:.3} s"
        );
    }
    if mended {
        eprintln!(
            "warning: `{}` had no end: it keeps what arrived whole, up to t = {:.3} s, and ends there now",
            path.display(),
            recorded.end_s()
        );
    }
    let damaged = recorded.damaged;
    if damaged > 0 {
        eprintln!("warning: `{}` is damaged: {damaged} parts of it are left out", path.display());
    }
    outln!("report: {}", recording::report::write(folder)?.display());
    if let Some(path) = points {
        outln!("points: {} ({} points)", path.display(), points::write(folder, path)?);
    }
    Ok(Exit::Done)
}
