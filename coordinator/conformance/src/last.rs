//! The last check of a module, by the bytes of its file: `terraglue modules` shows it beside the file.
//!
//! One small file per module file lies in the user's cache, `$XDG_CACHE_HOME/terraglue/checks`. A module that was built anew
//! has other bytes, and with them no last check.

use super::report::Report;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The end of a check of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastCheck {
    /// Level in words.
    pub level: String,
    /// Seed.
    pub seed: u64,
    /// Version of the program that checked.
    pub version: String,
    /// How many tests ended how.
    pub summary: String,
    /// Names of the tests that were broken.
    pub broken: Vec<String>,
}

impl LastCheck {
    /// In a few words.
    pub fn words(&self) -> String {
        match self.broken.as_slice() {
            [] => format!("passed ({})", self.level),
            [one] => format!("failed {one} ({})", self.level),
            [first, rest @ ..] => format!("failed {first} and {} more ({})", rest.len(), self.level),
        }
    }
}

/// Keeps the end of a check. Where nothing can be kept, nothing is: the check itself is what counts.
pub fn remember(module: &Path, report: &Report) {
    let Some(file) = place(module) else { return };
    let last = LastCheck {
        level: report.level.into(),
        seed: report.seed,
        version: env!("CARGO_PKG_VERSION").into(),
        summary: report.summary(),
        broken: report.broken().into_iter().map(str::to_owned).collect(),
    };
    let kept = file.parent().map(std::fs::create_dir_all).transpose().map_err(|e| e.to_string());
    let kept = kept.and_then(|_| serde_json::to_string(&last).map_err(|e| e.to_string()));
    let kept = kept.and_then(|text| std::fs::write(&file, text).map_err(|e| e.to_string()));
    if let Err(why) = kept {
        log::info!("the check of {} is not kept: {why}", module.display());
    }
}

/// How the last check of a file with the same bytes ended.
pub fn last_check(module: &Path) -> Option<LastCheck> {
    serde_json::from_str(&std::fs::read_to_string(place(module)?).ok()?).ok()
}

fn place(module: &Path) -> Option<PathBuf> {
    let bytes = std::fs::read(module).ok()?;
    let cache = std::env::var_os("XDG_CACHE_HOME").filter(|d| !d.is_empty()).map(PathBuf::from);
    let cache = cache.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))?;
    Some(cache.join(format!("terraglue/checks/{:016x}.json", terraglue_diagnostics::fingerprint(&bytes))))
}
