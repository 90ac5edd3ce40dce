//! A crash inside a module that is not isolated: standard error names the module before the process ends as it would have.
//!
//! Every call is noted with four words of the thread; the handler reads them and calls nothing but `write`.
#![allow(unsafe_code)] // Signal handlers, and what they may read.

use std::cell::Cell;
use std::path::Path;
use std::ptr;
use std::sync::Once;

/// Signals of a crash, with their names.
const CRASHES: [(libc::c_int, &str); 5] = [
    (libc::SIGSEGV, "segmentation fault"),
    (libc::SIGBUS, "bus error"),
    (libc::SIGFPE, "arithmetic"),
    (libc::SIGILL, "illegal instruction"),
    // abort(): a failed assert, an exception that nobody catches
    (libc::SIGABRT, "abort"),
];

/// Names that a message holds. Their place in memory stays as long as an instance lives. Without a name of an instance the
/// module is a file that is being loaded.
#[derive(Debug)]
pub(super) struct Names {
    pub instance: String,
    pub module: String,
}

/// The last call of a thread; its time is not a number before there is one.
#[derive(Clone, Copy)]
struct LastCall {
    names: *const Names,
    function: &'static str,
    time_s: f64,
}

/// What stands for the functions of an FMU that is run alone.
const RUN: &str = "fmu run";

const NONE: LastCall = LastCall { names: ptr::null(), function: "", time_s: 0.0 };

thread_local! {
    static LAST: Cell<LastCall> = const { Cell::new(NONE) };
}

/// Notes that a function of an instance is called at a time, s.
#[inline]
pub(super) fn note(names: &Names, function: &'static str, time_s: f64) {
    LAST.set(LastCall { names, function, time_s });
}

/// Note of the work of a thread before there is an instance, until it ends; the earlier note comes back then.
pub struct Beginning {
    before: LastCall,
    // in a place of its own: the note stays where this value moves
    names: Box<Names>,
}

impl Beginning {
    /// A module or FMU is made an instance, so named in the scenario.
    pub fn of_instance(name: &str, file: &Path) -> Self {
        Self::new(name, file, "instantiate")
    }

    /// Code of a module's file runs while it is loaded.
    pub(super) fn of_file(file: &Path, function: &'static str) -> Self {
        Self::new("", file, function)
    }

    /// An FMU is run alone: `terraglue fmu run`.
    pub fn of_run(file: &Path) -> Self {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        Self::new(&name, file, RUN)
    }

    fn new(instance: &str, file: &Path, function: &'static str) -> Self {
        let names = Box::new(Names { instance: instance.to_owned(), module: file.display().to_string() });
        let begun = Self { before: LAST.get(), names };
        note(&begun.names, function, f64::NAN);
        begun
    }

    /// The next function of the file.
    pub(super) fn goes_on(&self, function: &'static str) {
        note(&self.names, function, f64::NAN);
    }
}

impl Drop for Beginning {
    fn drop(&mut self) {
        LAST.set(self.before);
    }
}

/// Forgets an instance that ends.
pub(super) fn forget(names: &Names) {
    if ptr::eq(LAST.get().names, names) {
        LAST.set(NONE);
    }
}

/// Handlers that were there before, by the order of [`CRASHES`]: written once, before any of ours is set.
static mut BEFORE: [Option<libc::sigaction>; CRASHES.len()] = [None; CRASHES.len()];
static LISTENING: Once = Once::new();

/// Reports crashes from here on. Earlier handlers run afterwards: the runtime reports an overflow of the stack.
pub fn tell() {
    LISTENING.call_once(|| {
        for (k, (signal, _)) in CRASHES.iter().enumerate() {
            // SAFETY: all zero is a valid value of this plain structure; the handler takes what the flags say.
            unsafe {
                let mut before: libc::sigaction = std::mem::zeroed();
                if libc::sigaction(*signal, ptr::null(), &raw mut before) != 0 {
                    continue;
                }
                BEFORE[k] = Some(before);
                let mut own: libc::sigaction = std::mem::zeroed();
                own.sa_sigaction = crashed as *const () as libc::sighandler_t;
                own.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
                libc::sigaction(*signal, &raw const own, ptr::null_mut());
            }
        }
    });
}

extern "C" fn crashed(signal: libc::c_int, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
    let index = CRASHES.iter().position(|(s, _)| *s == signal);
    if let Some(index) = index {
        // SAFETY: the names live as long as their instance, which takes them back at its end.
        let names = LAST.try_with(Cell::get).ok().and_then(|c| Some((unsafe { c.names.as_ref() }?, c)));
        if let Some((names, call)) = names {
            report(index, names, &call);
        }
        // SAFETY: the handlers were written before this one was set. Without one the system's own ends the process.
        unsafe {
            match BEFORE[index] {
                Some(before) => libc::sigaction(signal, &raw const before, ptr::null_mut()),
                None => libc::signal(signal, libc::SIG_DFL) as libc::c_int,
            };
        }
    }
    // SAFETY: the system gives a valid record. The instruction that failed fails again; a signal that was sent is sent again.
    unsafe {
        if info.as_ref().is_none_or(|i| i.si_code <= 0) {
            libc::raise(signal);
        }
    }
}

fn report(index: usize, names: &Names, call: &LastCall) {
    let (signal, words) = CRASHES[index];
    let mut room = [0; 24];
    put("\nerror: a module or FMU crashed: signal ");
    put(decimal(signal.unsigned_abs().into(), 1, &mut room));
    put(" (");
    put(words);
    put("); the last call was `");
    put(call.function);
    if names.instance.is_empty() {
        put("` while loading ");
        put(&names.module);
        put("\n  help: `terraglue check-module ");
        put(&names.module);
        put("` loads it in a process of its own\n");
        return;
    }
    put("` of `");
    put(&names.instance);
    put("` (");
    put(&names.module);
    put(")");
    if !call.time_s.is_nan() {
        put(" at t = ");
        if call.time_s < 0.0 {
            put("-");
        }
        let micros = (call.time_s.abs() * 1e6) as u64;
        put(decimal(micros / 1_000_000, 1, &mut room));
        put(".");
        put(decimal(micros % 1_000_000, 6, &mut room));
        put(" s");
    }
    if call.function == RUN {
        put(
            ".\n  help: --isolate keeps it in a process of its own: its crash is an error then, and the rows are complete; \
             --no-rollback runs an FMU that crashes while it saves its state\n",
        );
        return;
    }
    put(".\n  help: `isolate = true` in [");
    put(&names.instance);
    put("] keeps it in a process of its own: its crash is an error then, and the recording is closed");
    if names.module.ends_with(".fmu") {
        put("; `rollback = false` runs an FMU that crashes while it saves its state");
    }
    put("\n");
}

fn put(text: &str) {
    // SAFETY: a plain system call on bytes that are there. Bytes that cannot be written are lost.
    let _ = unsafe { libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len()) };
}

/// Digits of a number, at least so many, without allocating.
fn decimal(mut n: u64, least: usize, room: &mut [u8; 24]) -> &str {
    let mut at = room.len();
    while at > 0 && (n > 0 || room.len() - at < least) {
        at -= 1;
        room[at] = b'0' + (n % 10) as u8;
        n /= 10;
    }
    std::str::from_utf8(&room[at..]).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_noted_before_a_beginning_comes_back() {
        let outer = Names { instance: "robot".into(), module: "rigid-body".into() };
        note(&outer, "commit", 0.5);
        let function = || LAST.get().function;
        {
            let _instance = Beginning::of_instance("soil", Path::new("soil.so"));
            assert_eq!(function(), "instantiate");
            {
                let law = Beginning::of_file(Path::new("law.so"), "dlopen");
                law.goes_on("schema");
                assert_eq!(function(), "schema");
            }
            assert_eq!(function(), "instantiate");
        }
        assert_eq!(function(), "commit");
        forget(&outer);
        assert!(LAST.get().names.is_null());
    }

    #[test]
    fn numbers_without_an_allocation() {
        let mut room = [0; 24];
        assert_eq!(decimal(0, 1, &mut room), "0");
        assert_eq!(decimal(1200, 6, &mut room), "001200");
        assert_eq!(decimal(u64::MAX, 1, &mut room), "18446744073709551615");
    }
}
