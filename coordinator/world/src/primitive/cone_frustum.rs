//! A line through a cone without its tip, or a cylinder: the curved side and two flat ends.

use super::{First, SEAM, roots};

/// `near` is the line's point nearest to the centre; radii at the bottom and at the top.
#[inline]
pub fn cast(half: f64, [bottom, top]: [f64; 2], near: [f64; 3], d: [f64; 3], first: &mut First) {
    let (middle, slope) = (0.5 * (bottom + top), slope(half, [bottom, top]));
    let radius = middle + slope * near[2];
    let a = d[0] * d[0] + d[1] * d[1] - slope * slope * d[2] * d[2];
    let b = near[0] * d[0] + near[1] * d[1] - slope * d[2] * radius;
    let c = near[0] * near[0] + near[1] * near[1] - radius * radius;
    let seam = SEAM * (half + bottom + top);
    if let Some(side) = roots(a, b, c) {
        for s in side {
            if (near[2] + s * d[2]).abs() <= half + seam {
                first.offer(s);
            }
        }
    }
    if d[2] != 0.0 {
        for (end, radius) in [(-half, bottom), (half, top)] {
            let s = (end - near[2]) / d[2];
            let (x, y) = (near[0] + s * d[0], near[1] + s * d[1]);
            if x * x + y * y <= (radius + seam) * (radius + seam) {
                first.offer(s);
            }
        }
    }
}

/// Of the end or the side, whichever the point is nearer to.
pub fn outward(half: f64, [bottom, top]: [f64; 2], p: [f64; 3]) -> [f64; 3] {
    let slope = slope(half, [bottom, top]);
    let across = (p[0] * p[0] + p[1] * p[1]).sqrt();
    let off_side = (across - 0.5 * (bottom + top) - slope * p[2]).abs() / (1.0 + slope * slope).sqrt();
    if (p[2].abs() - half).abs() <= off_side || across == 0.0 {
        return [0.0, 0.0, p[2]];
    }
    [p[0], p[1], -slope * across]
}

/// Of a point from the solid: in the half plane through the axis, from a trapezium.
pub fn distance(half: f64, [bottom, top]: [f64; 2], p: [f64; 3]) -> f64 {
    let across = (p[0] * p[0] + p[1] * p[1]).sqrt();
    let slope = slope(half, [bottom, top]);
    if p[2].abs() <= half && across <= 0.5 * (bottom + top) + slope * p[2] {
        return 0.0;
    }
    let corners = [[0.0, -half], [bottom, -half], [top, half], [0.0, half]];
    let edges = corners.windows(2).map(|e| from_segment([e[0], e[1]], [across, p[2]]));
    edges.fold(f64::INFINITY, f64::min)
}

/// Change of the radius with z.
#[inline]
fn slope(half: f64, [bottom, top]: [f64; 2]) -> f64 {
    if half > 0.0 { 0.5 * (top - bottom) / half } else { 0.0 }
}

fn from_segment([a, b]: [[f64; 2]; 2], p: [f64; 2]) -> f64 {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = u[0] * u[0] + u[1] * u[1];
    let share = if square > 0.0 { ((u[0] * v[0] + u[1] * v[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    let (x, y) = (v[0] - share * u[0], v[1] - share * u[1]);
    (x * x + y * y).sqrt()
}
