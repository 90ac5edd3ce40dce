//! A line through a capsule: a cylinder without ends, and two spheres.

use super::{First, SEAM, roots};

/// `near` is the line's point nearest to the centre.
#[inline]
pub fn cast(half: f64, radius: f64, near: [f64; 3], d: [f64; 3], first: &mut First) {
    let a = d[0] * d[0] + d[1] * d[1];
    let b = near[0] * d[0] + near[1] * d[1];
    let c = near[0] * near[0] + near[1] * near[1] - radius * radius;
    let seam = SEAM * (half + radius);
    if let Some(side) = roots(a, b, c) {
        for s in side {
            if (near[2] + s * d[2]).abs() <= half + seam {
                first.offer(s);
            }
        }
    }
    for end in [-half, half] {
        let z = near[2] - end;
        let b = near[0] * d[0] + near[1] * d[1] + z * d[2];
        // from the line's point nearest to the centre of the sphere
        let at = [near[0] - b * d[0], near[1] - b * d[1], z - b * d[2]];
        let inside = radius * radius - at.iter().map(|x| x * x).sum::<f64>();
        if inside < 0.0 {
            continue;
        }
        for s in [-b - inside.sqrt(), -b + inside.sqrt()] {
            if (near[2] + s * d[2]) * end.signum() >= half - seam {
                first.offer(s);
            }
        }
    }
}
