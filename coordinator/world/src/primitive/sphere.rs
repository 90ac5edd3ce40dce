//! A line through a sphere.

use super::First;
use terraglue_numerics::rotation::dot;

/// `near` is the line's point nearest to the centre.
#[inline]
pub fn cast(radius: f64, near: [f64; 3], first: &mut First) {
    let inside = radius * radius - dot(near, near);
    if inside >= 0.0 {
        let half = inside.sqrt();
        first.offer(-half);
        first.offer(half);
    }
}
