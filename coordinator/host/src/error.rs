//! Reasons why a module cannot be used; each with its own message and a number, under which `docs/plugins/errors.md` describes
//! the cure at length.

use std::path::PathBuf;
use terraglue_plugin::TableError;

/// Why a module could not be found, loaded or instantiated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// No file of the name; the search path and the nearest name say what to do.
    #[error("[TG01] no module `{name}`{}; looked for {file} in:{}", hint(.nearest), lines(.looked))]
    Unknown {
        /// Name in the scenario.
        name: String,
        /// File that was looked for.
        file: String,
        /// Folders in the order of the search.
        looked: Vec<PathBuf>,
        /// The module of nearest name.
        nearest: Option<String>,
    },
    /// A path that leads to no file.
    #[error("[TG02] there is no module file {}", .path.display())]
    MissingFile {
        /// Path.
        path: PathBuf,
    },
    /// Not a shared library at all.
    #[error("[TG03] {} is not a shared library: {reason}", .path.display())]
    NotALibrary {
        /// Path.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A shared library for another kind of machine.
    #[error(
        "[TG04] {} cannot be loaded: it is made for another kind of machine (ELF number {machine}); build it on this \
         machine, or for it",
        .path.display()
    )]
    OtherMachine {
        /// Path.
        path: PathBuf,
        /// Its number in the ELF header.
        machine: usize,
    },
    /// A shared library that the system does not load.
    #[error("[TG05] {} cannot be loaded: {reason}", .path.display())]
    CannotLoad {
        /// Path.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// A shared library that is no module.
    #[error(
        "[TG06] {} is a shared library but no Terraglue module: it has no symbol `{}` ({reason}); a module in Rust \
         invokes export_subsystem!, one in C defines that function",
        .path.display(),
        terraglue_plugin::ENTRY
    )]
    MissingSymbol {
        /// Path.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// Another version of the ABI, read from the section `.terraglue` without running the library.
    #[error(
        "[TG07] {} was built for ABI {found}, this program speaks ABI {}.{}; build the module again with the header or \
         the crate of this version",
        .path.display(),
        terraglue_plugin::abi::TG_ABI_MAJOR,
        terraglue_plugin::abi::TG_ABI_MINOR
    )]
    Version {
        /// Path.
        path: PathBuf,
        /// Version in the section.
        found: String,
    },
    /// A table of functions that cannot be used.
    #[error("[TG08] {} cannot be used: {source}", .path.display())]
    Table {
        /// Path.
        path: PathBuf,
        /// Why.
        source: TableError,
    },
    /// A module that does not say what it is.
    #[error("[TG09] {} does not describe itself: {message}", .path.display())]
    Schema {
        /// Path.
        path: PathBuf,
        /// Description of the error.
        message: String,
    },
    /// The parameters of the scenario are not acceptable.
    #[error("[TG10] {subsystem} ({module}): {message}")]
    Refused {
        /// Name in the scenario.
        subsystem: String,
        /// Module name.
        module: String,
        /// Its message.
        message: String,
    },
    /// The module failed at its start.
    #[error("[TG11] {subsystem} ({module}): instantiate failed: {message}")]
    Instantiate {
        /// Name in the scenario.
        subsystem: String,
        /// Module name.
        module: String,
        /// Its message.
        message: String,
    },
}

impl LoadError {
    /// Whether there is no module of that name.
    pub fn is_unknown(&self) -> bool {
        matches!(self, Self::Unknown { .. })
    }

    /// The way out, where one is known: the nearest module name.
    pub fn nearest(&self) -> Option<&str> {
        match self {
            Self::Unknown { nearest, .. } => nearest.as_deref(),
            _ => None,
        }
    }
}

fn hint(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|n| format!(", did you mean `{n}`?")).unwrap_or_default()
}

fn lines(folders: &[PathBuf]) -> String {
    folders.iter().map(|f| format!("\n  {}", f.display())).collect()
}
