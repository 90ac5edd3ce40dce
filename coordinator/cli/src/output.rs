//! Standard output: it belongs to the program alone, and a reader that closes the pipe early, such as `head`, ends the program quietly.

use super::apart;
use std::fmt::Arguments;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::os::fd::AsFd;
use std::sync::OnceLock;
use terraglue_host::exit_guard;

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

/// Writes one line to standard output. Ends the program with code 0 when nobody reads on, with 1 when the
/// output cannot be written for another reason.
pub fn line(text: Arguments) {
    if let Err(error) = own().write_all(format!("{text}\n").as_bytes()) {
        end_if_unread(&error);
        eprintln!(
            "error: standard output: {error}\n  help: look for room where it is written to, or send it elsewhere"
        );
        exit_guard::leave(1);
    }
}

/// Ends the program with code 0 where a write failed because nobody reads on.
pub fn end_if_unread(error: &std::io::Error) {
    if error.kind() == ErrorKind::BrokenPipe {
        apart::done(0);
        exit_guard::leave(0);
    }
}

/// `println!` for a standard output that may be closed.
macro_rules! outln {
    ($($text:tt)*) => { $crate::output::line(format_args!($($text)*)) };
}
pub(crate) use outln;
