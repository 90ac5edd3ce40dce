//! A line through triangles that share edges: none slips through between two of them.
//!
//! Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (2013), in double precision: the corners are sheared so that the line
//! runs along an axis. An edge then has the same three products in both triangles that share it, with opposite signs, and the
//! line passes it on one side or on the other.

use crate::tree::Line;
use terraglue_numerics::rotation::{cross, dot, minus};

/// A line, ready for many triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheared {
    origin: [f64; 3],
    /// The axis that the line runs along most, and the others in its order.
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Sheared {
    pub fn new(line: &Line) -> Self {
        let d = line.direction;
        let size = d.map(f64::abs);
        let most = if size[0] > size[1] { 0 } else { 1 };
        let most = if size[2] > size[most] { 2 } else { most };
        let axes = [(most + 1) % 3, (most + 2) % 3, most];
        let along = 1.0 / d[most];
        Self { origin: line.origin, axes, shear: [d[axes[0]] * along, d[axes[1]] * along, along] }
    }

    /// Where the line meets a triangle, not before its start; ∞: it misses. Edges belong to the triangle.
    #[inline]
    pub fn cast(&self, corners: &[[f64; 3]; 3]) -> f64 {
        let ([x, y, z], shear) = (self.axes, self.shear);
        let seen = corners.map(|p| {
            let along = p[z] - self.origin[z];
            [p[x] - self.origin[x] - shear[0] * along, p[y] - self.origin[y] - shear[1] * along, along]
        });
        let [a, b, c] = seen;
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return f64::INFINITY;
        }
        let whole = u + v + w;
        let t = shear[2] * (u * a[2] + v * b[2] + w * c[2]) / whole;
        // what is not a number is no hit: the triangle is seen from its edge or has no area
        if t >= 0.0 { t } else { f64::INFINITY }
    }
}

/// Normal of a triangle, of any length.
pub(crate) fn normal([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    cross(minus(*b, *a), minus(*c, *a))
}

/// Square of the distance of a point from a triangle: C. Ericson, "Real-Time Collision Detection" (2005), 5.1.5.
pub(crate) fn distance_squared(corners: &[[f64; 3]; 3], p: [f64; 3]) -> f64 {
    let [a, b, c] = *corners;
    let (ab, ac, bc) = (minus(b, a), minus(c, a), minus(c, b));
    let across = cross(ab, ac);
    let area = dot(across, across);
    let inside = |from: [f64; 3], edge: [f64; 3]| dot(cross(edge, minus(p, from)), across) >= 0.0;
    if area > 0.0 && inside(a, ab) && inside(b, bc) && inside(c, minus(a, c)) {
        let height = dot(minus(p, a), across);
        return height * height / area;
    }
    [(a, ab), (b, bc), (a, ac)]
        .iter()
        .map(|(from, edge)| from_segment(*from, *edge, p))
        .fold(f64::INFINITY, f64::min)
}

fn from_segment(from: [f64; 3], edge: [f64; 3], p: [f64; 3]) -> f64 {
    let (way, square) = (minus(p, from), dot(edge, edge));
    let share = if square > 0.0 { (dot(way, edge) / square).clamp(0.0, 1.0) } else { 0.0 };
    let off: [f64; 3] = std::array::from_fn(|k| way[k] - share * edge[k]);
    dot(off, off)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_met_from_both_sides_and_on_its_edges() {
        let corners = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
        let cast = |origin, direction| Sheared::new(&Line { origin, direction }).cast(&corners);
        assert_eq!(cast([0.2, 0.2, 0.0], [0.0, 0.0, 1.0]), 1.0);
        assert_eq!(cast([0.2, 0.2, 3.0], [0.0, 0.0, -1.0]), 2.0);
        assert_eq!(cast([0.5, 0.5, 0.0], [0.0, 0.0, 1.0]), 1.0);
        assert_eq!(cast([0.2, 0.2, 2.0], [0.0, 0.0, 1.0]), f64::INFINITY);
        assert_eq!(cast([-1.0, 0.2, 1.0], [1.0, 0.0, 0.0]), f64::INFINITY, "seen from its edge");
        assert!((distance_squared(&corners, [0.2, 0.2, 0.0]) - 1.0).abs() < 1e-15);
        assert!((distance_squared(&corners, [2.0, 0.0, 1.0]) - 1.0).abs() < 1e-15);
    }
}
