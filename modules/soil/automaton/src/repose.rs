//! The rule of repose: over a face steeper than the angle of repose φ_r flows a quarter of the excess.
//!
//! With g_n the difference of the heights of both nodes, g_t the slope along the face (the mean of the central differences of
//! both) and g = √(g_n² + g_t²), the flux is q = ¼·(g − Δ·tan φ_r)₊·g_n/g rounded down to whole units (Rossmann, Jung and Rast
//! 2010, section IV, made isotropic): a plane of slope tan φ_r is at rest at any azimuth.

use crate::lanes::{LANES, Lanes, lanes, whole};
use crate::span::Span;
use terraglue_ground::UNIT_M;

/// Δ·tan φ_r of an angle of repose (rad) between nodes `spacing` (m) apart, units of height.
pub fn threshold(angle: f64, spacing: f64) -> f32 {
    (spacing * libm::tan(angle) / UNIT_M) as f32
}

/// The thresholds Δ·tan φ_r of a row, in units of height.
pub trait Thresholds: Copy {
    /// From column `first` on, `count` of them.
    fn part(self, first: usize, count: usize) -> Self;
    /// At column `x` and those after it.
    fn lanes(self, x: usize) -> Lanes<f32>;
}

/// One angle of repose everywhere.
impl Thresholds for f32 {
    #[inline(always)]
    fn part(self, _: usize, _: usize) -> Self {
        self
    }
    #[inline(always)]
    fn lanes(self, _: usize) -> Lanes<f32> {
        [self; LANES]
    }
}

/// One per node.
impl Thresholds for &[f32] {
    #[inline(always)]
    fn part(self, first: usize, count: usize) -> Self {
        &self[first..][..count]
    }
    #[inline(always)]
    fn lanes(self, x: usize) -> Lanes<f32> {
        let mut out = [0.0; LANES];
        out.copy_from_slice(&self[x..x + LANES]);
        out
    }
}

/// The threshold of a face is that of its upper node, whose material would slide: the same seen from both sides.
#[inline(always)]
fn of_the_upper(along: &Lanes<i32>, [here, there]: [Lanes<f32>; 2]) -> Lanes<f32> {
    let mut thr = here;
    for k in 0..LANES {
        thr[k] = if along[k] > 0 { here[k] } else { there[k] };
    }
    thr
}

/// Flux over a face, units: q = ¼·(g − thr)₊·g_n/g rounded down, g² = g_n² + g_t²; `along` = g_n, `across` = 4·g_t.
#[inline(always)]
fn face(along: Lanes<i32>, across: Lanes<i32>, thr: Lanes<f32>) -> Lanes<i32> {
    let mut squared = [0.0; LANES];
    let mut steep = false;
    for k in 0..LANES {
        let (n, t) = (along[k] as f32, across[k] as f32 * 0.25);
        squared[k] = n * n + t * t;
        steep |= squared[k] > thr[k] * thr[k];
    }
    if !steep {
        return [0; LANES];
    }
    let mut flux = [0; LANES];
    for k in 0..LANES {
        let least = thr[k] * thr[k];
        let steep = if squared[k] > least { squared[k] } else { least };
        let share = 1.0 - thr[k] / steep.sqrt();
        flux[k] = whole(0.25 * (along[k] as f32).abs() * share, along[k]);
    }
    flux
}

/// Fluxes from x to x + 1 for x = first … end − 1 (whole groups), in the middle one of three rows.
#[inline(always)]
pub fn faces_along<T: Thresholds>(
    [below, here, above]: [&[i32]; 3],
    [first, end]: [usize; 2],
    thr: T,
    out: &mut [i32],
) {
    // slices of one length, so that it is checked once
    let n = end - first;
    let (t0, t1) = (thr.part(first, n), thr.part(first + 1, n));
    let (h0, h1) = (&here[first..][..n], &here[first + 1..][..n]);
    let (a0, a1) = (&above[first..][..n], &above[first + 1..][..n]);
    let (b0, b1) = (&below[first..][..n], &below[first + 1..][..n]);
    let out = &mut out[first..][..n];
    for x in (0..n).step_by(LANES) {
        let (h0, h1, a0, a1, b0, b1) =
            (lanes(h0, x), lanes(h1, x), lanes(a0, x), lanes(a1, x), lanes(b0, x), lanes(b1, x));
        let (mut along, mut across) = ([0; LANES], [0; LANES]);
        for k in 0..LANES {
            along[k] = h0[k].wrapping_sub(h1[k]);
            across[k] = a0[k].wrapping_sub(b0[k]).wrapping_add(a1[k].wrapping_sub(b1[k]));
        }
        let thr = of_the_upper(&along, [t0.lanes(x), t1.lanes(x)]);
        out[x..x + LANES].copy_from_slice(&face(along, across, thr));
    }
}

/// Fluxes at x = first … end − 1 (whole groups) from the row `here` to the row `above`.
#[inline(always)]
pub fn faces_across<T: Thresholds>(
    [here, above]: [&[i32]; 2],
    [first, end]: [usize; 2],
    thr: [T; 2],
    out: &mut [i32],
) {
    let n = end - first;
    let [t0, t1] = thr.map(|thr| thr.part(first, n));
    let (h, hl, hr) = (&here[first..][..n], &here[first - 1..][..n], &here[first + 1..][..n]);
    let (a, al, ar) = (&above[first..][..n], &above[first - 1..][..n], &above[first + 1..][..n]);
    let out = &mut out[first..][..n];
    for x in (0..n).step_by(LANES) {
        let (h, hl, hr) = (lanes(h, x), lanes(hl, x), lanes(hr, x));
        let (a, al, ar) = (lanes(a, x), lanes(al, x), lanes(ar, x));
        let (mut along, mut across) = ([0; LANES], [0; LANES]);
        for k in 0..LANES {
            along[k] = h[k].wrapping_sub(a[k]);
            across[k] = hr[k].wrapping_sub(hl[k]).wrapping_add(ar[k].wrapping_sub(al[k]));
        }
        let thr = of_the_upper(&along, [t0.lanes(x), t1.lanes(x)]);
        out[x..x + LANES].copy_from_slice(&face(along, across, thr));
    }
}

/// Cuts fluxes from nodes with the inlets `from` to nodes with the inlets `to` (slices of the same length) to the limit
/// of the receiver. A node without inlet is closed: it gives nothing, either.
#[inline(always)]
pub fn admit(flux: &mut [i32], from: &[i32], to: &[i32]) {
    for ((q, from), to) in flux.iter_mut().zip(from).zip(to) {
        let open = -i32::from(*from != 0 && *to != 0);
        // not `clamp`, whose check of its limits keeps compilers from vectors
        *q = (*q).max(-(*from & open)).min(*to & open);
    }
}

/// Change of each node of `span` from the fluxes over its four faces.
#[inline(always)]
pub fn sum_faces(Span { lo, hi }: Span, along: &[i32], [lower, upper]: [&[i32]; 2], change: &mut [i32]) {
    let (left, right) = (&along[lo - 1..hi - 1], &along[lo..hi]);
    let (lower, upper, change) = (&lower[lo..hi], &upper[lo..hi], &mut change[lo..hi]);
    for k in 0..change.len() {
        change[k] = left[k].wrapping_sub(right[k]).wrapping_add(lower[k].wrapping_sub(upper[k]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_flux_is_odd_and_that_of_the_rule(a in -2_000_000..2_000_000i32, t in -2_000_000..2_000_000i32) {
            let thr = 29_362.0_f32;
            let q = face([a; LANES], [t; LANES], [thr; LANES])[3];
            prop_assert_eq!(q, -face([-a; LANES], [t; LANES], [thr; LANES])[0]);
            prop_assert_eq!(q, face([a; LANES], [-t; LANES], [thr; LANES])[7]);
            let (n, t) = (f64::from(a), 0.25 * f64::from(t));
            let g = (n * n + t * t).sqrt();
            let exact = 0.25 * (g - 29_362.0).max(0.0) * n / g.max(1.0);
            prop_assert!((f64::from(q) - exact.trunc()).abs() <= 1.0 + 1e-6 * exact.abs(), "{q} {exact}");
        }

        #[test]
        fn a_plane_at_the_angle_of_repose_rests_and_a_steeper_one_flows(azimuth in 0.0..std::f64::consts::TAU) {
            let thr = 29_362.0;
            let flux = |scale: f64| {
                let (x, y) = (thr * azimuth.cos() * scale, thr * azimuth.sin() * scale);
                let (x, y) = (x.trunc() as i32, y.trunc() as i32);
                face([x; LANES], [4 * y; LANES], [thr as f32; LANES])[0].abs()
                    + face([y; LANES], [4 * x; LANES], [thr as f32; LANES])[0].abs()
            };
            prop_assert_eq!(flux(1.0), 0);
            prop_assert!(flux(1.001) > 0);
        }
    }
}
