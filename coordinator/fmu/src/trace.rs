//! The calls of an FMU as lines of a file, each written before it is made: the last one is known after a crash.

use std::fs::File;
use std::io::{LineWriter, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use terraglue_fmi::instance::Trace;

/// A trace that writes the calls of an instance to a file: the function, its values by reference, its status.
///
/// # Errors
/// The file cannot be created.
pub fn to_file(path: &Path) -> std::io::Result<Trace> {
    let file = Mutex::new(LineWriter::new(File::create(path)?));
    Ok(Arc::new(move |line: &str| {
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        // a trace that cannot be written on ends; the run is more important
        drop(writeln!(file, "{line}"));
    }))
}
