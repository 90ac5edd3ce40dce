//! Archives of functional mock-up units that readers must refuse, whose libraries cannot be loaded, or that are odd but
//! legal; and good ones changed at random.
//!
//! Every archive holds the library that the caller gives, in the folders of both versions, so that code which runs too
//! early can be noticed.

mod descriptions;
pub mod mutations;
mod refused;
mod unloadable;
mod usable;
mod zip;

use std::path::Path;

pub use refused::refused;
pub use unloadable::{another_token, unloadable};
pub use usable::{MANY, usable};

/// An archive, and the expected error.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its fault.
    pub name: String,
    /// The archive.
    pub bytes: Vec<u8>,
    /// Words of the one error that it must be answered with; empty where any will do.
    pub says: &'static str,
}

impl Case {
    fn new(name: impl Into<String>, bytes: Vec<u8>, says: &'static str) -> Self {
        Self { name: name.into(), bytes, says }
    }
}

/// Name of the description in an archive.
const DESCRIPTION: &str = "modelDescription.xml";
/// Names of the library in an archive, of FMI 2.0 and 3.0.
const LIBRARIES: [&str; 2] = ["binaries/linux64/m.so", "binaries/x86_64-linux/m.so"];

/// Changed archives that were kept, each the first with its kind of answer: name and bytes, in the order of the names.
///
/// # Errors
/// The folder cannot be read.
pub fn corpus() -> std::io::Result<Vec<(String, Vec<u8>)>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "fmu") {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            all.push((name, std::fs::read(&path)?));
        }
    }
    all.sort();
    Ok(all)
}
