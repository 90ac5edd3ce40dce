//! A line through an ellipsoid, as a sphere in a stretched space; the nearest point by bisection.

use super::First;
use terraglue_numerics::rotation::{dot, length};

/// `near` is the line's point nearest to the centre.
#[inline]
pub fn cast(axes: &[f64; 3], near: [f64; 3], d: [f64; 3], first: &mut First) {
    let stretched = |v: [f64; 3]| std::array::from_fn::<f64, 3, _>(|k| v[k] / axes[k]);
    let (p, u) = (stretched(near), stretched(d));
    let (a, b) = (dot(u, u), dot(p, u));
    let middle = -b / a;
    let at: [f64; 3] = std::array::from_fn(|k| p[k] + middle * u[k]);
    let inside = 1.0 - dot(at, at);
    if inside >= 0.0 {
        let half = (inside / a).sqrt();
        first.offer(middle - half);
        first.offer(middle + half);
    }
}

/// Of a point from the solid. The nearest point of the surface is a²·p/(a² + s) with the s ≥ 0 that puts it there: D. Eberly,
/// "Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid" (2013).
pub fn distance(axes: &[f64; 3], p: [f64; 3]) -> f64 {
    let over =
        |s: f64| (0..3).map(|k| axes[k] * p[k] / (axes[k] * axes[k] + s)).map(|x| x * x).sum::<f64>() - 1.0;
    if !(over(0.0) > 0.0) {
        return 0.0;
    }
    // past the root: each summand is at most (a·p/s)²
    let longest = axes.iter().fold(0.0_f64, |m, a| m.max(*a));
    let (mut low, mut high) = (0.0, longest * length(p));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if over(middle) > 0.0 { low = middle } else { high = middle }
    }
    let way: [f64; 3] = std::array::from_fn(|k| p[k] * high / (axes[k] * axes[k] + high));
    length(way)
}
