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
    /// The axis that the line runs along most is the last, the others before it in their order.
    most: Axis,
    shear: [f64; 3],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// Components in the order that ends with this axis.
    #[inline(always)]
    fn last(self, p: [f64; 3]) -> [f64; 3] {
        match self {
            Self::X => [p[1], p[2], p[0]],
            Self::Y => [p[2], p[0], p[1]],
            Self::Z => p,
        }
    }
}

impl Sheared {
    #[inline(always)]
    pub fn new(line: &Line) -> Self {
        let size = line.direction.map(f64::abs);
        let most = match () {
            () if size[2] >= size[0] && size[2] >= size[1] => Axis::Z,
            () if size[1] >= size[0] => Axis::Y,
            () => Axis::X,
        };
        let d = most.last(line.direction);
        let along = 1.0 / d[2];
        Self { origin: most.last(line.origin), most, shear: [d[0] * along, d[1] * along, along] }
    }

    /// A corner as the line sees it.
    #[inline(always)]
    fn seen(&self, p: [f64; 3]) -> [f64; 3] {
        let (p, o, shear) = (self.most.last(p), self.origin, self.shear);
        let along = p[2] - o[2];
        [p[0] - o[0] - shear[0] * along, p[1] - o[1] - shear[1] * along, along]
    }

    /// Where the line meets a triangle, not before its start; ∞: it misses. Edges belong to the triangle.
    #[inline(always)]
    pub fn cast(&self, corners: &[[f64; 3]; 3]) -> f64 {
        self.cast_seen([self.seen(corners[0]), self.seen(corners[1]), self.seen(corners[2])])
    }

    /// Where it meets the triangles a, b, c and b, d, c.
    #[inline(always)]
    pub fn cast_pair(&self, [a, b, c, d]: [[f64; 3]; 4]) -> [f64; 2] {
        let [a, b, c, d] = [self.seen(a), self.seen(b), self.seen(c), self.seen(d)];
        [self.cast_seen([a, b, c]), self.cast_seen([b, d, c])]
    }

    #[inline(always)]
    fn cast_seen(&self, [a, b, c]: [[f64; 3]; 3]) -> f64 {
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        if least < 0.0 && most > 0.0 {
            return f64::INFINITY;
        }
        let t = self.shear[2] * (u * a[2] + v * b[2] + w * c[2]) / (u + v + w);
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
