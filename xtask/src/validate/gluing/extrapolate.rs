//! Richardson's extrapolation of runs with halved steps: what a strategy and an integrator tend to as h → 0.

use crate::process::Outcome;

/// Limits of several quantities, and how far the last two estimates lie apart.
pub struct Limits {
    /// One per quantity.
    pub values: Vec<f64>,
    /// Largest difference of the last two estimates.
    pub apart: f64,
}

/// `run(h)` answers the quantities; their error has the powers of h in `powers`, one halving each.
pub fn extrapolate(h: f64, powers: &[i32], run: impl Fn(f64) -> Outcome<Vec<f64>>) -> Outcome<Limits> {
    let mut rows = Vec::new();
    for level in 0..=powers.len() {
        rows.push(run(h / f64::from(1u32 << level))?);
    }
    let mut apart = f64::INFINITY;
    for power in powers {
        let share = 1.0 / (2f64.powi(*power) - 1.0);
        rows = rows
            .windows(2)
            .map(|w| w[0].iter().zip(&w[1]).map(|(coarse, fine)| fine + share * (fine - coarse)).collect())
            .collect();
        if let [.., a, b] = rows.as_slice() {
            apart = a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        }
    }
    Ok(Limits { values: rows.pop().unwrap_or_default(), apart })
}

/// A step near `wanted` of which all times are multiples.
pub fn common_step(times: &[f64], wanted: f64) -> f64 {
    let mut unit: u64 = 0;
    for t in times {
        let (mut a, mut b) = (unit, (t * 1e6).round() as u64);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        unit = a;
    }
    let unit = unit.max(1) as f64 * 1e-6;
    unit / (unit / wanted).ceil().max(1.0)
}

/// How many steps lead to t.
pub fn steps_to(t: f64, h: f64) -> u64 {
    (t / h).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_error_goes_away() {
        let run = |h: f64| Ok(vec![1.0 + 3.0 * h * h - 2.0 * h * h * h, 2.0 - h * h]);
        let limits = extrapolate(0.1, &[2, 3], run).expect("runs");
        assert!((limits.values[0] - 1.0).abs() < 1e-14 && (limits.values[1] - 2.0).abs() < 1e-14);
        let h = common_step(&[0.25, 0.5, 2.0], 0.01);
        assert!((h - 0.01).abs() < 1e-15);
        assert_eq!(steps_to(2.0, h), 200);
    }
}
