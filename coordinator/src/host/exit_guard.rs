//! No foreign code ends the program with success: `exit(0)` inside a module or unit is a failure of the run.
#![allow(unsafe_code)] // Registers a function that the C library calls at `exit`.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static ARMED: AtomicBool = AtomicBool::new(false);
static REGISTERED: Once = Once::new();

/// While this lives, an `exit` of the process is an error.
#[derive(Debug)]
pub struct Armed(());

impl Drop for Armed {
    fn drop(&mut self) {
        ARMED.store(false, Ordering::SeqCst);
    }
}

/// From here on until the answer is dropped an `exit` of the process is an error, with exit code 1.
#[must_use]
pub fn arm() -> Armed {
    ARMED.store(true, Ordering::SeqCst);
    REGISTERED.call_once(|| {
        // SAFETY: the function takes nothing and never unwinds. Without room for it the run is merely less guarded.
        let _ = unsafe { libc::atexit(at_exit) };
    });
    Armed(())
}

extern "C" fn at_exit() {
    if !ARMED.load(Ordering::SeqCst) {
        return;
    }
    let text =
        b"error: a module or unit ended the program in the middle of the run; `isolate = true` names it\n";
    // SAFETY: plain system calls; the process ends here.
    unsafe {
        libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len());
        libc::_exit(1);
    }
}
