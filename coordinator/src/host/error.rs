//! Why a module cannot be used; each cause with its own message.

use std::path::PathBuf;
use terraglue_plugin::TableError;

/// Why a module could not be found, loaded or instantiated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// No file of the name; the search path and the nearest name say what to do.
    #[error("no module `{name}`{}; looked for {file} in:{}", hint(.nearest), lines(.looked))]
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
    #[error("there is no module file {}", .path.display())]
    MissingFile {
        /// Path.
        path: PathBuf,
    },
    /// Not a shared library at all.
    #[error("{} is not a shared library: {reason}", .path.display())]
    NotALibrary {
        /// Path.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A shared library that the system does not load.
    #[error("{} cannot be loaded: {reason}", .path.display())]
    CannotLoad {
        /// Path.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// A shared library that is no module.
    #[error(
        "{} is a shared library but no Terraglue module: it has no symbol `{}` ({reason}); a module in Rust \
         invokes export_subsystem!, one in C defines that function",
        .path.display(),
        terraglue_plugin::ENTRY
    )]
    MissingSymbol {
        /// Path.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// Another version of the ABI, read from the section `.terraglue` without running the library.
    #[error(
        "{} was built for ABI {found}, this program speaks ABI {}.{}; build the module again with the header or \
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
    #[error("{} cannot be used: {source}", .path.display())]
    Table {
        /// Path.
        path: PathBuf,
        /// Why.
        source: TableError,
    },
    /// A module that does not say what it is.
    #[error("{} does not describe itself: {message}", .path.display())]
    Schema {
        /// Path.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The parameters of the scenario are not acceptable.
    #[error("{subsystem} ({module}): {message}")]
    Refused {
        /// Name in the scenario.
        subsystem: String,
        /// Module name.
        module: String,
        /// What it said.
        message: String,
    },
    /// The module failed at its start.
    #[error("{subsystem} ({module}): instantiate failed: {message}")]
    Instantiate {
        /// Name in the scenario.
        subsystem: String,
        /// Module name.
        module: String,
        /// What it said.
        message: String,
    },
}

impl LoadError {
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
