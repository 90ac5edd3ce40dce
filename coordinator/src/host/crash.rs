//! A crash inside a module that is not isolated: standard error tells which one was called before the process ends as it would have.
//!
//! What is called is noted with four words of the thread; the handler reads them and calls nothing but `write`.
#![allow(unsafe_code)] // Signal handlers, and what they may read.

use std::cell::Cell;
use std::ptr;
use std::sync::Once;

/// Signals of a crash, with their names.
const CRASHES: [(libc::c_int, &str); 4] = [
    (libc::SIGSEGV, "segmentation fault"),
    (libc::SIGBUS, "bus error"),
    (libc::SIGFPE, "arithmetic"),
    (libc::SIGILL, "illegal instruction"),
];

/// Names that a message holds. Their place in memory stays as long as an instance lives.
#[derive(Debug)]
pub(super) struct Names {
    pub instance: String,
    pub module: String,
}

/// The last call of a thread.
#[derive(Clone, Copy)]
struct Call {
    names: *const Names,
    function: &'static str,
    time_s: f64,
}

const NONE: Call = Call { names: ptr::null(), function: "", time_s: 0.0 };

thread_local! {
    static LAST: Cell<Call> = const { Cell::new(NONE) };
}

/// Notes that a function of an instance is called at a time, s.
#[inline]
pub(super) fn note(names: &Names, function: &'static str, time_s: f64) {
    LAST.set(Call { names, function, time_s });
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

/// From here on a crash is told. Who handled it before does so afterwards: an overflow of the stack is told by the runtime.
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

fn report(index: usize, names: &Names, call: &Call) {
    let (signal, words) = CRASHES[index];
    let mut room = [0; 24];
    put("\nerror: a module or unit crashed: signal ");
    put(decimal(signal.unsigned_abs().into(), 1, &mut room));
    put(" (");
    put(words);
    put("); the last call was `");
    put(call.function);
    put("` of `");
    put(&names.instance);
    put("` (");
    put(&names.module);
    put(") at t = ");
    if call.time_s < 0.0 {
        put("-");
    }
    let micros = (call.time_s.abs() * 1e6) as u64;
    put(decimal(micros / 1_000_000, 1, &mut room));
    put(".");
    put(decimal(micros % 1_000_000, 6, &mut room));
    put(" s.\n  help: `isolate = true` in [");
    put(&names.instance);
    put("] keeps it in a process of its own: its crash is an error then, and the recording is closed\n");
}

fn put(text: &str) {
    // SAFETY: a plain system call on bytes that are there. What cannot be written is lost.
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
    fn numbers_without_an_allocation() {
        let mut room = [0; 24];
        assert_eq!(decimal(0, 1, &mut room), "0");
        assert_eq!(decimal(1200, 6, &mut room), "001200");
        assert_eq!(decimal(u64::MAX, 1, &mut room), "18446744073709551615");
    }
}
