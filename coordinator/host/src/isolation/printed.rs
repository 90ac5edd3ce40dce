//! What foreign code prints in a worker: a file takes both of its outputs, the worker reads it after its calls and logs the
//! lines, and the host reads what is left of a worker that was lost.
#![allow(unsafe_code)] // Streams of the C library are set and flushed.

use std::fs::File;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Name of the file in the folder of the worker.
const FILE: &str = "printed.txt";
/// Most bytes of a worker that are shown.
const MOST: usize = 1 << 20;
/// Most lines that are logged after one call.
const AT_ONCE: usize = 500;
/// Most lines of a worker that was lost.
const LAST: usize = 12;

/// The file for the outputs of a worker that is about to start.
pub fn file(folder: &Path) -> io::Result<File> {
    File::options().read(true).append(true).create(true).open(folder.join(FILE))
}

/// The last lines that a lost worker printed and did not log, each after a line break.
pub fn last_words(folder: &Path) -> String {
    let text = std::fs::read(folder.join(FILE)).unwrap_or_default();
    let text = String::from_utf8_lossy(&text[text.len().saturating_sub(MOST)..]);
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines[lines.len().saturating_sub(LAST)..].iter().map(|line| format!("\n{line}")).collect()
}

/// The outputs of this process, a worker.
#[derive(Default)]
pub struct Printed {
    file: Option<File>,
    /// Bytes that were shown.
    shown: usize,
}

impl Printed {
    /// Takes them, where they go to a file. Lines are there as soon as they are printed, also where a crash follows.
    pub fn of_this_process() -> Self {
        unsafe extern "C" {
            static stdout: *mut libc::FILE;
        }
        let file = io::stdout().as_fd().try_clone_to_owned().map(File::from).ok();
        let file = file.filter(|file| file.metadata().is_ok_and(|about| about.is_file()));
        if file.is_some() {
            // SAFETY: the stream of the C library, before anything is written to it.
            unsafe { libc::setvbuf(stdout, std::ptr::null_mut(), libc::_IOLBF, 0) };
        }
        Self { file, shown: 0 }
    }

    /// Hands on each line that was printed since the last call, up to a bound, and empties the file.
    pub fn take(&mut self, mut line: impl FnMut(&str)) {
        let Some(file) = &self.file else { return };
        // SAFETY: of all streams; a plain call of the C library.
        unsafe { libc::fflush(std::ptr::null_mut()) };
        let length = file.metadata().map_or(0, |about| about.len()) as usize;
        if length == 0 {
            return;
        }
        let room = MOST.saturating_sub(self.shown);
        let mut bytes = vec![0; length.min(room)];
        let read = file.read_at(&mut bytes, 0).unwrap_or(0);
        // the next output goes to the start: the file is opened to append
        drop(file.set_len(0));
        self.shown = (self.shown + length).min(MOST);
        let text = String::from_utf8_lossy(&bytes[..read]);
        text.lines().take(AT_ONCE).for_each(&mut line);
        if room > 0 && length >= room {
            line(&format!("{} kB were printed; the rest is left out", MOST >> 10));
        } else if let more @ 1.. = text.lines().count().saturating_sub(AT_ONCE) {
            line(&format!("{more} more lines are left out"));
        }
    }
}
