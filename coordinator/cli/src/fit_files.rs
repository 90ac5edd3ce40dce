//! Files that `fit-soil` names and writes.

use std::path::{Path, PathBuf};
use terraglue_diagnostics::{Error, Result};

/// The name of a file without its folder.
pub(super) fn name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// Where the drawing of a fit goes.
pub(super) fn drawing_of(out: &Path) -> PathBuf {
    out.with_extension("svg")
}

/// Writes a result.
pub(super) fn write(path: &Path, text: &str) -> Result {
    terraglue_subsystem::files::can_create(path)
        .and_then(|()| std::fs::write(path, text))
        .map_err(|source| Error::File { path: path.display().to_string(), source })
}
