//! What of the robot can be seen and hit, and where its bodies are.

use crate::math::V3;
use crate::model::{Body, Model};
use crate::state::Motion;
use nalgebra::Isometry3;
use terraglue_robot_import::ShapeGeometry;
use terraglue_subsystem::{BodyState, Geometry, Pose, Scene, SceneBody, SceneShape};

/// All bodies and shapes; ids count through the shapes.
pub(crate) fn scene(model: &Model) -> Scene {
    let bodies = model.bodies.iter().map(|b| SceneBody { name: b.name.clone(), mass: b.mass }).collect();
    let all = model.bodies.iter().enumerate().flat_map(|(b, body)| body.shapes.iter().map(move |s| (b, s)));
    let shapes = all
        .enumerate()
        .filter_map(|(id, (body, shape))| {
            Some(SceneShape {
                id: id as u32,
                body: body as u32,
                name: shape.name.clone(),
                geometry: geometry(&shape.geometry)?,
                body_from_shape: pose(&shape.body_from_shape),
                collides: shape.collides,
            })
        })
        .collect();
    Scene { bodies, shapes }
}

/// Shapes of bodies are convex; ground of triangles is no body's.
fn geometry(g: &ShapeGeometry) -> Option<Geometry> {
    Some(match g {
        ShapeGeometry::Sphere { radius } => Geometry::Sphere { radius: *radius },
        ShapeGeometry::Box { half_extents } => Geometry::Box { half_extents: *half_extents },
        ShapeGeometry::Cylinder { half_length, radius } => {
            Geometry::Cylinder { half_length: *half_length, radius: *radius }
        }
        ShapeGeometry::Capsule { half_length, radius } => {
            Geometry::Capsule { half_length: *half_length, radius: *radius }
        }
        ShapeGeometry::Hull(mesh) => {
            Geometry::ConvexMesh { points: mesh.points.clone(), triangles: mesh.triangles.clone() }
        }
        ShapeGeometry::Triangles(_) | ShapeGeometry::Heights(_) => return None,
    })
}

fn pose(iso: &Isometry3<f64>) -> Pose {
    let q = iso.rotation;
    Pose { position: iso.translation.vector.into(), orientation: [q.w, q.i, q.j, q.k] }
}

/// State of a body's frame from the motion of its centre of mass.
pub(crate) fn body_state(body: &Body, m: &Motion) -> BodyState {
    let arm: V3 = m.q * body.com;
    BodyState {
        world_from_body: Pose { position: (m.c - arm).into(), orientation: [m.q.w, m.q.i, m.q.j, m.q.k] },
        linear_velocity: (m.v - m.w.cross(&arm)).into(),
        angular_velocity: m.w.into(),
    }
}
