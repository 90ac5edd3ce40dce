//! `run --realtime`: holds a run back to the pace of a clock; the results are the same.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use terraglue_diagnostics::Result;
use terraglue_engine::observer::{Event, Observer, View};

/// Longest sleep before a signal is looked for.
const LOOK: Duration = Duration::from_millis(50);

/// Holds back what follows it.
pub struct Pace<'a> {
    then: &'a mut dyn Observer,
    /// When the first step was done, and its time, s.
    since: Option<(Instant, f64)>,
    cancel: Arc<AtomicBool>,
}

impl<'a> Pace<'a> {
    /// Passes all on to `then`; `cancel` ends the waiting.
    pub fn new(then: &'a mut dyn Observer, cancel: Arc<AtomicBool>) -> Self {
        Self { then, since: None, cancel }
    }
}

impl Observer for Pace<'_> {
    fn stepped(&mut self, view: &View) -> Result {
        let (start, from_s) = *self.since.get_or_insert((Instant::now(), view.t_s));
        let due = Duration::try_from_secs_f64(view.t_s - from_s).unwrap_or_default();
        while let Some(left) = due.checked_sub(start.elapsed()).filter(|left| !left.is_zero()) {
            if self.cancel.load(Ordering::Relaxed) {
                break;
            }
            std::thread::sleep(left.min(LOOK));
        }
        self.then.stepped(view)
    }

    fn event(&mut self, event: &Event) -> Result {
        self.then.event(event)
    }
}
