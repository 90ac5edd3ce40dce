//! Shapes for parry, whose cylinders and capsules stand along y where ours stand along z, as do height fields.

use crate::math::V3;
use nalgebra::Isometry3;
use parry3d_f64::math::Vector;
use parry3d_f64::shape::{HeightField, HeightFieldFlags, SharedShape, TriMeshFlags};
use parry3d_f64::utils::Array2;
use terraglue_robot_import::{Heights, Mesh, Shape, ShapeGeometry};

/// The shape for parry; none where a mesh has no volume or no area.
pub(crate) fn parry_shape(shape: &Shape) -> Option<SharedShape> {
    Some(match &shape.geometry {
        ShapeGeometry::Sphere { radius } => SharedShape::ball(*radius),
        ShapeGeometry::Box { half_extents: [x, y, z] } => SharedShape::cuboid(*x, *y, *z),
        // parry's axis is y, ours is z: see `parry_local`.
        ShapeGeometry::Cylinder { half_length, radius } => SharedShape::cylinder(*half_length, *radius),
        ShapeGeometry::Capsule { half_length, radius } => SharedShape::capsule_y(*half_length, *radius),
        ShapeGeometry::Hull(mesh) | ShapeGeometry::Concave { hull: mesh, .. } => {
            SharedShape::convex_mesh(corners(mesh), &mesh.triangles)?
        }
        ShapeGeometry::Triangles(mesh) => triangles(mesh)?,
        ShapeGeometry::Heights(heights) => height_field(heights),
    })
}

fn corners(mesh: &Mesh) -> Vec<Vector> {
    mesh.points.iter().map(|p| Vector::new(p[0], p[1], p[2])).collect()
}

/// A closed mesh is solid; an open one is a sheet with two sides.
fn triangles(mesh: &Mesh) -> Option<SharedShape> {
    let sides = if mesh.is_closed() {
        TriMeshFlags::FIX_INTERNAL_EDGES
    } else {
        TriMeshFlags::FIX_INTERNAL_EDGES_TWO_SIDED
    };
    SharedShape::trimesh_with_flags(corners(mesh), mesh.triangles.clone(), sides).ok()
}

/// parry's rows go along its z, our −y, its columns along x.
fn height_field(h: &Heights) -> SharedShape {
    let [nx, ny] = h.nodes;
    let at = |row: usize, column: usize| h.heights[(ny - 1 - row) * nx + column];
    let by_column = (0..nx).flat_map(|column| (0..ny).map(move |row| (row, column)));
    let heights = Array2::new(ny, nx, by_column.map(|(row, column)| at(row, column)).collect());
    let scale = Vector::new(h.lengths[0], 1.0, h.lengths[1]);
    SharedShape::new(HeightField::with_flags(heights, scale, HeightFieldFlags::FIX_INTERNAL_EDGES))
}

/// Pose of the parry shape in the body frame: a shape along z turns from y to z.
pub(crate) fn parry_local(shape: &Shape) -> Isometry3<f64> {
    match shape.geometry {
        ShapeGeometry::Cylinder { .. } | ShapeGeometry::Capsule { .. } | ShapeGeometry::Heights(_) => {
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&V3::x_axis(), std::f64::consts::FRAC_PI_2);
            shape.body_from_shape * turn
        }
        _ => shape.body_from_shape,
    }
}
