//! The message of `/scene`: every body's shapes as primitives that viewers draw, locked to the body's frame.

use crate::layout::timestamp;
use crate::visibility::Visibility;
use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, Duration, Point3, Pose, Quaternion, SceneEntity, SceneUpdate,
    SpherePrimitive, TriangleListPrimitive, Vector3,
};
use terraglue_engine::observer::View;
use terraglue_subsystem::{Geometry, Pose as OwnPose, SceneShape};

/// `subsystem/body`, the frame of a body.
pub(crate) fn frame_id(subsystem: &str, body: &str) -> String {
    format!("{subsystem}/{body}")
}

/// A vector as viewers write it.
pub(crate) fn vector(v: [f64; 3]) -> Vector3 {
    Vector3 { x: v[0], y: v[1], z: v[2] }
}

/// A quaternion w, x, y, z as viewers write it.
pub(crate) fn quaternion(q: [f64; 4]) -> Quaternion {
    Quaternion { x: q[1], y: q[2], z: q[3], w: q[0] }
}

/// The rotation w, x, y, z that turns the x axis along a vector.
pub(crate) fn along(v: [f64; 3], length: f64) -> [f64; 4] {
    let [x, y, z] = v.map(|c| c / length);
    let w = 1.0 + x;
    if w < 1e-9 {
        return [0.0, 0.0, 0.0, 1.0];
    }
    // Half the angle about x × v = (0, −z, y).
    let norm = (w * w + y * y + z * z).sqrt();
    [w / norm, 0.0, -z / norm, y / norm]
}

/// A pose as viewers write it.
pub(crate) fn pose(pose: &OwnPose) -> Option<Pose> {
    let (position, orientation) = (vector(pose.position), quaternion(pose.orientation));
    Some(Pose { position: Some(position), orientation: Some(orientation) })
}

/// The shown shapes of all bodies.
pub(crate) fn scene(view: &View, visibility: &Visibility) -> SceneUpdate {
    let subsystems = view.subsystems.iter().enumerate();
    let all = subsystems.flat_map(|(s, of)| (0..of.scene.bodies.len()).map(move |body| (s, body)));
    bodies(view, visibility, all)
}

/// The shown shapes of bodies, by the numbers of their subsystems and their own; they replace those before.
pub(crate) fn bodies(
    view: &View,
    visibility: &Visibility,
    which: impl Iterator<Item = (usize, usize)>,
) -> SceneUpdate {
    let entity = |(subsystem, body): (usize, usize)| {
        let s = &view.subsystems[subsystem];
        let all = s.scene.shapes.iter().enumerate();
        let own = all.filter(|(k, shape)| shape.body as usize == body && visibility.shows(subsystem, *k));
        let shapes: Vec<&SceneShape> = own.map(|(_, shape)| shape).collect();
        let id = frame_id(s.name, &s.scene.bodies[body].name);
        SceneEntity {
            timestamp: Some(timestamp(view.t_s)),
            frame_id: id.clone(),
            id,
            lifetime: Some(Duration::new(0, 0)),
            frame_locked: true,
            cubes: shapes.iter().filter_map(|s| cube(s)).collect(),
            spheres: shapes.iter().flat_map(|s| spheres(s)).collect(),
            cylinders: shapes.iter().filter_map(|s| cylinder(s)).collect(),
            triangles: shapes.iter().filter_map(|s| mesh(s)).collect(),
            ..SceneEntity::default()
        }
    };
    SceneUpdate { deletions: Vec::new(), entities: which.map(entity).collect() }
}

/// Red, green, blue of a shape: what touches the ground stands out.
pub(crate) fn rgb(shape: &SceneShape) -> [f64; 3] {
    if shape.collides { [0.86, 0.55, 0.20] } else { [0.62, 0.65, 0.70] }
}

fn color(shape: &SceneShape) -> Option<Color> {
    let [r, g, b] = rgb(shape);
    Some(Color { r, g, b, a: 1.0 })
}

fn cube(shape: &SceneShape) -> Option<CubePrimitive> {
    let Geometry::Box { half_extents } = &shape.geometry else { return None };
    let size = Some(vector(half_extents.map(|h| 2.0 * h)));
    Some(CubePrimitive { pose: pose(&shape.body_from_shape), size, color: color(shape) })
}

fn spheres(shape: &SceneShape) -> Vec<SpherePrimitive> {
    let stretched = |at: &OwnPose, half: [f64; 3]| SpherePrimitive {
        pose: pose(at),
        size: Some(vector(half.map(|h| 2.0 * h))),
        color: color(shape),
    };
    let sphere = |at: &OwnPose, radius: f64| stretched(at, [radius; 3]);
    match shape.geometry {
        Geometry::Sphere { radius } => vec![sphere(&shape.body_from_shape, radius)],
        Geometry::Ellipsoid { semi_axes } => vec![stretched(&shape.body_from_shape, semi_axes)],
        Geometry::Capsule { half_length, radius } => {
            [-half_length, half_length].map(|z| sphere(&shifted(&shape.body_from_shape, z), radius)).into()
        }
        _ => Vec::new(),
    }
}

fn cylinder(shape: &SceneShape) -> Option<CylinderPrimitive> {
    let (half_length, [bottom, top]) = match shape.geometry {
        Geometry::Cylinder { half_length, radius } | Geometry::Capsule { half_length, radius } => {
            (half_length, [radius; 2])
        }
        Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
            (half_length, [radius_bottom, radius_top])
        }
        _ => return None,
    };
    let radius = bottom.max(top);
    // of a frustum without any width nothing is drawn but its axis
    let scale = |end: f64| if radius > 0.0 { end / radius } else { 1.0 };
    Some(CylinderPrimitive {
        pose: pose(&shape.body_from_shape),
        size: Some(vector([2.0 * radius, 2.0 * radius, 2.0 * half_length])),
        bottom_scale: scale(bottom),
        top_scale: scale(top),
        color: color(shape),
    })
}

/// The pose moved along its own z axis: third column of the rotation matrix of the quaternion w, x, y, z.
fn shifted(pose: &OwnPose, along_z: f64) -> OwnPose {
    let [w, x, y, z] = pose.orientation;
    let axis = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
    let mut moved = *pose;
    moved.position.iter_mut().zip(axis).for_each(|(p, a)| *p += along_z * a);
    moved
}

fn mesh(shape: &SceneShape) -> Option<TriangleListPrimitive> {
    let (Geometry::ConvexMesh { points, triangles } | Geometry::Mesh { points, triangles }) = &shape.geometry
    else {
        return None;
    };
    Some(TriangleListPrimitive {
        pose: pose(&shape.body_from_shape),
        points: points.iter().map(|p| Point3 { x: p[0], y: p[1], z: p[2] }).collect(),
        color: color(shape),
        colors: Vec::new(),
        indices: triangles.iter().flatten().copied().collect(),
    })
}
