//! Masses and sizes that no part of a robot has, most often by another unit: used as given, and reported.

use crate::inertia::Inertial;
use crate::model::ShapeGeometry;

/// Lightest and heaviest part, kg.
const MASSES: [f64; 2] = [1e-10, 1e6];
/// Smallest and largest part, m.
const SIZES: [f64; 2] = [1e-6, 100.0];

/// Doubts about the mass of a body and the distance of its centre.
pub(crate) fn body(own: &Inertial) -> Option<String> {
    let [lightest, heaviest] = MASSES;
    if !(lightest..=heaviest).contains(&own.mass) {
        return Some(format!(
            "weighs {:e} kg, and parts of robots weigh {lightest:e} to {heaviest:e} kg: it is used as it stands, check its unit",
            own.mass
        ));
    }
    // the largest moment is at most the trace, and at least a third of it
    let gyration = (own.tensor.trace() / own.mass).sqrt();
    let (arm, largest) = (own.com.norm(), SIZES[1]);
    if arm > largest {
        return Some(format!(
            "has its centre of mass {arm:.3e} m from its origin, and parts of robots are up to {largest} m large: it is used \
             as it stands, check the unit"
        ));
    }
    (gyration > largest).then(|| {
        format!(
            "has the inertia of a body {gyration:.3e} m large, and parts of robots are up to {largest} m large: it is used as \
             it stands, check the units of mass and inertia"
        )
    })
}

/// Doubts about the size of a shape.
pub(crate) fn shape(geometry: &ShapeGeometry) -> Option<String> {
    let (size, [smallest, largest]) = (extent(geometry)?, SIZES);
    (!(smallest..=largest).contains(&size)).then(|| {
        format!(
            "has a shape of {size:.3e} m, and parts of robots are {smallest:e} to {largest} m large: it is used as it stands, \
             check its unit (a mesh in mm needs a scale of 0.001)"
        )
    })
}

/// Largest extent of a shape that moves, m.
fn extent(geometry: &ShapeGeometry) -> Option<f64> {
    Some(match geometry {
        ShapeGeometry::Sphere { radius } => 2.0 * radius,
        ShapeGeometry::Box { half_extents } => 2.0 * half_extents.iter().copied().fold(0.0, f64::max),
        ShapeGeometry::Cylinder { half_length, radius } => 2.0 * half_length.max(*radius),
        ShapeGeometry::Capsule { half_length, radius } => 2.0 * (half_length + radius),
        ShapeGeometry::Hull(mesh) | ShapeGeometry::Concave { mesh, .. } => {
            let along = |k: usize| {
                let ends = mesh.points.iter().map(|p| p[k]);
                ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
            };
            (0..3).map(along).fold(0.0, |most, [low, high]| f64::max(most, high - low))
        }
        ShapeGeometry::Triangles(_) | ShapeGeometry::Heights(_) => return None,
    })
}

/// The first of many warnings, with the number of the others.
pub(crate) fn first(mut all: Vec<String>) -> Option<String> {
    let more = all.len().checked_sub(1)?;
    let first = all.swap_remove(0);
    Some(if more > 0 { format!("{first} ({more} more like it)") } else { first })
}
