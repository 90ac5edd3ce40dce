//! The two rules as integer functions of heights: what flows over a face, what a triple of nodes exchanges.

/// Flux from cell i to cell j over their face, units. `thr` = Δ·tan φ_r in units. `along_i` = h_i − h_j, `across` =
/// sum of the four signed heights across the face, four times the transverse difference.
///
/// q = trunc(¼·(g − thr)₊·g_n/g), g² = g_n² + g_t². Odd in `along_i`: the neighbour computes the opposite.
#[inline]
pub fn face_flux(along_i: i32, across: i32, thr: f64) -> i32 {
    let (g_n, g_t) = (f64::from(along_i), 0.25 * f64::from(across));
    let squared = g_n * g_n + g_t * g_t;
    if squared <= thr * thr {
        return 0;
    }
    let g = squared.sqrt();
    silent((0.25 * (g - thr) * g_n / g) as i32)
}

/// Less than this does not flow, units (1 µm): without it the last creep towards rest never ends.
const SMALLEST_FLUX: i32 = 4;

#[inline]
fn silent(flux: i32) -> i32 {
    if flux.abs() < SMALLEST_FLUX { 0 } else { flux }
}

/// What the middle of a triple receives from each end, units (< 0: gives). `curvature` = h_a − 2h_0 + h_b,
/// `limit` = κ_max·d² in units.
#[inline]
pub fn curvature_flux(curvature: i32, limit: i32) -> i32 {
    let excess = curvature.abs() - limit;
    if excess <= 0 {
        return 0;
    }
    let q = silent(excess / 24);
    if curvature > 0 { q } else { -q }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn both_rules_are_odd(a in -2_000_000..2_000_000i32, b in -2_000_000..2_000_000i32, limit in 1..1_000_000i32) {
            prop_assert_eq!(face_flux(a, b, f64::from(limit)), -face_flux(-a, b, f64::from(limit)));
            prop_assert_eq!(face_flux(a, b, f64::from(limit)), face_flux(a, -b, f64::from(limit)));
            prop_assert_eq!(curvature_flux(a, limit), -curvature_flux(-a, limit));
        }

        #[test]
        fn a_plane_at_the_angle_of_repose_rests(azimuth in 0.0..std::f64::consts::TAU) {
            let thr = 29_000.0;
            // unit heights are integers: rounded inwards the plane is not steeper than thr
            let (x, y) = ((thr * azimuth.cos()).trunc() as i32, (thr * azimuth.sin()).trunc() as i32);
            prop_assert_eq!(face_flux(x, 4 * y, thr), 0);
            prop_assert!(face_flux(2 * x, 8 * y, thr).signum() * x.signum() >= 0);
        }
    }
}
