//! The topics of a recording: their names, message types, and the metadata that the types cannot hold.
//!
//! Poses, shapes, ground, forces and events are messages that robotics viewers know by name; the types of our own are
//! made when a run starts, of the names of its variables.

use crate::columns::{About, Columns};
use crate::{descriptor, gluing_message};
use foxglove::Encode;
use foxglove::messages::{PointCloud, SceneUpdate};
use std::collections::BTreeMap;

/// Key of a channel's metadata under which the columns stand.
pub(crate) const COLUMNS: &str = "columns";
/// Key of a channel's metadata: whose variables they are.
pub(crate) const SUBSYSTEM: &str = "subsystem";

/// Key of a channel's metadata: the full name of a stream.
pub const STREAM: &str = "stream";

/// A topic with the type of its messages.
pub(crate) struct Topic {
    pub topic: String,
    /// Name of the message type.
    pub schema: String,
    pub schema_encoding: &'static str,
    /// Of protobuf, its file of descriptors.
    pub schema_data: Vec<u8>,
    /// Of the messages.
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
}

impl Topic {
    /// Of protobuf, with the file of descriptors of the message type.
    fn protobuf(topic: String, schema: String, descriptor: Vec<u8>) -> Self {
        let (schema_encoding, encoding) = ("protobuf", "protobuf".into());
        Self { topic, schema, schema_encoding, schema_data: descriptor, encoding, metadata: BTreeMap::new() }
    }

    /// The same with one more line of metadata.
    pub fn with(mut self, key: &str, value: String) -> Self {
        self.metadata.insert(key.into(), value);
        self
    }
}

/// A topic of messages that viewers know.
pub(crate) fn of<M: Encode>(topic: &str) -> Topic {
    let (schema, descriptor) = M::get_schema().map(|s| (s.name, s.data.into_owned())).unwrap_or_default();
    Topic::protobuf(topic.into(), schema, descriptor)
}

/// `/scene`: the shapes of all bodies, fixed to the frames of `/tf`.
pub(crate) fn scene() -> Topic {
    of::<SceneUpdate>("/scene")
}

/// `/shapes/<subsystem>/<body>`: points on the surface of a body.
pub(crate) fn shape(frame: &str) -> Topic {
    of::<PointCloud>(&format!("/shapes/{frame}"))
}

/// A tile of ground.
pub(crate) fn tile(topic: &str) -> Topic {
    of::<PointCloud>(topic)
}

/// `/contact_forces`: arrows, this long.
pub(crate) fn forces(metres_per_newton: f64) -> Topic {
    of::<SceneUpdate>("/contact_forces").with("metres_per_newton", metres_per_newton.to_string())
}

/// `/contact_forces/points`: the same as rows of points.
pub(crate) fn force_points() -> Topic {
    of::<PointCloud>("/contact_forces/points")
}

/// `/gluing`: how the recorded step was glued.
pub(crate) fn gluing() -> Topic {
    Topic::protobuf("/gluing".into(), gluing_message::SCHEMA.into(), gluing_message::descriptor())
}

fn named(topic: String, package: &str, name: &str, columns: &Columns, about: &[About]) -> Topic {
    let text = serde_json::to_string(about).unwrap_or_default();
    let descriptor = columns.descriptor(package, name);
    Topic::protobuf(topic, format!("{package}.{name}"), descriptor).with(COLUMNS, text)
}

/// `/energy`: energies and works, J; the sum and each subsystem.
pub(crate) fn energy(columns: &Columns, about: &[About]) -> Topic {
    named("/energy".into(), "terraglue", "Energy", columns, about)
}

/// `/<subsystem>`: variables that move; `/<subsystem>/parameters`: those that are written when they change.
pub(crate) fn variables(subsystem: &str, parameters: bool, columns: &Columns, about: &[About]) -> Topic {
    let (tail, package) = match parameters {
        true => ("/parameters", "terraglue.Parameters"),
        false => ("", "terraglue.Variables"),
    };
    let name = descriptor::identifier(subsystem);
    named(format!("/{subsystem}{tail}"), package, &name, columns, about).with(SUBSYSTEM, subsystem.into())
}
