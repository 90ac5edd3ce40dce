//! Ctrl-C, SIGTERM and SIGHUP: while inputs are loaded the first ends the program, as there is nothing to close yet; during a
//! run it asks the run to stop and close its recording, and the second ends the program at once.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;
use terraglue_host::exit_guard;

/// Exit code of a program that was interrupted.
const INTERRUPTED: i32 = 130;
/// How late a signal is noticed at most.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Whether a signal has asked for an end, and whether there is a run to close.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    asked: Arc<AtomicBool>,
    running: Arc<AtomicBool>,
}

impl Interrupt {
    /// Listens from now on.
    pub fn listen() -> Self {
        let own = Self::default();
        if let Err(e) = own.clone().wait_for_signals() {
            log::warn!("Ctrl-C will not close the recording: {e}");
        }
        own
    }

    /// Looks for signals on a thread of its own. It holds no descriptor: foreign code may close what it does not own.
    ///
    /// # Errors
    /// No handler can be set, or no thread be made.
    fn wait_for_signals(self) -> std::io::Result<()> {
        let arrived = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, Arc::clone(&arrived))?;
        }
        let (started, listening) = mpsc::channel();
        std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
            let _ = started.send(());
            loop {
                if arrived.swap(false, Ordering::Relaxed) {
                    self.signalled();
                }
                std::thread::sleep(LOOK_EVERY);
            }
        })?;
        // A thread that has not started yet cannot while a library is loaded: both need the lock of the loader.
        let _ = listening.recv();
        Ok(())
    }

    /// From now on there is a recording to close.
    pub fn run(&self) {
        self.running.store(true, Ordering::Relaxed);
    }

    /// The flag that stops a run; it is set by the first signal.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.asked)
    }

    fn signalled(&self) {
        if !self.running.load(Ordering::Relaxed) {
            eprintln!("stopped while loading; nothing was written");
            exit_guard::leave(INTERRUPTED);
        }
        if self.asked.swap(true, Ordering::Relaxed) {
            exit_guard::leave(INTERRUPTED);
        }
        eprintln!("stopping after this step; once more ends the program at once");
    }
}
