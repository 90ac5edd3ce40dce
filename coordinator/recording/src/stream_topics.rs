//! Streams as topics: `/<subsystem>/<stream>`, with the schemas that viewers know by name.

use crate::topics::{self, STREAM, Topic};
use foxglove::messages::{
    CompressedImage, Grid, LaserScan, LocationFix, PointCloud, PoseInFrame, PosesInFrame, RawImage,
    SceneUpdate, VoxelGrid,
};
use std::collections::BTreeMap;
use terraglue_engine::observer::StreamView;
use terraglue_subsystem::StreamInfo;

/// The topic of a stream.
pub(crate) fn topic(stream: &StreamView) -> Topic {
    let (schema_encoding, schema_data) = schema(&stream.info);
    let (schema, encoding) = (stream.info.schema.clone(), stream.info.encoding.clone());
    let topic = name(&stream.name);
    let topic = Topic { topic, schema, schema_encoding, schema_data, encoding, metadata: BTreeMap::new() };
    topic.with(STREAM, stream.name.clone())
}

/// Name of the topic of a stream by its full name.
fn name(stream: &str) -> String {
    format!("/{}", stream.replace('.', "/"))
}

/// Encoding and bytes of the schema of a stream; both empty where nothing is known of it.
fn schema(info: &StreamInfo) -> (&'static str, Vec<u8>) {
    match info.encoding.as_str() {
        // viewers know the messages of JSON by the name of their schema
        "json" => ("jsonschema", br#"{"type":"object"}"#.to_vec()),
        "protobuf" => descriptor(&info.schema).map_or(("", Vec::new()), |bytes| ("protobuf", bytes)),
        _ => ("", Vec::new()),
    }
}

fn descriptor(schema: &str) -> Option<Vec<u8>> {
    let known = [
        topics::of::<PointCloud>(""),
        topics::of::<LaserScan>(""),
        topics::of::<RawImage>(""),
        topics::of::<CompressedImage>(""),
        topics::of::<Grid>(""),
        topics::of::<VoxelGrid>(""),
        topics::of::<PoseInFrame>(""),
        topics::of::<PosesInFrame>(""),
        topics::of::<SceneUpdate>(""),
        topics::of::<LocationFix>(""),
    ];
    known.into_iter().find(|topic| topic.schema == schema).map(|topic| topic.schema_data)
}
