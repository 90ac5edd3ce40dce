//! The message of `/scene`: every body's shapes as primitives that viewers draw, locked to the body's frame.

use crate::observer::View;
use crate::recording::json::JsonBuffer;
use crate::recording::layout::nanoseconds;
use terraglue_subsystem::{Geometry, Pose, SceneShape};

/// `"subsystem/body"`, the frame of a body.
pub(crate) fn frame_id(json: &mut JsonBuffer, subsystem: &str, body: &str) {
    json.raw("\"");
    for part in [subsystem, "/", body] {
        // Names are identifiers as a rule; what JSON would escape is left out rather than misread.
        part.chars().filter(|c| !c.is_control() && *c != '"' && *c != '\\').for_each(|c| {
            json.raw(c.encode_utf8(&mut [0; 4]).as_bytes());
        });
    }
    json.raw("\"");
}

/// Writes the whole message.
pub(crate) fn write(json: &mut JsonBuffer, view: &View) {
    let now = nanoseconds(view.t_s);
    json.raw("{").key("deletions").raw("[]").key("entities").raw("[");
    for s in view.subsystems {
        for (k, body) in s.scene.bodies.iter().enumerate() {
            let shapes = || s.scene.shapes.iter().filter(|shape| shape.body as usize == k);
            json.element().raw("{").timestamp(now);
            frame_id(json.key("frame_id"), s.name, &body.name);
            frame_id(json.key("id"), s.name, &body.name);
            json.key("lifetime").raw(r#"{"sec":0,"nsec":0}"#).key("frame_locked").boolean(true);
            json.key("metadata").raw("[]").key("arrows").raw("[]");
            solids(json, "cubes", shapes().flat_map(cubes));
            solids(json, "spheres", shapes().flat_map(spheres));
            solids(json, "cylinders", shapes().flat_map(cylinders));
            json.key("lines").raw("[]").key("triangles").raw("[");
            shapes().for_each(|shape| mesh(json, shape));
            json.raw("]").key("texts").raw("[]").key("models").raw("[]}");
        }
    }
    json.raw("]}");
}

/// A primitive with full lengths along its axes, m.
struct Solid {
    pose: Pose,
    size: [f64; 3],
    collides: bool,
    cylinder: bool,
}

fn solid(shape: &SceneShape, pose: Pose, size: [f64; 3], cylinder: bool) -> Solid {
    Solid { pose, size, collides: shape.collides, cylinder }
}

fn cubes(shape: &SceneShape) -> Option<Solid> {
    match &shape.geometry {
        Geometry::Box { half_extents } => {
            Some(solid(shape, shape.body_from_shape, half_extents.map(|h| 2.0 * h), false))
        }
        _ => None,
    }
}

fn spheres(shape: &SceneShape) -> Vec<Solid> {
    match shape.geometry {
        Geometry::Sphere { radius } => vec![solid(shape, shape.body_from_shape, [2.0 * radius; 3], false)],
        Geometry::Capsule { half_length, radius } => [-half_length, half_length]
            .map(|z| solid(shape, shifted(&shape.body_from_shape, z), [2.0 * radius; 3], false))
            .into(),
        _ => Vec::new(),
    }
}

fn cylinders(shape: &SceneShape) -> Option<Solid> {
    match shape.geometry {
        Geometry::Cylinder { half_length, radius } | Geometry::Capsule { half_length, radius } => {
            let size = [2.0 * radius, 2.0 * radius, 2.0 * half_length];
            Some(solid(shape, shape.body_from_shape, size, true))
        }
        _ => None,
    }
}

/// The pose moved along its own z axis: third column of the rotation matrix of the quaternion w, x, y, z.
fn shifted(pose: &Pose, along_z: f64) -> Pose {
    let [w, x, y, z] = pose.orientation;
    let axis = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
    let mut moved = *pose;
    moved.position.iter_mut().zip(axis).for_each(|(p, a)| *p += along_z * a);
    moved
}

fn color(json: &mut JsonBuffer, collides: bool) {
    let [r, g, b] = if collides { [0.86, 0.55, 0.20] } else { [0.62, 0.65, 0.70] };
    json.key("color").raw("{").field("r", r).field("g", g).field("b", b).field("a", 1.0).raw("}");
}

fn pose(json: &mut JsonBuffer, pose: &Pose) {
    json.key("pose").raw("{").vector("position", &pose.position);
    json.quaternion("orientation", &pose.orientation).raw("}");
}

fn solids(json: &mut JsonBuffer, key: &str, solids: impl Iterator<Item = Solid>) {
    json.key(key).raw("[");
    for s in solids {
        json.element().raw("{");
        pose(json, &s.pose);
        json.vector("size", &s.size);
        if s.cylinder {
            json.field("bottom_scale", 1.0).field("top_scale", 1.0);
        }
        color(json, s.collides);
        json.raw("}");
    }
    json.raw("]");
}

fn mesh(json: &mut JsonBuffer, shape: &SceneShape) {
    let Geometry::ConvexMesh { points, triangles } = &shape.geometry else { return };
    json.element().raw("{");
    pose(json, &shape.body_from_shape);
    json.key("points").raw("[");
    for p in points {
        json.element().raw("{").field("x", p[0]).field("y", p[1]).field("z", p[2]).raw("}");
    }
    json.raw("]").key("indices").raw("[");
    triangles.iter().flatten().for_each(|i| {
        json.element().integer(i);
    });
    json.raw("]").key("colors").raw("[]");
    color(json, shape.collides);
    json.raw("}");
}
