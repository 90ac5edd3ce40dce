//! Contact of two convex shapes by parry, made safe for hulls that just touch.
//!
//! Between polyhedra that touch, the direction from one to the other is the difference of two points almost at one
//! place and drowns in rounding. Hulls are therefore pushed into each other along the face that separates them best, by
//! a known length; the direction then follows from the overlap, which is well determined.

use crate::math::V3;
use nalgebra::{Isometry3, Point3};
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::details::{NormalConstraints, distance_support_map_support_map};
use parry3d_f64::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};
use parry3d_f64::shape::{Shape, ShapeType};

/// Hulls overlap by this much along the face that separates them best, m.
const OVERLAP: f64 = 1e-3;

/// To which GJK is trusted, m.
const ACCURACY: f64 = 1e-6;

pub(crate) type Manifold = ContactManifold<(), ()>;

pub(crate) fn vector(v: Vector) -> V3 {
    V3::new(v.x, v.y, v.z)
}

fn back(v: &V3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// Fills the manifold of two convex shapes; `relative`: pose of b in a's frame.
pub(crate) fn between_convex(
    (a, normals): (&dyn Shape, Option<&dyn NormalConstraints>),
    b: &dyn Shape,
    relative: &Isometry3<f64>,
    reach: f64,
    manifold: &mut Manifold,
) {
    // Without its memory parry would keep old points while a pair moves little, and contacts would creep.
    manifold.points.clear();
    manifold.local_n1 = Vector::ZERO;
    let push = if is_hull(a) && has_corners(b) || is_hull(b) && has_corners(a) {
        if are_apart(a, b, relative, reach) {
            return;
        }
        let (normal, apart) = best_face(a, b, relative);
        if apart > reach {
            return;
        }
        (apart + OVERLAP) * normal
    } else {
        V3::zeros()
    };
    let mut moved = *relative;
    moved.translation.vector -= push;
    let pose: Pose = moved.into();
    let reach = reach + push.norm();
    let found =
        DefaultQueryDispatcher.contact_manifold_convex_convex(&pose, a, b, normals, None, reach, manifold);
    if found.is_err() {
        manifold.points.clear();
    }
    let taken = push.dot(&vector(manifold.local_n1));
    manifold.points.iter_mut().for_each(|p| p.dist += taken);
}

/// Whether GJK finds two shapes farther from each other than `reach`, m: most pairs that are near are, and the faces of hulls, each held
/// against all corners of the other, need not be looked at then.
fn are_apart(a: &dyn Shape, b: &dyn Shape, relative: &Isometry3<f64>, reach: f64) -> bool {
    let (Some(a), Some(b)) = (a.as_support_map(), b.as_support_map()) else { return false };
    distance_support_map_support_map(&Pose::from(*relative), a, b) > reach + ACCURACY
}

fn is_hull(shape: &dyn Shape) -> bool {
    shape.shape_type() == ShapeType::ConvexPolyhedron
}

fn has_corners(shape: &dyn Shape) -> bool {
    !matches!(shape.shape_type(), ShapeType::Ball | ShapeType::Capsule)
}

/// Of the faces of both shapes the one that separates them best: its normal out of a, in a's frame, and by how much.
fn best_face(a: &dyn Shape, b: &dyn Shape, relative: &Isometry3<f64>) -> (V3, f64) {
    let mut best = (V3::z(), f64::NEG_INFINITY);
    let inverse = relative.inverse();
    if let Some(support) = b.as_support_map() {
        faces(a, &mut |normal, offset| {
            let lowest = vector(support.local_support_point(back(&-inverse.transform_vector(&normal))));
            let apart = normal.dot(&(relative * Point3::from(lowest)).coords) - offset;
            if apart > best.1 {
                best = (normal, apart);
            }
        });
    }
    if let Some(support) = a.as_support_map() {
        faces(b, &mut |normal, offset| {
            let lowest = vector(support.local_support_point(back(&-relative.transform_vector(&normal))));
            let apart = normal.dot(&(inverse * Point3::from(lowest)).coords) - offset;
            if apart > best.1 {
                best = (-relative.transform_vector(&normal), apart);
            }
        });
    }
    best
}

/// Outward normals and offsets of flat faces; a triangle has two.
fn faces(shape: &dyn Shape, each: &mut impl FnMut(V3, f64)) {
    if let Some(hull) = shape.as_convex_polyhedron() {
        for face in hull.faces() {
            let corner = hull.vertices_adj_to_face()[face.first_vertex_or_edge as usize];
            let (normal, corner) = (vector(face.normal), vector(hull.points()[corner as usize]));
            each(normal, normal.dot(&corner));
        }
    } else if let Some(cuboid) = shape.as_cuboid() {
        for (axis, half) in [V3::x(), V3::y(), V3::z()].into_iter().zip(cuboid.half_extents.to_array()) {
            each(axis, half);
            each(-axis, half);
        }
    } else if let Some(triangle) = shape.as_triangle()
        && let Some(normal) = triangle.normal().map(vector)
    {
        let offset = normal.dot(&vector(triangle.a));
        each(normal, offset);
        each(-normal, -offset);
    }
}
