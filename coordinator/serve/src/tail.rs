//! Messages that the file of a recording may not have yet.

use std::collections::VecDeque;
use std::sync::Arc;
use terraglue_recording::Stored;

/// Chunks whose messages are kept beside the file: the open one, the one that is written, and the one whose index may not be whole.
const KEPT: usize = 3;

/// Messages that the file may not have yet, chunk by chunk.
#[derive(Default)]
pub struct Tail {
    chunks: VecDeque<Vec<Arc<Stored>>>,
}

impl Tail {
    /// Takes a message.
    pub fn push(&mut self, message: Arc<Stored>) {
        if self.chunks.is_empty() {
            self.chunks.push_back(Vec::new());
        }
        if let Some(open) = self.chunks.back_mut() {
            open.push(message);
        }
    }

    /// The open chunk has ended.
    pub fn end_chunk(&mut self) {
        self.chunks.push_back(Vec::new());
        while self.chunks.len() > KEPT {
            self.chunks.pop_front();
        }
    }

    /// All messages in their order.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &Arc<Stored>> {
        self.chunks.iter().flatten()
    }
}
