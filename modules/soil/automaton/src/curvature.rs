//! The rule of curvature: a ridge or a notch sharper than the largest curvature κ_max is rounded.
//!
//! For three nodes a–0–b in a row at the distance d, in four directions: with c = h_a − 2h_0 + h_b and e = (|c| − κ_max·d²)₊,
//! the flux e/24 rounded down to whole units goes from the middle to each end (c < 0), or from each end to the middle (c > 0)
//! (Rossmann, Jung and Rast 2010, section IV). e/6 would repair a single triple exactly; 1/24 is the limit for twelve
//! overlapping ones.

use crate::lanes::{LANES, lanes, whole};
use crate::span::Span;
use terraglue_ground::UNIT_M;

/// A limit of curvature beyond which the rule rests, units per triple: higher than any ground.
const SHARPEST: f64 = 5e8;

/// κ_max·d² of straight and diagonal triples between nodes `spacing` (m) apart, units; steps as high as `critical` (units) stand
/// whatever κ_max (1/m) is. `None`: nothing is too sharp.
pub fn limits(curvature_max: f64, critical: i32, spacing: f64) -> Option<[i32; 2]> {
    let straight = (curvature_max * spacing * spacing / UNIT_M).max(f64::from(critical));
    (straight < SHARPEST).then(|| [straight as i32, 2 * straight as i32])
}

/// Units that the middles of the triples (a, middle, b) receive from each end, at `first` …; < 0: they give. Returns
/// whether any is not 0. `shift` moves a to the left and b to the right.
#[inline(always)]
pub fn triples(
    [a, middle, b]: [&[i32]; 3],
    shift: [isize; 2],
    [first, end]: [usize; 2],
    limit: i32,
    out: &mut [i32],
) -> bool {
    let mut any = false;
    let mut x = first;
    while x < end {
        let m = lanes(middle, x);
        let (l, r) = (lanes(a, x.wrapping_add_signed(shift[0])), lanes(b, x.wrapping_add_signed(shift[1])));
        let (mut curvature, mut bent) = ([0; LANES], false);
        for k in 0..LANES {
            curvature[k] = l[k].wrapping_sub(m[k]).wrapping_add(r[k].wrapping_sub(m[k]));
            bent |= curvature[k].wrapping_abs() > limit;
        }
        let mut flux = [0; LANES];
        if bent {
            any = true;
            for k in 0..LANES {
                let excess = curvature[k].wrapping_abs().wrapping_sub(limit).max(0);
                flux[k] = whole(excess as f32 / 24.0, curvature[k]);
            }
        }
        out[x..x + LANES].copy_from_slice(&flux);
        x += LANES;
    }
    any
}

/// Limits the flux to the middles of triples to the inlets of every node of a triple: its middle and both its `ends`
/// (slices of the same length).
#[inline(always)]
pub fn admit_triples(flux: &mut [i32], middle: &[i32], ends: [&[i32]; 2]) {
    for (((q, m), a), b) in flux.iter_mut().zip(middle).zip(ends[0]).zip(ends[1]) {
        let least = (*a).min(*b).min(*m);
        *q = (*q).max(-least).min(least);
    }
}

/// Change of each node of row y from the triples that hold it; fluxes of middles in row r lie in `fluxes[4·(r % 3)]` ….
#[inline(always)]
pub fn sum_triples(span: Span, y: usize, any: [bool; 3], fluxes: &[Vec<i32>], change: &mut [i32]) {
    change[span.lo..span.hi].fill(0);
    let rows = [y - 1, y, y + 1].map(|r| r % 3);
    let [lower, here, upper] = rows.map(|r| &fluxes[4 * r..4 * r + 4]);
    let n = span.len();
    let change = &mut change[span.lo..span.hi];
    if any[rows[1]] {
        let [h, v, d, e] = here else { return };
        let [v, d, e] = [v, d, e].map(|row| &row[span.lo..span.hi]);
        let (left, own, right) =
            (&h[span.lo - 1..span.hi - 1], &h[span.lo..span.hi], &h[span.lo + 1..=span.hi]);
        for x in 0..n {
            let all = own[x] + v[x] + d[x] + e[x];
            change[x] += 2 * all - left[x] - right[x];
        }
    }
    if any[rows[0]] {
        take_ends(change, span, lower, [-1, 1]);
    }
    if any[rows[2]] {
        take_ends(change, span, upper, [1, -1]);
    }
}

/// Subtracts the fluxes from the ends in a row to middles in an adjacent row; `shift` leads from an end to the middles
/// of the two diagonals.
#[inline(always)]
fn take_ends(change: &mut [i32], span: Span, fluxes: &[Vec<i32>], shift: [isize; 2]) {
    let [_, v, d, e] = fluxes else { return };
    let n = change.len();
    let from = |left: isize| span.lo.wrapping_add_signed(left);
    let (v, d, e) = (&v[span.lo..][..n], &d[from(shift[0])..][..n], &e[from(shift[1])..][..n]);
    for x in 0..n {
        change[x] -= v[x] + d[x] + e[x];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn curvature_is_odd_and_a_twenty_fourth(a in -1_000_000..1_000_000i32, m in -1_000_000..1_000_000i32, limit in 1..500_000i32) {
            let run = |a: i32, m: i32| {
                let (ends, middle, mut out) = ([a; 48], [m; 48], [0; 48]);
                triples([&ends, &middle, &ends], [-1, 1], [16, 32], limit, &mut out);
                out[20]
            };
            prop_assert_eq!(run(a, m), -run(-a, -m));
            let s = 2 * (i64::from(a) - i64::from(m));
            let exact = (s.abs() - i64::from(limit)).max(0) / 24;
            prop_assert!((i64::from(run(a, m)).abs() - exact).abs() <= 1, "{} {}", run(a, m), exact);
        }
    }
}
