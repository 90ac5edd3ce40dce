//! A line through a box, by the slabs between its faces.

use super::First;

/// `near` is the line's point nearest to the centre.
#[inline]
pub fn cast(half: &[f64; 3], near: [f64; 3], d: [f64; 3], first: &mut First) {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for k in 0..3 {
        if d[k] == 0.0 {
            if near[k].abs() > half[k] {
                return;
            }
            continue;
        }
        let (a, b) = ((-half[k] - near[k]) / d[k], (half[k] - near[k]) / d[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    if enter <= leave {
        first.offer(enter);
        first.offer(leave);
    }
}

/// Of the face that the point is nearest to.
pub fn outward(half: &[f64; 3], p: [f64; 3]) -> [f64; 3] {
    let off = |k: usize| (p[k].abs() - half[k]).abs();
    let face = (1..3).fold(0, |best, k| if off(k) < off(best) { k } else { best });
    let mut outward = [0.0; 3];
    outward[face] = 1.0_f64.copysign(p[face]);
    outward
}

/// Of a point from the solid.
pub fn distance(half: &[f64; 3], p: [f64; 3]) -> f64 {
    (0..3).map(|k| (p[k].abs() - half[k]).max(0.0)).map(|x| x * x).sum::<f64>().sqrt()
}
