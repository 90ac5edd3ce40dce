//! Ctrl-C, SIGTERM and SIGHUP: the first asks the run to stop and close its recording, the second ends the program at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use terraglue::host::exit_guard;

/// A flag that Ctrl-C sets.
pub fn cancel_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = Arc::clone(&flag);
    let installed = ctrlc::set_handler(move || {
        if shared.swap(true, Ordering::Relaxed) {
            exit_guard::leave(130);
        }
        eprintln!("stopping after this step; once more ends the program at once");
    });
    if let Err(e) = installed {
        eprintln!("Ctrl-C will not close the recording: {e}");
    }
    flag
}
