//! Messages of a recorder on their way to clients: kept until the file has them, and handed to all listeners.

use crate::hub::{Hub, Out};
use crate::tail::Tail;
use mcap::records::MessageHeader;
use std::sync::Arc;
use terraglue_recording::{Stored, Tap, TopicInfo};

/// The tap of a recorder.
pub struct Feed {
    hub: Arc<Hub>,
}

impl Feed {
    /// Feeds a hub.
    pub fn new(hub: Arc<Hub>) -> Self {
        Self { hub }
    }
}

impl Tap for Feed {
    fn announced(&mut self, topic: &TopicInfo) {
        self.hub.announce(topic.clone());
    }

    fn message(&mut self, header: &MessageHeader, data: &[u8]) {
        let message = Arc::new(Stored {
            channel: header.channel_id,
            sequence: header.sequence,
            time_ns: header.log_time,
            data: data.to_vec(),
        });
        self.hub.with_tail(|tail| tail.push(Arc::clone(&message)));
        self.hub.remember(&message);
        self.hub.send(Out::Message(message));
    }

    fn flushed(&mut self) {
        self.hub.with_tail(Tail::end_chunk);
    }
}
