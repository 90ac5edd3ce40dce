//! Streams: output of a subsystem that is no variable, such as point clouds, images and maps.
//!
//! A stream can feed an input of the type [`crate::ValueType::Binary`] of another subsystem: each message is one
//! [`crate::Subsystem::set`] at the start of the step after the one that made it.

/// A stream of messages of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamInfo {
    /// Dotted name, unique in the subsystem and different from its variables.
    pub name: String,
    /// Name of the schema of its messages, e.g. `foxglove.PointCloud`.
    pub schema: String,
    /// Encoding of messages: `protobuf`, `json`, or another name that its readers know.
    pub encoding: String,
    /// Most messages per second, 1/s; 0: whenever something happens.
    pub rate_hz: f64,
    /// Most bytes of a message. Longer ones are dropped with a warning.
    pub most_bytes: u32,
    /// One line for people.
    pub help: String,
}

/// A message of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Message<'a> {
    /// Time of its content, s.
    pub time: f64,
    /// Its bytes, in the encoding of its stream.
    pub bytes: &'a [u8],
}
