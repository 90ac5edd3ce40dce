//! Streams as topics: `/<subsystem>/<stream>`, with the schemas that viewers know by name.

use crate::topics;
use foxglove::messages::{
    CompressedImage, Grid, LaserScan, LocationFix, PointCloud, PoseInFrame, PosesInFrame, RawImage,
    SceneUpdate, VoxelGrid,
};
use terraglue_subsystem::StreamInfo;

/// Topic of a stream by its full name.
pub(crate) fn name(stream: &str) -> String {
    format!("/{}", stream.replace('.', "/"))
}

/// Encoding and bytes of the schema of a stream; both empty where nothing is known of it.
pub(crate) fn schema(info: &StreamInfo) -> (&'static str, Vec<u8>) {
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
    known.into_iter().find(|topic| topic.schema == schema).map(|topic| topic.descriptor)
}
