//! Farthest points of a shape along a direction, and the reference point of its contact patch.

use super::Placed;
use crate::math::{add, dot, point, scaled};
use terraglue_subsystem::Geometry;

/// Sine of the tilt (1°) over which the reference point of a flat side moves from its middle to its edge.
const TILT: f64 = 0.017_452_4;

impl Placed {
    /// The point of the shape farthest along a world direction (unit), world, m. Of a whole face or edge that
    /// is equally far, its middle.
    pub fn support(&self, direction: [f64; 3]) -> [f64; 3] {
        self.farthest(direction, 1e-12)
    }

    /// Reference point of the contact with ground of the given unit normal: at the level of the lowest point
    /// along −normal, sideways the middle of the lowest part.
    ///
    /// A flat side that tilts moves the point from its middle to its edge over one degree, so that rounding
    /// does not throw it from corner to corner.
    pub fn patch_origin(&self, normal: [f64; 3]) -> [f64; 3] {
        let down = scaled(normal, -1.0);
        let p = self.farthest(down, TILT);
        let rise = dot(self.support(down), down) - dot(p, down);
        add(p, scaled(down, rise))
    }

    /// Half of the shape's width along a world direction (unit), m.
    pub fn half_width(&self, direction: [f64; 3]) -> f64 {
        let back = scaled(direction, -1.0);
        0.5 * (dot(self.support(direction), direction) + dot(self.support(back), back))
    }

    /// Support point with ties blended over tilts whose sine is below `tilt`.
    fn farthest(&self, direction: [f64; 3], tilt: f64) -> [f64; 3] {
        let d = self.rotation.to_shape(direction);
        let blend = |c: f64| (c / tilt).clamp(-1.0, 1.0);
        let local = match &self.geometry {
            Geometry::Sphere { radius } => scaled(d, *radius),
            Geometry::Box { half_extents: h } => std::array::from_fn(|k| h[k] * blend(d[k])),
            Geometry::Capsule { half_length, radius } => {
                add(scaled(d, *radius), [0.0, 0.0, half_length * blend(d[2])])
            }
            Geometry::Cylinder { half_length, radius } => {
                let across = (d[0] * d[0] + d[1] * d[1]).sqrt();
                let reach = if across > 0.0 { radius * blend(across) / across } else { 0.0 };
                [d[0] * reach, d[1] * reach, half_length * blend(d[2])]
            }
            Geometry::Ellipsoid { semi_axes: a } => {
                let along: [f64; 3] = std::array::from_fn(|k| a[k] * d[k]);
                let reach = dot(along, along).sqrt();
                std::array::from_fn(|k| if reach > 0.0 { a[k] * along[k] / reach } else { 0.0 })
            }
            Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
                let across = (d[0] * d[0] + d[1] * d[1]).sqrt();
                let (length, wider) = (2.0 * half_length, radius_top - radius_bottom);
                let ahead = length * d[2] + wider * across;
                let share = blend(ahead / (length * length + wider * wider).sqrt());
                let radius = 0.5 * (radius_bottom + radius_top + wider * share);
                let reach = if across > 0.0 { radius * blend(across) / across } else { 0.0 };
                [d[0] * reach, d[1] * reach, half_length * share]
            }
            Geometry::ConvexMesh { points, .. } | Geometry::Mesh { points, .. } => {
                farthest_corner(points, d, tilt)
            }
        };
        point(&self.world_from_shape, &self.rotation, local)
    }
}

/// Mean of the corners whose distance along d is within tilt·size of the farthest, weighted to zero at that limit.
fn farthest_corner(points: &[[f64; 3]], d: [f64; 3], tilt: f64) -> [f64; 3] {
    let level = points.iter().map(|p| dot(*p, d)).fold(f64::NEG_INFINITY, f64::max);
    let size = points.iter().map(|p| dot(*p, *p)).fold(0.0, f64::max).sqrt();
    let range = (tilt * size).max(f64::MIN_POSITIVE);
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for p in points {
        let weight = (1.0 - (level - dot(*p, d)) / range).max(0.0);
        sum = add(sum, scaled(*p, weight));
        total += weight;
    }
    if total > 0.0 { scaled(sum, 1.0 / total) } else { sum }
}
