//! No foreign code ends the program with success: `exit(0)` and `_exit(0)` inside a module or FMU are failures of the run, and
//! its recording is closed first.
#![allow(unsafe_code)] // Registers a function that the C library calls at `exit`.

use super::descendants;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, Once, PoisonError};

static ARMED: AtomicBool = AtomicBool::new(false);
/// The process that is guarded: what it forks ends as it likes.
static PROCESS: AtomicU32 = AtomicU32::new(0);
static REGISTERED: Once = Once::new();
static EXIT_HOOKS: Mutex<BTreeMap<u64, Work>> = Mutex::new(BTreeMap::new());
static NEXT: AtomicU64 = AtomicU64::new(0);

unsafe extern "C" {
    /// C11, 7.22.4.3.
    fn at_quick_exit(work: extern "C" fn()) -> libc::c_int;
}

/// Work that is done before the process ends.
type Work = Box<dyn FnOnce() + Send>;

/// While this lives, an `exit` of the process is an error.
#[derive(Debug)]
pub struct Armed(());

impl Drop for Armed {
    fn drop(&mut self) {
        ARMED.store(false, Ordering::SeqCst);
    }
}

/// While this lives, its work is done before foreign code ends the process.
#[derive(Debug)]
pub struct ExitHook(u64);

impl Drop for ExitHook {
    fn drop(&mut self) {
        EXIT_HOOKS.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.0);
    }
}

/// From here on until the answer is dropped an `exit` of the process is an error, with exit code 1.
#[must_use]
pub fn arm() -> Armed {
    PROCESS.store(std::process::id(), Ordering::SeqCst);
    ARMED.store(true, Ordering::SeqCst);
    REGISTERED.call_once(|| {
        // SAFETY: the function takes nothing and never unwinds. Without room for it the run is merely less guarded.
        let _ = unsafe { libc::atexit(at_exit) };
        // SAFETY: nothing is called on this signal: a file that the shell's limit ends is an error of the write then.
        let _ = unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
        // SAFETY: the same for the other way to leave in good order.
        let _ = unsafe { at_quick_exit(at_exit) };
    });
    Armed(())
}

/// Leaves `work` to be done when foreign code ends the process. It reports the error; it must not wait for anything that a
/// thread may hold.
#[must_use]
pub fn add_exit_hook(work: impl FnOnce() + Send + 'static) -> ExitHook {
    let id = NEXT.fetch_add(1, Ordering::Relaxed);
    EXIT_HOOKS.lock().unwrap_or_else(PoisonError::into_inner).insert(id, Box::new(work));
    ExitHook(id)
}

/// Ends the program by its own choice, at once: what libraries do at `exit` would wait for one that is being loaded.
pub fn leave(code: i32) -> ! {
    ARMED.store(false, Ordering::SeqCst);
    terraglue_fmi::remove_folders();
    descendants::end_all();
    end(code)
}

/// The system call itself.
fn end(code: i32) -> ! {
    loop {
        // SAFETY: a plain system call; the process ends here.
        unsafe { libc::syscall(libc::SYS_exit_group, code) };
    }
}

/// `_exit` in this program: a module or FMU that calls it finds this one first where the program exports its name, and ends the
/// run as an error instead of with success and without a word.
#[unsafe(no_mangle)]
pub extern "C" fn _exit(code: libc::c_int) -> ! {
    at_exit();
    end(code)
}

/// The same by its name in C.
#[unsafe(no_mangle)]
pub extern "C" fn _Exit(code: libc::c_int) -> ! {
    _exit(code)
}

extern "C" fn at_exit() {
    // a process that a module or FMU has forked is not the run
    if PROCESS.load(Ordering::SeqCst) != std::process::id() {
        return;
    }
    if !ARMED.swap(false, Ordering::SeqCst) {
        return;
    }
    // the thread that calls this may hold the hooks, but only between two of them
    let hooks = EXIT_HOOKS.try_lock().map(|mut all| std::mem::take(&mut *all)).unwrap_or_default();
    let told = !hooks.is_empty();
    for (_, work) in hooks {
        // what cannot be done any more is left
        drop(catch_unwind(AssertUnwindSafe(work)));
    }
    let _ = catch_unwind(|| {
        terraglue_fmi::remove_folders();
        descendants::end_all();
    });
    let text = b"error: a module or FMU ended the program; `isolate = true` names it\n";
    if !told {
        // SAFETY: a plain system call with a text that lives for ever.
        unsafe { libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len()) };
    }
    end(1)
}
