//! Contact points of a step: pairs of shapes by parry's manifolds, shapes on rigid ground in closed form.
//!
//! Points are speculative: all that can touch within the step are found, touching or not. Neighbours in the tree and
//! shapes that overlap in the initial pose are left alone: a leg may stand in the box that stands for the body.

use crate::contact::convex::{Manifold, between_convex, vector};
use crate::contact::plane::{Plane, support_points};
use crate::contact::reduce::{Found, reduce};
use crate::contact::shapes::{parry_local, parry_shape};
use crate::contact::triangles::{is_ground, on_triangles};
use crate::math::{Q, V3, frame_of_normal};
use crate::model::Model;
use crate::motion::Motion;
use nalgebra::{Isometry3, Point3, Translation3};
use parry3d_f64::math::Pose;
use parry3d_f64::query;
use parry3d_f64::shape::SharedShape;
use terraglue_robot_import::{Shape, ShapeGeometry};

/// Shapes that come nearer than this within the step are watched, m.
const MARGIN: f64 = 2e-3;

/// Shapes that overlap by no more than this in the initial pose only touch, m.
const TOUCHING: f64 = 1e-4;

/// Points of one manifold nearer than this are one point, m.
const SAME_POINT: f64 = 1e-5;

struct Collider {
    /// None: it stands still in the world.
    body: Option<usize>,
    /// Pose against the centre of mass in body axes, of the shape and of parry's.
    local: Isometry3<f64>,
    parry_local: Isometry3<f64>,
    /// Shape as in the file.
    given: Shape,
    shape: SharedShape,
    /// Largest distance of the shape from the centre of mass, m.
    reach: f64,
    /// Radius of the shape's own bounding sphere about `centre` (body axes, from the centre of mass), m.
    radius: f64,
    centre: V3,
}

/// A point where two bodies, or the ground and a body, can touch within the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactPoint {
    /// Number of the pair of shapes; shapes on the ground come first.
    pub pair: usize,
    /// Body a (none: the ground) and body b.
    pub bodies: [Option<usize>; 2],
    /// Out of a into b: normal, tangent 1, tangent 2.
    pub frame: [V3; 3],
    /// Positions of it on a and on b, m in the world.
    pub points: [V3; 2],
    /// Distance, negative where they overlap, m.
    pub gap: f64,
    /// Coulomb friction that the file gives; none: the scenario's.
    pub friction: Option<f64>,
}

/// All shapes that collide and the pairs that may meet.
pub(crate) struct Detector {
    colliders: Vec<Collider>,
    /// Shapes that may meet.
    pairs: Vec<[usize; 2]>,
    pub planes: Vec<Plane>,
    scratch: PairScratch,
}

/// Buffers that are filled anew for every pair.
#[derive(Default)]
struct PairScratch {
    manifold: Manifold,
    found: Vec<Found>,
}

/// Points for which room is made beforehand at most.
const MOST_ROOM: usize = 64;

impl Detector {
    /// Whether any bodies can meet.
    pub fn watches(&self) -> bool {
        !self.pairs.is_empty()
    }

    /// Contact points that a step is expected to have at most: four of every shape.
    pub fn room(&self) -> usize {
        (4 * self.colliders.len()).min(MOST_ROOM)
    }

    /// Chooses the pairs at the initial pose.
    pub fn new(model: &Model, bodies: &[Motion]) -> Self {
        let (planes, scratch) = (model.planes.clone(), PairScratch::default());
        let mut me = Self { colliders: Vec::new(), pairs: Vec::new(), planes, scratch };
        let of_bodies = model.bodies.iter().enumerate().map(|(b, body)| (Some(b), body.com, &body.shapes));
        for (body, com, shapes) in of_bodies.chain([(None, V3::zeros(), &model.world_shapes)]) {
            for shape in shapes.iter().filter(|s| s.collides) {
                let to_centre = Translation3::from(-com);
                let (local, parry_local) =
                    (to_centre * shape.body_from_shape, to_centre * parry_local(shape));
                let Some(parry) = parry_shape(shape) else { continue };
                let sphere = parry.compute_local_bounding_sphere();
                let centre = (parry_local * Point3::from(vector(sphere.center))).coords;
                me.colliders.push(Collider {
                    body,
                    local,
                    parry_local,
                    given: shape.clone(),
                    reach: centre.norm() + sphere.radius,
                    radius: sphere.radius,
                    centre,
                    shape: parry,
                });
            }
        }
        for i in 0..me.colliders.len() {
            for k in i + 1..me.colliders.len() {
                if me.may_meet(model, bodies, i, k) {
                    me.pairs.push([i, k]);
                }
            }
        }
        me
    }

    fn may_meet(&self, model: &Model, bodies: &[Motion], i: usize, k: usize) -> bool {
        let (a, b) = (self.colliders[i].body, self.colliders[k].body);
        // A body that hangs from the world is no neighbour of the shapes that stand in it.
        let neighbours = |a: Option<usize>, b: Option<usize>| {
            let above = a.and_then(|a| model.joint_above[a]).map(|j| model.joints[j].parent);
            b.is_some() && above == Some(b)
        };
        let excluded = |a: usize, b: usize| model.excluded.iter().any(|p| *p == [a, b] || *p == [b, a]);
        let filtered = !self.colliders[i].given.meets(&self.colliders[k].given)
            || a.zip(b).is_some_and(|(a, b)| excluded(a, b));
        if a == b || neighbours(a, b) || neighbours(b, a) || filtered {
            return false;
        }
        // A body that starts inside ground comes out of it.
        if is_ground(&*self.colliders[i].shape) || is_ground(&*self.colliders[k].shape) {
            return true;
        }
        let pose = |i: usize| -> Pose { self.colliders[i].parry_pose(bodies).into() };
        let (p, q) = (pose(i), pose(k));
        let near = query::contact(&p, &*self.colliders[i].shape, &q, &*self.colliders[k].shape, MARGIN);
        near.is_ok_and(|c| c.is_none_or(|c| c.dist > -TOUCHING))
    }

    /// Adds the contact points of a step of length h from the committed motion.
    pub fn detect(&mut self, bodies: &[Motion], h: f64, out: &mut Vec<ContactPoint>) {
        let Self { colliders, pairs, planes, scratch } = self;
        for (p, plane) in planes.iter().enumerate() {
            for (i, c) in colliders.iter().enumerate() {
                on_ground(plane, (p * colliders.len() + i, c), bodies, h, scratch, out);
            }
        }
        let first = planes.len() * colliders.len();
        for (i, pair) in pairs.iter().enumerate() {
            let [a, b] = pair.map(|i| &colliders[i]);
            between((first + i, a, b), bodies, h, scratch, out);
        }
    }
}

impl Collider {
    /// Motion of its body.
    fn motion(&self, bodies: &[Motion]) -> Motion {
        self.body.map_or(Motion::at(V3::zeros(), Q::identity()), |b| bodies[b])
    }

    fn pose(&self, bodies: &[Motion]) -> Isometry3<f64> {
        let m = self.motion(bodies);
        Isometry3::from_parts(Translation3::from(m.c), m.q) * self.local
    }

    fn parry_pose(&self, bodies: &[Motion]) -> Isometry3<f64> {
        let m = self.motion(bodies);
        Isometry3::from_parts(Translation3::from(m.c), m.q) * self.parry_local
    }
}

/// Of two frictions the larger one, where any is given.
fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        _ => a.or(b),
    }
}

fn on_ground(
    plane: &Plane,
    (pair, c): (usize, &Collider),
    bodies: &[Motion],
    h: f64,
    scratch: &mut PairScratch,
    out: &mut Vec<ContactPoint>,
) {
    if c.body.is_none() {
        return;
    }
    let m = c.motion(bodies);
    let reach = MARGIN + 2.0 * h * (m.v.norm() + m.w.norm() * c.reach);
    let height = plane.normal.dot(&m.point(&c.centre)) - plane.offset;
    if height > c.radius + reach {
        return;
    }
    let friction = larger(plane.friction, c.given.friction);
    let found = &mut scratch.found;
    found.clear();
    support_points(&c.given.geometry, &c.pose(bodies), &plane.normal, |on_shape| {
        let (normal, gap) = (plane.normal, plane.normal.dot(&on_shape) - plane.offset);
        if gap < reach {
            found.push(Found { on_ground: on_shape - gap * normal, on_shape, normal, gap });
        }
    });
    if matches!(c.given.geometry, ShapeGeometry::Hull(_) | ShapeGeometry::Concave { .. }) {
        reduce(found);
    }
    out.extend(found.iter().map(|f| {
        let (bodies, frame) = ([None, c.body], frame_of_normal(f.normal));
        ContactPoint { pair, bodies, frame, points: [f.on_ground, f.on_shape], gap: f.gap, friction }
    }));
}

fn between(
    (pair, a, b): (usize, &Collider, &Collider),
    bodies: &[Motion],
    h: f64,
    scratch: &mut PairScratch,
    out: &mut Vec<ContactPoint>,
) {
    let (ma, mb) = (a.motion(bodies), b.motion(bodies));
    let reach = MARGIN + 2.0 * h * ((ma.v - mb.v).norm() + ma.w.norm() * a.reach + mb.w.norm() * b.reach);
    if (ma.point(&a.centre) - mb.point(&b.centre)).norm() > a.radius + b.radius + reach {
        return;
    }
    let friction = larger(a.given.friction, b.given.friction);
    let (pose_a, pose_b) = (a.parry_pose(bodies), b.parry_pose(bodies));
    let PairScratch { manifold, found } = scratch;
    found.clear();
    // Bodies come before fixed shapes, so ground is b.
    if is_ground(&*b.shape) {
        on_triangles((&*b.shape, &pose_b), (&*a.shape, &pose_a), reach, manifold, &mut |f| found.push(f));
        reduce(found);
        out.extend(found.iter().map(|f| {
            let (bodies, frame) = ([a.body, b.body], frame_of_normal(-f.normal));
            ContactPoint { pair, bodies, frame, points: [f.on_shape, f.on_ground], gap: f.gap, friction }
        }));
        return;
    }
    between_convex((&*a.shape, None), &*b.shape, &(pose_a.inverse() * pose_b), reach, manifold);
    let n = pose_a.rotation * vector(manifold.local_n1);
    let first = out.len();
    for point in manifold.points.iter().filter(|p| p.dist < reach) {
        let on_a = (pose_a * Point3::from(vector(point.local_p1))).coords;
        let on_b = (pose_b * Point3::from(vector(point.local_p2))).coords;
        // At coinciding edges and corners parry gives the same point more than once.
        if out[first..].iter().any(|o| (o.points[0] - on_a).norm_squared() < SAME_POINT * SAME_POINT) {
            continue;
        }
        let (bodies, points) = ([a.body, b.body], [on_a, on_b]);
        out.push(ContactPoint { pair, bodies, frame: frame_of_normal(n), points, gap: point.dist, friction });
    }
}
