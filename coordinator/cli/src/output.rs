//! Lines of standard output: a reader that closes the pipe early, such as `head`, ends the program quietly.

use super::{apart, standard_output};
use std::fmt::Arguments;
use std::io::ErrorKind;
use terraglue_host::exit_guard;

/// Writes one line to standard output. Ends the program with code 0 when nobody reads on, with 1 when the
/// output cannot be written for another reason.
pub fn line(text: Arguments) {
    if let Err(error) = standard_output::own().write_all(format!("{text}\n").as_bytes()) {
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
