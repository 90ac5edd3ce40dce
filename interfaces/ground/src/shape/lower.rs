//! The exact underside of every shape: where a vertical line enters it from below, in closed form.
//!
//! Every shape but a mesh with dents is convex, so the line lies inside it over one interval; that of an intersection of
//! slabs and cylinders is the intersection of theirs.

use super::Placed;
use crate::math::{cross, dot};
use terraglue_subsystem::Geometry;

/// Slopes below this are walls along the line: rounding would exceed the accuracy of the quotient.
pub(super) const WALL: f64 = 1e-10;

impl Placed {
    /// World height of the underside above (x, y), m; `None` where the vertical line misses the shape.
    pub fn lower(&self, x: f64, y: f64) -> Option<f64> {
        let centre = self.world_from_shape.position;
        let (dx, dy) = (x - centre[0], y - centre[1]);
        if let Geometry::Sphere { radius } = &self.geometry {
            let rest = radius * radius - (dx * dx + dy * dy);
            return (rest >= 0.0).then(|| centre[2] - rest.sqrt());
        }
        if let Some(tree) = &self.tree {
            return tree.lowest(&self.rotation, [dx, dy]).map(|hit| centre[2] + hit.z);
        }
        if let Geometry::ConvexMesh { .. } = &self.geometry {
            return self.planes.lower(dx, dy).map(|z| centre[2] + z);
        }
        // Points of the line in the shape's frame: start + s·up, s = height above the shape's origin.
        let start = self.rotation.to_shape([dx, dy, 0.0]);
        let axes = &self.rotation.0;
        let up = [axes[0][2], axes[1][2], axes[2][2]];
        let s = match &self.geometry {
            Geometry::Sphere { radius } => ball([dx, dy, 0.0], [0.0, 0.0, 1.0], *radius),
            Geometry::Box { half_extents } => in_box(start, up, *half_extents),
            Geometry::Capsule { half_length, radius } => capsule(start, up, *half_length, *radius),
            Geometry::Cylinder { half_length, radius } => cylinder(start, up, *half_length, *radius),
            Geometry::Ellipsoid { semi_axes } => ellipsoid(start, up, *semi_axes),
            Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
                frustum(start, up, *half_length, [*radius_bottom, *radius_top])
            }
            // a tree of triangles or planes, see above
            Geometry::Mesh { .. } | Geometry::ConvexMesh { .. } => None,
        };
        s.map(|s| centre[2] + s)
    }
}

/// The part of a line inside the intersection so far.
#[derive(Clone, Copy)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
    const NONE: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };

    /// Intersects with value + slope·s ≤ 0.
    #[inline]
    fn keep(&mut self, value: f64, slope: f64) {
        if slope < -WALL {
            self.low = self.low.max(-value / slope);
        } else if slope > WALL {
            self.high = self.high.min(-value / slope);
        } else if value > 0.0 {
            *self = Self::NONE;
        }
    }

    fn low(self) -> Option<f64> {
        (self.low <= self.high && self.low.is_finite()).then_some(self.low)
    }
}

fn in_box(start: [f64; 3], up: [f64; 3], half: [f64; 3]) -> Option<f64> {
    let mut line = Interval::ALL;
    for k in 0..3 {
        line.keep(start[k] - half[k], up[k]);
        line.keep(-start[k] - half[k], -up[k]);
    }
    line.low()
}

/// Lower end of the line inside a ball around the frame's origin.
fn ball(start: [f64; 3], up: [f64; 3], radius: f64) -> Option<f64> {
    let b = dot(start, up);
    let rest = radius * radius - (dot(start, start) - b * b);
    (rest >= 0.0).then(|| -b - rest.sqrt())
}

/// Lower end of the line inside an ellipsoid, a ball in coordinates divided by its half lengths.
fn ellipsoid(start: [f64; 3], up: [f64; 3], semi_axes: [f64; 3]) -> Option<f64> {
    let divided = |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| v[k] / semi_axes[k]) };
    let (start, up) = (divided(start), divided(up));
    let a = dot(up, up);
    let aside = cross(start, up);
    let rest = a - dot(aside, aside);
    (rest >= 0.0).then(|| (-dot(start, up) - rest.sqrt()) / a)
}

/// Lines that pass the rim of a frustum by less than this part of its size meet it: its side and its ends reckon with
/// different numbers.
const RIM: f64 = 1e-12;

/// The line enters a frustum at the lowest of the points where it meets the ends and the side.
fn frustum(start: [f64; 3], up: [f64; 3], half_length: f64, radii: [f64; 2]) -> Option<f64> {
    let middle = 0.5 * (radii[0] + radii[1]);
    let slack = RIM * (half_length + radii[0].max(radii[1]));
    let widening = 0.5 * (radii[1] - radii[0]) / half_length;
    let at = |s: f64| -> [f64; 3] { std::array::from_fn(|k| start[k] + s * up[k]) };
    let on_end = |side: usize| {
        let z = if side == 0 { -half_length } else { half_length };
        let s = (z - start[2]) / up[2];
        let [x, y, _] = at(s);
        let reach = radii[side] + slack;
        (up[2].abs() > WALL && x * x + y * y <= reach * reach).then_some(s)
    };
    // a·s² + 2·b·s + c = 0 of x² + y² = (middle + widening·z)²
    let (r, dr) = (middle + widening * start[2], widening * up[2]);
    let a = up[0] * up[0] + up[1] * up[1] - dr * dr;
    let b = up[0] * start[0] + up[1] * start[1] - dr * r;
    let c = start[0] * start[0] + start[1] * start[1] - r * r;
    let root = (b * b - a * c).sqrt();
    let q = if b > 0.0 { -b - root } else { -b + root };
    // no root, or one at infinity: not a number, and dropped
    let on_side = [q / a, c / q].map(|s| (at(s)[2].abs() <= half_length + slack).then_some(s));
    [on_end(0), on_end(1), on_side[0], on_side[1]].into_iter().flatten().min_by(f64::total_cmp)
}

/// Both ends of the line inside the endless cylinder around z.
fn endless_cylinder(start: [f64; 3], up: [f64; 3], radius: f64) -> Interval {
    // a·s² + 2·b·s + c ≤ 0
    let a = up[0] * up[0] + up[1] * up[1];
    let b = up[0] * start[0] + up[1] * start[1];
    let c = start[0] * start[0] + start[1] * start[1] - radius * radius;
    if a <= WALL * WALL {
        return if c <= 0.0 { Interval::ALL } else { Interval::NONE };
    }
    // radius² minus squared distance of the line from the axis, without cancellation of b² and a·c.
    let across = (up[0] * start[1] - up[1] * start[0]) / a.sqrt();
    let rest = radius * radius - across * across;
    if rest < 0.0 {
        return Interval::NONE;
    }
    let root = (a * rest).sqrt();
    // The end with the larger magnitude directly, the other from the product c/a of both.
    let q = if b > 0.0 { -b - root } else { -b + root };
    if q == 0.0 {
        return Interval { low: 0.0, high: 0.0 };
    }
    // a line that grazes the cylinder has nothing but rounding in c and q
    let one = q / a;
    let other = (c / q).clamp(-one.abs(), one.abs());
    Interval { low: one.min(other), high: one.max(other) }
}

fn cylinder(start: [f64; 3], up: [f64; 3], half_length: f64, radius: f64) -> Option<f64> {
    let mut line = endless_cylinder(start, up, radius);
    line.keep(start[2] - half_length, up[2]);
    line.keep(-start[2] - half_length, -up[2]);
    line.low()
}

/// The capsule is its cylinder and two balls; the line enters at the lowest of the three entries. The flat ends
/// of the cylinder lie inside the balls and are never the entry.
fn capsule(start: [f64; 3], up: [f64; 3], half_length: f64, radius: f64) -> Option<f64> {
    let moved = |z: f64| [start[0], start[1], start[2] - z];
    let ends = [ball(moved(half_length), up, radius), ball(moved(-half_length), up, radius)];
    let side = endless_cylinder(start, up, radius).low().filter(|s| {
        let z = start[2] + s * up[2];
        z.abs() <= half_length
    });
    ends.into_iter().chain([side]).flatten().min_by(f64::total_cmp)
}
