//! Numbers of a row of nodes, sixteen at a time, in a form that compilers turn into vector instructions.
//!
//! Every number is computed for itself with IEEE operations, so the width of the vectors cannot be seen. Single
//! precision carries the differences of neighbours: exact to 4 m, and both sides of a face compute the same number.

/// Nodes that are computed together.
pub const LANES: usize = 16;
/// Largest flux of a sweep, units (0.95 m).
const LARGEST: f32 = 4e6;
/// 2²³: adding it leaves the nearest whole number in the low bits.
const WHOLE: f32 = 8_388_608.0;

/// Numbers that are computed together.
pub type Lanes<T> = [T; LANES];

/// The numbers of a row from `at` on.
#[inline(always)]
pub fn lanes(row: &[i32], at: usize) -> Lanes<i32> {
    let mut out = [0; LANES];
    out.copy_from_slice(&row[at..at + LANES]);
    out
}

/// A magnitude (≥ 0) rounded down to whole units, with the sign of `direction`.
#[inline(always)]
pub fn whole(magnitude: f32, direction: i32) -> i32 {
    let bits = ((magnitude.min(LARGEST) - 0.5).max(0.0) + WHOLE).to_bits() as i32 - WHOLE.to_bits() as i32;
    let sign = direction >> 31;
    (bits ^ sign).wrapping_sub(sign)
}
