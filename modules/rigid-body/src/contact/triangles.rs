//! Ground of triangles that stands still, a mesh or a height field: the contact points of a convex shape on it.
//!
//! Each triangle near the shape gives the points of a convex pair. At edges inside a surface the normal is kept
//! within those of both neighbours (parry's pseudo-normals), so that bodies sliding over a flat mesh meet no edges.

use crate::contact::convex::{Manifold, between_convex, vector};
use crate::contact::reduce::Found;
use nalgebra::{Isometry3, Point3};
use parry3d_f64::bounding_volume::BoundingVolume;
use parry3d_f64::math::Pose;
use parry3d_f64::query::details::NormalConstraints;
use parry3d_f64::shape::{Shape, ShapeType, Triangle, TrianglePseudoNormals};

/// Whether a shape is ground of triangles.
pub(crate) fn is_ground(shape: &dyn Shape) -> bool {
    matches!(shape.shape_type(), ShapeType::TriMesh | ShapeType::HeightField)
}

/// Points between ground of triangles and a convex shape that come nearer than `reach`, into `out`.
pub(crate) fn on_triangles(
    (ground, at_ground): (&dyn Shape, &Isometry3<f64>),
    (shape, at_shape): (&dyn Shape, &Isometry3<f64>),
    reach: f64,
    manifold: &mut Manifold,
    out: &mut impl FnMut(Found),
) {
    let relative = at_ground.inverse() * at_shape;
    let pose: Pose = relative.into();
    let around = shape.compute_aabb(&pose).loosened(reach);
    let mut one = |triangle: &Triangle, normals: Option<TrianglePseudoNormals>| {
        let normals = normals.as_ref().map(|n| n as &dyn NormalConstraints);
        between_convex((triangle, normals), shape, &relative, reach, manifold);
        for p in manifold.points.iter().filter(|p| p.dist < reach) {
            let on_ground = (at_ground * Point3::from(vector(p.local_p1))).coords;
            let on_shape = (at_shape * Point3::from(vector(p.local_p2))).coords;
            let normal = at_ground.rotation * vector(manifold.local_n1);
            out(Found { on_ground, on_shape, normal, gap: p.dist });
        }
    };
    if let Some(mesh) = ground.as_trimesh() {
        for id in mesh.bvh().intersect_aabb(&around).filter(|id| (*id as usize) < mesh.num_triangles()) {
            one(&mesh.triangle(id), mesh.triangle_normal_constraints(id));
        }
    } else if let Some(field) = ground.as_heightfield() {
        field.map_elements_in_local_aabb(&around, &mut |id, triangle| {
            one(triangle, field.triangle_normal_constraints(id));
        });
    }
}
