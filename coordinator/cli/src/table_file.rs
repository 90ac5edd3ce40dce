//! A table of `terraglue fmu run` on disk: what was written is there, however the FMU ends the program.

use super::apart;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use terraglue_diagnostics::{Error, Result};
use terraglue_host::exit_guard::{ExitHook, add_exit_hook};
use terraglue_host::kept_file::KeptFile;

/// A table that is written line by line.
#[derive(Clone)]
pub struct TableFile {
    file: Arc<Mutex<BufWriter<KeptFile>>>,
    /// Whether this process is expected to crash, so that each line goes to the system at once.
    at_once: bool,
}

impl TableFile {
    /// Creates the file, or empties it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(path: &Path) -> Result<Self> {
        let file = KeptFile::create(path);
        let file = file.map_err(|source| Error::File { path: path.display().to_string(), source })?;
        Ok(Self { file: Arc::new(Mutex::new(BufWriter::new(file))), at_once: apart::is_child() })
    }

    /// Writes a line.
    ///
    /// # Errors
    /// The system's own.
    pub fn line(&self, text: &str) -> std::io::Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        writeln!(file, "{text}")?;
        if self.at_once { file.flush() } else { Ok(()) }
    }

    /// Hands all lines to the system.
    ///
    /// # Errors
    /// The system's own.
    pub fn flush(&self) -> std::io::Result<()> {
        self.file.lock().unwrap_or_else(PoisonError::into_inner).flush()
    }
}

/// Writes what is left of the tables when the FMU ends the program, and says so.
#[must_use]
pub fn exit_hook(fmu: &Path, tables: Vec<TableFile>) -> ExitHook {
    let name = fmu.display().to_string();
    add_exit_hook(move || {
        for table in tables {
            if let Ok(mut file) = table.file.try_lock() {
                // there is nobody left to tell
                drop(file.flush());
            }
        }
        eprintln!("error: {name}: the FMU ended the program by exit()");
        apart::done(1);
    })
}
