//! The worker's end of the shared segment: it waits for calls, and asks the host while it answers one.

use super::calls;
use super::channel::Segment;
use super::wire::Writer;
use std::cell::{Cell, RefCell};
use std::sync::atomic::{AtomicBool, Ordering};

/// The shared segment, and the number of the last call.
pub struct WorkerChannel {
    pub segment: RefCell<Segment>,
    last: Cell<u32>,
}

impl WorkerChannel {
    /// Over a segment that is open.
    pub fn new(segment: Segment) -> Self {
        Self { segment: RefCell::new(segment), last: Cell::new(0) }
    }

    /// Waits for the next call.
    pub fn next(&self, cancel: &AtomicBool) -> Vec<u8> {
        let mut segment = self.segment.borrow_mut();
        let (number, length) = segment.call_after(self.last.get());
        self.last.set(number);
        cancel.store(segment.cancel_flag().load(Ordering::Relaxed) != 0, Ordering::Relaxed);
        segment.area(0)[..length].to_vec()
    }

    /// Asks the host while it waits for the answer to a call; returns its answer. None: the question is too long.
    pub fn ask(&self, write: impl FnOnce(&mut Writer)) -> Option<Vec<u8>> {
        {
            let mut segment = self.segment.borrow_mut();
            let mut w = Writer::new(segment.area(1));
            calls::write_outcome(&mut w, &[], &Ok(()));
            write(&mut w);
            let length = w.length()?;
            segment.post_answer(length);
        }
        Some(self.next(&AtomicBool::new(false)))
    }
}
