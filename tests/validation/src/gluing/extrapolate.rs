//! Richardson's extrapolation of runs with halved steps: the limit of a strategy and an integrator as h → 0.

use crate::process::Outcome;
use terraglue_numerics::extremes::larger;

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
            apart = a.iter().zip(b).fold(0.0_f64, |m, (a, b)| larger(m, (a - b).abs()));
        }
    }
    Ok(Limits { values: rows.pop().unwrap_or_default(), apart })
}

/// Times that differ by less are one, s.
const SAME_S: f64 = 1e-12;

/// A step near `wanted` of which all times are multiples; times of one batch of [`batches`].
pub fn common_step(times: &[f64], wanted: f64) -> f64 {
    let unit = common_unit(times).unwrap_or_else(|| times.iter().copied().fold(wanted, larger));
    unit / (unit / wanted).ceil().max(1.0)
}

/// The largest time of which all are multiples, where they are whole microseconds.
fn common_unit(times: &[f64]) -> Option<f64> {
    let mut unit: u64 = 0;
    for t in times {
        let micro = (t * 1e6).round();
        if (t - micro * 1e-6).abs() > SAME_S {
            return None;
        }
        let (mut a, mut b) = (unit, micro as u64);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        unit = a;
    }
    (unit > 0).then_some(unit as f64 * 1e-6)
}

/// Numbers of times that one run serves: those that have a unit of at least a millisecond in common. Any other time has
/// a run of its own, whose steps divide it.
pub fn batches(times: &[Option<f64>]) -> Vec<Vec<usize>> {
    let mut all: Vec<(Vec<usize>, Vec<f64>)> = Vec::new();
    for (k, t) in times.iter().enumerate() {
        let fits = |held: &[f64]| {
            let Some(t) = t else { return true };
            let together: Vec<f64> = held.iter().copied().chain([*t]).collect();
            held.iter().all(|h| (h - t).abs() <= SAME_S)
                || common_unit(&together).is_some_and(|unit| unit >= 0.999e-3)
        };
        match all.iter_mut().find(|(_, held)| fits(held)) {
            Some((rows, held)) => {
                rows.push(k);
                held.extend(t);
            }
            None => all.push((vec![k], t.iter().copied().collect())),
        }
    }
    all.into_iter().map(|(rows, _)| rows).collect()
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

    #[test]
    fn times_without_a_common_step_have_runs_of_their_own() {
        let times = [Some(0.1), Some(1.0 / 3.0), None, Some(0.7), Some(1.0 / 3.0), Some(0.0002)];
        assert_eq!(batches(&times), [vec![0, 2, 3], vec![1, 4], vec![5]]);
        for t in [1.0 / 3.0, 0.0002, 0.1] {
            let h = common_step(&[t, t], 0.01);
            assert!(h <= 0.01 && (steps_to(t, h) as f64 * h - t).abs() < 1e-15, "{h}");
        }
    }
}
