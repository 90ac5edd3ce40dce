//! The ground as triangles, for viewers that draw no height field: a message of the type `foxglove.SceneUpdate`.

use foxglove::Encode;
use foxglove::messages::{Color, Point3, SceneEntity, SceneUpdate, Timestamp, TriangleListPrimitive};
use terraglue_recording::TopicInfo;

/// Sinkage at which the colour is that of the deepest print, m.
const DEEP_M: f64 = 0.03;
const PLAIN: [f64; 3] = [0.741, 0.722, 0.682];
const SUNK: [f64; 3] = [0.545, 0.161, 0.361];

/// A rectangle of ground.
pub struct GroundMesh {
    /// Name of the rectangle: a later one of that name takes its place.
    pub name: String,
    /// Nodes along x; the others follow row by row.
    pub columns: usize,
    /// Place of each node in the world, m.
    pub points: Vec<[f64; 3]>,
    /// Sinkage of each node, m.
    pub sinkage: Vec<f64>,
}

/// How its topic is announced.
pub fn ground_mesh_topic(channel: u16, topic: &str) -> TopicInfo {
    let schema = SceneUpdate::get_schema();
    let (name, encoding, data) =
        schema.map(|s| (s.name, s.encoding, s.data.into_owned())).unwrap_or_default();
    TopicInfo {
        channel,
        topic: topic.into(),
        encoding: "protobuf".into(),
        schema: name,
        schema_encoding: encoding,
        schema_data: data,
        ..TopicInfo::default()
    }
}

/// A message of these rectangles.
pub fn ground_mesh(time_ns: u64, rectangles: Vec<GroundMesh>) -> Vec<u8> {
    let stamp = Timestamp::new((time_ns / 1_000_000_000) as u32, (time_ns % 1_000_000_000) as u32);
    let entity = |rectangle: GroundMesh| SceneEntity {
        timestamp: Some(stamp),
        frame_id: "world".into(),
        id: rectangle.name.clone(),
        triangles: vec![triangles(&rectangle)],
        ..SceneEntity::default()
    };
    let entities = rectangles.into_iter().map(entity).collect();
    let mut out = Vec::new();
    // a vector takes everything
    let _ = SceneUpdate { deletions: Vec::new(), entities }.encode(&mut out);
    out
}

fn triangles(rectangle: &GroundMesh) -> TriangleListPrimitive {
    let (nx, ny) = (rectangle.columns, rectangle.points.len() / rectangle.columns.max(1));
    let mut indices = Vec::with_capacity(6 * nx * ny);
    for j in 1..ny {
        for i in 1..nx {
            let [a, b] = [(j - 1) * nx + i - 1, j * nx + i - 1].map(|k| k as u32);
            indices.extend([a, a + 1, b + 1, a, b + 1, b]);
        }
    }
    let tint = |sinkage: &f64| {
        let share = (sinkage / DEEP_M).clamp(0.0, 1.0);
        let [r, g, b] = [0, 1, 2].map(|k| PLAIN[k] + share * (SUNK[k] - PLAIN[k]));
        Color { r, g, b, a: 1.0 }
    };
    TriangleListPrimitive {
        pose: Some(foxglove::messages::Pose {
            orientation: Some(foxglove::messages::Quaternion { w: 1.0, ..Default::default() }),
            position: Some(foxglove::messages::Vector3::default()),
        }),
        points: rectangle.points.iter().map(|p| Point3 { x: p[0], y: p[1], z: p[2] }).collect(),
        color: None,
        colors: rectangle.sinkage.iter().map(tint).collect(),
        indices,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use foxglove::Decode;

    #[test]
    fn two_triangles_stand_between_four_nodes() -> Result<(), Box<dyn std::error::Error>> {
        let points = vec![[0.0, 0.0, 0.1], [1.0, 0.0, 0.2], [0.0, 1.0, 0.3], [1.0, 1.0, 0.4]];
        let mesh = GroundMesh { name: "0_0".into(), columns: 2, points, sinkage: vec![0.0, 0.03, 1.0, -1.0] };
        let read = SceneUpdate::decode(&ground_mesh(1_500_000_000, vec![mesh])[..])?;
        let list = &read.entities[0].triangles[0];
        assert_eq!(list.indices, [0, 1, 3, 0, 3, 2]);
        assert_eq!((list.points.len(), list.colors.len()), (4, 4));
        assert_eq!(list.colors[0], list.colors[3], "heave has no colour of its own");
        assert_eq!(list.colors[1], list.colors[2]);
        Ok(())
    }
}
