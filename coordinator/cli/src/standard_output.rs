//! Standard output belongs to the program: what modules and FMUs print goes elsewhere.

use std::fs::File;
use std::io::Write;
use std::os::fd::AsFd;
use std::sync::OnceLock;

/// Standard output as the program was started with it.
static OWN: OnceLock<File> = OnceLock::new();

/// Keeps standard output for the program: what modules and FMUs of this process print goes to standard error from now on, so that it does
/// not get into tables. Where there is no standard output, all stays as it is.
pub fn keep_apart_from_modules() {
    let own = std::io::stdout().as_fd().try_clone_to_owned();
    if let Ok(own) = own
        && rustix::stdio::dup2_stdout(std::io::stderr()).is_ok()
    {
        // it is called once
        drop(OWN.set(own.into()));
    }
}

/// Standard output of the program.
pub fn own() -> Box<dyn Write> {
    match OWN.get() {
        Some(file) => Box::new(file),
        None => Box::new(std::io::stdout().lock()),
    }
}
