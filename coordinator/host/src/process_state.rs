//! State of the process on which the program itself relies, and that it resets if foreign code has changed it: the
//! working folder, the mask for new files, the locale, the signals that end a run.
#![allow(unsafe_code)] // State of the C library is read and set.

use std::ffi::{CStr, CString};
use std::path::PathBuf;
use std::sync::Mutex;
use terraglue_fmi::floating_point::Mode;

/// Signals whose handling matters here: Ctrl-C and its like, closed pipes, ended children.
const SIGNALS: [libc::c_int; 5] = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP, libc::SIGPIPE, libc::SIGCHLD];

/// The state of the process as it was.
pub struct ProcessState {
    folder: Option<PathBuf>,
    mask: libc::mode_t,
    locale: CString,
    handlers: [libc::sigaction; SIGNALS.len()],
    blocked: libc::sigset_t,
    mode: Mode,
}

impl ProcessState {
    /// As they are now; the handling of blocked signals is that of this thread.
    #[must_use]
    pub fn now() -> Self {
        let mut handlers = [no_handler(); SIGNALS.len()];
        for (signal, handler) in SIGNALS.iter().zip(&mut handlers) {
            // SAFETY: only asks; the place is a valid one.
            unsafe { libc::sigaction(*signal, std::ptr::null(), handler) };
        }
        Self {
            folder: std::env::current_dir().ok(),
            mask: mask(),
            locale: locale(),
            handlers,
            blocked: blocked(),
            mode: Mode::now(),
        }
    }

    /// Sets back what has changed; its names.
    pub fn restore(&self) -> Vec<&'static str> {
        let now = Self::now();
        let mut changed = Vec::new();
        if let Some(folder) = &self.folder
            && now.folder.as_ref() != Some(folder)
            && std::env::set_current_dir(folder).is_ok()
        {
            changed.push("working folder");
        }
        if now.mask != self.mask {
            // SAFETY: sets a number of the process.
            unsafe { libc::umask(self.mask) };
            changed.push("mask for new files");
        }
        if now.locale != self.locale {
            // SAFETY: the text ends with zero and is one that the library gave.
            unsafe { libc::setlocale(libc::LC_ALL, self.locale.as_ptr()) };
            changed.push("locale");
        }
        if self.mode.restore() {
            changed.push("rounding or the treatment of tiny numbers");
        }
        if self.restore_signals(&now) {
            changed.push("signals");
        }
        changed
    }

    fn restore_signals(&self, now: &Self) -> bool {
        let mut changed = false;
        for ((signal, before), now) in SIGNALS.iter().zip(&self.handlers).zip(&now.handlers) {
            if before.sa_sigaction != now.sa_sigaction {
                // SAFETY: the action is one that the system gave.
                unsafe { libc::sigaction(*signal, before, std::ptr::null_mut()) };
                changed = true;
            }
        }
        // SAFETY: both sets were filled by the system.
        let member = |set: &libc::sigset_t, signal| unsafe { libc::sigismember(set, signal) };
        if SIGNALS.iter().any(|s| member(&self.blocked, *s) != member(&now.blocked, *s)) {
            // SAFETY: as above.
            unsafe {
                libc::pthread_sigmask(libc::SIG_SETMASK, &raw const self.blocked, std::ptr::null_mut())
            };
            changed = true;
        }
        changed
    }
}

fn no_handler() -> libc::sigaction {
    // SAFETY: all zero is a valid value of this plain structure.
    unsafe { std::mem::zeroed() }
}

/// The mask for new files. Linux reports it; elsewhere it can only be read by setting it, which other threads would see.
fn mask() -> libc::mode_t {
    static READING: Mutex<()> = Mutex::new(());
    told_mask().unwrap_or_else(|| {
        let _one_at_a_time = READING.lock();
        // SAFETY: sets a number of the process, and sets it back.
        unsafe {
            let mask = libc::umask(0o077);
            libc::umask(mask);
            mask
        }
    })
}

/// The mask in `/proc`.
fn told_mask() -> Option<libc::mode_t> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mask = status.lines().find_map(|line| line.strip_prefix("Umask:"))?;
    libc::mode_t::from_str_radix(mask.trim(), 8).ok()
}

fn locale() -> CString {
    // SAFETY: a null second argument only asks; the text is copied at once.
    unsafe {
        let text = libc::setlocale(libc::LC_ALL, std::ptr::null());
        if text.is_null() { CString::default() } else { CStr::from_ptr(text).to_owned() }
    }
}

fn blocked() -> libc::sigset_t {
    // SAFETY: an empty set is valid; the call only asks.
    unsafe {
        let mut set: libc::sigset_t = std::mem::zeroed();
        libc::pthread_sigmask(libc::SIG_BLOCK, std::ptr::null(), &raw mut set);
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs of a comparison look at the same process from several threads.
    #[test]
    fn threads_that_look_at_once_see_no_change() {
        let before = ProcessState::now();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..2000 {
                        assert_eq!(mask(), before.mask);
                    }
                });
            }
        });
    }
}
