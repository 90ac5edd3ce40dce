//! Taps of a recorder: they receive topics and messages while a run goes on, the same bytes as in the file.

use crate::topics::Topic;
use mcap::records::MessageHeader;
use std::collections::BTreeMap;

/// A topic of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicInfo {
    /// Number of its channel.
    pub channel: u16,
    /// Its name, e.g. `/tf`.
    pub topic: String,
    /// Encoding of the messages: `protobuf`, or that of a stream.
    pub encoding: String,
    /// Name of the message type.
    pub schema: String,
    /// How the message type is described.
    pub schema_encoding: String,
    /// The description; of Protobuf a `FileDescriptorSet`.
    pub schema_data: Vec<u8>,
    /// Information that the type cannot hold.
    pub metadata: BTreeMap<String, String>,
}

impl TopicInfo {
    pub(crate) fn of(topic: &Topic) -> Self {
        let Topic { topic, schema, schema_encoding, schema_data, encoding, metadata } = topic;
        Self {
            channel: 0,
            topic: topic.clone(),
            encoding: encoding.clone(),
            schema: schema.clone(),
            schema_encoding: (*schema_encoding).into(),
            schema_data: schema_data.clone(),
            metadata: metadata.clone(),
        }
    }
}

/// Follows a recorder; all methods are called from the stepping thread, so they have to be short.
pub trait Tap: Send {
    /// A topic; its messages come later.
    fn announced(&mut self, topic: &TopicInfo);
    /// A message with its channel, running number and time (ns of simulated time).
    fn message(&mut self, header: &MessageHeader, data: &[u8]);
    /// A chunk has ended: all messages of the chunks before it are in the file.
    fn flushed(&mut self);
}
