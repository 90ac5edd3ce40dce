//! Shapes that can be hit, and which of them are one piece.

use crate::contact::Now;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::{Pose as ParryPose, Rot3, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::SharedShape;
use std::ops::Range;
use terraglue_ground::{Aabb as Bounding, Placed};
use terraglue_numerics::rotation::length;
use terraglue_subsystem::{BodyState, Geometry, Pose, Scene, SceneShape};

/// Shapes of a body that come nearer to each other than this (m) are one piece.
const JOINED: f64 = 1e-4;

/// A shape that can be hit.
pub struct Shape {
    pub id: u32,
    pub body: u32,
    pub name: String,
    pub body_from_shape: Pose,
    pub placed: Placed,
    /// Its box in the world at the start of the step.
    pub bounds: Bounding,
    /// Radius of its box in the body, m.
    pub size: f64,
}

impl Shape {
    fn of(s: &SceneShape) -> Self {
        let placed = Placed::new(&s.geometry, &s.body_from_shape);
        let bounds = placed.aabb();
        Self {
            id: s.id,
            body: s.body,
            name: s.name.clone(),
            body_from_shape: s.body_from_shape,
            size: bounds.radius(),
            bounds,
            placed,
        }
    }

    /// Largest distance of any point of the shape within the step, and the margin: |v|h + ½|g|h² + margin.
    pub fn reach(&self, now: &Now, state: &BodyState) -> f64 {
        let bounds = &self.bounds;
        let c = bounds.centre();
        let r: [f64; 3] = std::array::from_fn(|k| c[k] - state.world_from_body.position[k]);
        let (v, w) = (state.linear_velocity, state.angular_velocity);
        let at_centre = [
            v[0] + w[1] * r[2] - w[2] * r[1],
            v[1] + w[2] * r[0] - w[0] * r[2],
            v[2] + w[0] * r[1] - w[1] * r[0],
        ];
        let speed = length(at_centre) + length(w) * bounds.radius();
        speed * now.h + 0.5 * length(now.gravity) * now.h * now.h + now.margin
    }

    /// Its box enlarged by `reach`, sideways not beyond what lies under it.
    pub fn swept(&self, reach: f64) -> Aabb {
        let bounds = &self.bounds;
        let [x0, y0, z0] = bounds.min;
        let [x1, y1, z1] = bounds.max;
        // A height field hit along its normal is hit vertically within five times that (slopes up to 78°).
        Aabb::new(Vector::new(x0, y0, z0 - 5.0 * reach), Vector::new(x1, y1, z1))
    }
}

/// The shapes that can be hit, those of one piece one after the other, pieces in ascending order of their first ids; and
/// the range of each piece.
///
/// A piece is what hangs together: shapes of one body that touch or overlap, directly or through others.
pub fn pieces_of(scene: &Scene) -> (Vec<Shape>, Vec<Range<usize>>) {
    let mut shapes: Vec<Shape> = scene.shapes.iter().filter(|s| s.collides).map(Shape::of).collect();
    shapes.sort_by_key(|s| s.id);
    let solids: Vec<_> = shapes.iter().map(solid).collect();
    let mut leader: Vec<usize> = (0..shapes.len()).collect();
    for b in 0..shapes.len() {
        for a in 0..b {
            if leader[a] != leader[b] && near(&shapes[a], &shapes[b]) && touch(&solids[a], &solids[b]) {
                let [low, high] = [leader[a].min(leader[b]), leader[a].max(leader[b])];
                leader.iter_mut().filter(|l| **l == high).for_each(|l| *l = low);
            }
        }
    }
    let mut order: Vec<(usize, Shape)> = leader.into_iter().zip(shapes).collect();
    order.sort_by_key(|(leader, shape)| (*leader, shape.id));
    let mut pieces: Vec<Range<usize>> = Vec::new();
    for (k, (leader, _)) in order.iter().enumerate() {
        match pieces.last_mut() {
            Some(piece) if order[piece.start].0 == *leader => piece.end = k + 1,
            _ => pieces.push(k..k + 1),
        }
    }
    (order.into_iter().map(|(_, shape)| shape).collect(), pieces)
}

/// Whether the boxes of two shapes of a body come near each other; both as placed in their body.
fn near(a: &Shape, b: &Shape) -> bool {
    let apart =
        |k: usize| a.bounds.min[k] > b.bounds.max[k] + JOINED || b.bounds.min[k] > a.bounds.max[k] + JOINED;
    a.body == b.body && !(0..3).any(apart)
}

/// For parry, in the body; none where a mesh has no area.
type Solid = Option<(ParryPose, SharedShape)>;

fn touch(a: &Solid, b: &Solid) -> bool {
    let (Some((at_a, a)), Some((at_b, b))) = (a, b) else { return false };
    query::distance(at_a, &**a, at_b, &**b).is_ok_and(|d| d.distance < JOINED)
}

/// Points on an ellipse across the axis.
fn disc(z: f64, [a, b]: [f64; 2]) -> Vec<Vector> {
    let angle = |k: u32| libm::sincos(f64::from(k) * std::f64::consts::PI / 16.0);
    (0..32).map(angle).map(|(s, c)| Vector::new(a * c, b * s, z)).collect()
}

fn solid(shape: &Shape) -> Solid {
    let along_z = |half: f64| Vector::new(0.0, 0.0, half);
    let mut turn = Rot3::IDENTITY;
    let solid = match shape.placed.geometry() {
        Geometry::Sphere { radius } => SharedShape::ball(*radius),
        Geometry::Box { half_extents: [x, y, z] } => SharedShape::cuboid(*x, *y, *z),
        Geometry::Capsule { half_length, radius } => {
            SharedShape::capsule(along_z(-half_length), along_z(*half_length), *radius)
        }
        Geometry::Cylinder { half_length, radius } => {
            // parry's axis is y.
            let half = std::f64::consts::FRAC_1_SQRT_2;
            turn = Rot3::from_xyzw(half, 0.0, 0.0, half);
            SharedShape::cylinder(*half_length, *radius)
        }
        Geometry::Ellipsoid { semi_axes } => {
            let ring = |z: f64| disc(z * semi_axes[2], [0, 1].map(|k| semi_axes[k] * (1.0 - z * z).sqrt()));
            let levels = (-8..=8).map(|k| libm::sin(f64::from(k) * std::f64::consts::PI / 16.0));
            SharedShape::convex_hull(&levels.flat_map(ring).collect::<Vec<_>>())?
        }
        Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
            let ends = [disc(-half_length, [*radius_bottom; 2]), disc(*half_length, [*radius_top; 2])];
            SharedShape::convex_hull(&ends.concat())?
        }
        Geometry::ConvexMesh { points, triangles } | Geometry::Mesh { points, triangles } => {
            let corners = points.iter().map(|p| Vector::new(p[0], p[1], p[2])).collect();
            SharedShape::trimesh(corners, triangles.clone()).ok()?
        }
    };
    let Pose { position: [x, y, z], orientation: [w, i, j, k] } = shape.body_from_shape;
    let rotation = Rot3::from_xyzw(i, j, k, w) * turn;
    Some((ParryPose::from_parts(Vector::new(x, y, z), rotation), solid))
}
