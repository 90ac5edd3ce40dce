//! Shapes of the robot and of the world in its files that can be seen and hit, and the poses of its bodies.

use crate::closure::{Closure, ClosureLaw};
use crate::joint::{Joint, Kind};
use crate::math::{Q, V3};
use crate::model::{Body, Model};
use crate::motion::Motion;
use crate::variables;
use nalgebra::Isometry3;
use terraglue_robot_import::{Heights, Shape, ShapeGeometry};
use terraglue_subsystem::{
    BodyState, Geometry, JointKind, JointVariables, Material, Pose, Scene, SceneBody, SceneJoint, SceneShape,
};

/// Name of the body that carries the fixed shapes; `world'`, … where a robot has a body of that name.
const WORLD: &str = "world";
/// A height field is drawn with at most this many nodes along a side: it is for display only.
const DRAWN_NODES: usize = 129;

/// All bodies and shapes; ids count through the shapes.
///
/// Shapes that stand still in the world belong to one more body without mass behind all others. It is seen only: the
/// bodies of this subsystem hit it inside, and no other subsystem does.
pub(crate) fn scene(model: &Model) -> Scene {
    let mut bodies: Vec<SceneBody> =
        model.bodies.iter().map(|b| SceneBody { name: b.name.clone(), mass: b.mass }).collect();
    let mut shapes = Vec::new();
    let mut add = |body: usize, shape: &Shape, collides: bool| {
        shapes.push(SceneShape {
            id: shapes.len() as u32,
            body: body as u32,
            name: shape.name.clone(),
            geometry: geometry(&shape.geometry),
            body_from_shape: pose(&shape.body_from_shape),
            collides,
            material: Material::UNKNOWN,
        });
    };
    for (b, body) in model.bodies.iter().enumerate() {
        body.shapes.iter().for_each(|shape| add(b, shape, shape.collides));
    }
    model.world_shapes.iter().for_each(|shape| add(bodies.len(), shape, false));
    if !model.world_shapes.is_empty() {
        let mut name = WORLD.to_owned();
        while bodies.iter().any(|b| b.name == name) {
            name.push('\'');
        }
        bodies.push(SceneBody { name, mass: 0.0 });
    }
    let of_tree = model.joints.iter().enumerate();
    let tree = |(j, joint)| SceneJoint { variables: variables::of_joint(model, j), ..hinge(model, joint) };
    let mut joints: Vec<SceneJoint> = of_tree.map(tree).collect();
    joints.extend(model.closures.iter().filter_map(|c| closure(model, c)));
    if bodies.len() > model.bodies.len() {
        let mut still = SceneJoint { kind: JointKind::Fixed, ..held(WORLD, model.bodies.len()) };
        still.break_action.clear();
        while joints.iter().any(|j| j.name == still.name) {
            still.name.push('\'');
        }
        joints.push(still);
    }
    Scene { bodies, shapes, joints }
}

/// A joint that holds a body where it is.
fn held(name: &str, child: usize) -> SceneJoint {
    SceneJoint {
        name: name.into(),
        parent: SceneJoint::WORLD,
        child: child as u32,
        parent_from_joint: Pose::IDENTITY,
        axis: [0.0; 3],
        kind: JointKind::Closure,
        limits: [f64::NEG_INFINITY, f64::INFINITY],
        variables: JointVariables::ABSENT,
        break_action: format!("{name}.break"),
    }
}

/// A place on a body, relative to its centre of mass, or in the world.
fn place(model: &Model, body: Option<usize>, point: &V3, turn: Q) -> (u32, Pose) {
    let at = body.map_or(*point, |b| model.bodies[b].com + point);
    (body.map_or(SceneJoint::WORLD, |b| b as u32), pose(&Isometry3::from_parts(at.into(), turn)))
}

fn hinge(model: &Model, j: &Joint) -> SceneJoint {
    let (parent, parent_from_joint) = place(model, j.parent, &j.parent_anchor, j.parent_frame);
    let (kind, turns) = match j.kind {
        Kind::Revolute if j.limits.is_none() => (JointKind::Continuous, true),
        Kind::Revolute => (JointKind::Revolute, true),
        Kind::Prismatic => (JointKind::Prismatic, true),
        Kind::Cylindrical => (JointKind::Cylindrical, true),
        Kind::Universal => (JointKind::Universal, true),
        Kind::Planar => (JointKind::Planar, true),
        Kind::Spherical => (JointKind::Spherical, false),
        Kind::Fixed => (JointKind::Fixed, false),
    };
    let base = held(&j.name, j.child);
    let (axis, limits) = ([f64::from(u8::from(turns)), 0.0, 0.0], j.limits.unwrap_or(base.limits));
    SceneJoint { parent, parent_from_joint, kind, axis, limits, ..base }
}

/// A connection of two bodies; a coupling of two joints has no place.
fn closure(model: &Model, c: &Closure) -> Option<SceneJoint> {
    let (child, (parent, parent_from_joint), axis) = match &c.law {
        ClosureLaw::Joint(j) => {
            let joint = hinge(model, j);
            (j.child, (joint.parent, joint.parent_from_joint), joint.axis)
        }
        ClosureLaw::Rod(p, _) | ClosureLaw::Spring(p, _) => {
            (p.child, place(model, p.parent, &p.parent_point, Q::identity()), [0.0; 3])
        }
        ClosureLaw::Coupling { .. } => return None,
    };
    Some(SceneJoint { parent, parent_from_joint, axis, ..held(&c.name, child) })
}

/// A mesh that is not convex is passed on as it is: soil meets its triangles. Fixed shapes are only drawn.
fn geometry(g: &ShapeGeometry) -> Geometry {
    match g {
        ShapeGeometry::Sphere { radius } => Geometry::Sphere { radius: *radius },
        ShapeGeometry::Box { half_extents } => Geometry::Box { half_extents: *half_extents },
        ShapeGeometry::Cylinder { half_length, radius } => {
            Geometry::Cylinder { half_length: *half_length, radius: *radius }
        }
        ShapeGeometry::Capsule { half_length, radius } => {
            Geometry::Capsule { half_length: *half_length, radius: *radius }
        }
        ShapeGeometry::Hull(mesh) | ShapeGeometry::Concave { mesh, .. } | ShapeGeometry::Triangles(mesh) => {
            Geometry::ConvexMesh { points: mesh.points.clone(), triangles: mesh.triangles.clone() }
        }
        ShapeGeometry::Heights(heights) => surface(heights),
    }
}

/// The triangles of a height field seen from above; of a large one every so many nodes, the last ones always.
fn surface(h: &Heights) -> Geometry {
    let kept = |n: usize| -> Vec<usize> {
        let stride = (n - 1).div_ceil(DRAWN_NODES - 1).max(1);
        (0..n - 1).step_by(stride).chain([n - 1]).collect()
    };
    let [columns, rows] = h.nodes.map(kept);
    let place = |k: usize, axis: usize| h.lengths[axis] * (k as f64 / (h.nodes[axis] - 1) as f64 - 0.5);
    let row =
        |j: usize| columns.iter().map(move |i| [place(*i, 0), place(j, 1), h.heights[j * h.nodes[0] + i]]);
    let points = rows.iter().flat_map(|j| row(*j)).collect();
    let width = columns.len() as u32;
    let cell = |i: u32, j: u32| {
        let a = j * width + i;
        [[a, a + 1, a + width + 1], [a, a + width + 1, a + width]]
    };
    let triangles =
        (0..rows.len() as u32 - 1).flat_map(|j| (0..width - 1).flat_map(move |i| cell(i, j))).collect();
    Geometry::ConvexMesh { points, triangles }
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
