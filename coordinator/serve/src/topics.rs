//! Topics of our own, beside those of the recording: latched JSON for information that the protocol cannot hold.

use crate::ground_mesh::ground_mesh_topic;
use terraglue_recording::TopicInfo;

/// `/run`: state of the run.
pub const RUN: u16 = 65_001;
/// `/variables`: all variables with unit, range, help and effect.
pub const VARIABLES: u16 = 65_002;
/// `/actions`: all actions.
pub const ACTIONS: u16 = 65_003;
/// `/channels`: metadata of the topics.
pub const CHANNELS: u16 = 65_004;
/// `/changed`: what clients have changed.
pub const CHANGED: u16 = 65_005;
/// `/ground/tiles`: the ground as the page draws it.
pub const TILES: u16 = 65_006;

/// `/ground/mesh`: the ground as triangles, for other viewers.
pub const MESH: u16 = 65_007;

/// A topic of our own: number, name, encoding, name of the message type.
pub struct OwnTopic(u16, &'static str, &'static str, &'static str);

/// All of them.
pub const OWN_TOPICS: [OwnTopic; 7] = [
    OwnTopic(RUN, "/run", "json", "terraglue.Run"),
    OwnTopic(VARIABLES, "/variables", "json", "terraglue.VariableList"),
    OwnTopic(ACTIONS, "/actions", "json", "terraglue.ActionList"),
    OwnTopic(CHANNELS, "/channels", "json", "terraglue.Channels"),
    OwnTopic(CHANGED, "/changed", "json", "terraglue.Changes"),
    OwnTopic(TILES, "/ground/tiles", "terraglue.tiles", "terraglue.Tiles"),
    OwnTopic(MESH, "/ground/mesh", "protobuf", "foxglove.SceneUpdate"),
];

/// Whether a topic is one of our own.
pub fn is_own(topic: &str) -> bool {
    OWN_TOPICS.iter().any(|OwnTopic(_, own, ..)| *own == topic)
}

/// As it is announced.
pub fn info(OwnTopic(channel, topic, encoding, schema): &OwnTopic) -> TopicInfo {
    if *channel == MESH {
        return ground_mesh_topic(MESH, topic);
    }
    TopicInfo {
        channel: *channel,
        topic: (*topic).into(),
        encoding: (*encoding).into(),
        schema: (*schema).into(),
        ..TopicInfo::default()
    }
}
