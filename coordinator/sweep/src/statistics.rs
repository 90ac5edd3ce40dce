//! Means and shares with their confidence intervals.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Confidence of all intervals.
pub(crate) const CONFIDENCE: f64 = 0.95;

/// A mean with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampled {
    /// Number of values.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Lower end of the 95 % interval of the mean, by Student's t (1908); −∞ for a single value.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Sampled {
    /// Of values in any order; none of no finite value.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut values: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        // the sum does not depend on the order in which cases ended
        values.sort_by(f64::total_cmp);
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        if count == 0 {
            return None;
        }
        let square: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
        let half = match StudentsT::new(0.0, 1.0, count as f64 - 1.0) {
            Ok(t) if count > 1 => {
                t.inverse_cdf(0.5 + 0.5 * CONFIDENCE) * (square / (count - 1) as f64 / count as f64).sqrt()
            }
            _ => f64::INFINITY,
        };
        Some(Self { count, mean, low: mean - half, high: mean + half })
    }
}

/// A share of runs with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted {
    /// Share of the runs.
    pub share: f64,
    /// Lower end of its 95 % interval (Wilson, 1927).
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Counted {
    /// Of `n` runs, `k` of which are of the kind that is counted.
    pub fn of(k: usize, n: usize) -> Self {
        let z =
            Normal::new(0.0, 1.0).map_or(1.959_963_985, |normal| normal.inverse_cdf(0.5 + 0.5 * CONFIDENCE));
        let (n, p) = (n.max(1) as f64, k as f64 / n.max(1) as f64);
        let centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        Self { share: p, low: (centre - half).max(0.0), high: (centre + half).min(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_the_tables() {
        // t of 3 degrees of freedom at 0.975: 3.18245
        let four = Sampled::of(&[1.0, 2.0, 3.0, 4.0]).expect("four values");
        let deviation = (5.0_f64 / 3.0).sqrt();
        assert!((four.high - four.mean - 3.182_446 * deviation / 2.0).abs() < 1e-5);
        assert_eq!(Sampled::of(&[2.0]).map(|s| (s.mean, s.low)), Some((2.0, f64::NEG_INFINITY)));
        assert_eq!(Sampled::of(&[f64::NAN]), None);
        // Wilson's interval of 1 of 10: 0.0179 to 0.4042
        let tenth = Counted::of(1, 10);
        assert!((tenth.low - 0.017_88).abs() < 1e-4 && (tenth.high - 0.404_15).abs() < 1e-4);
        assert!(Counted::of(0, 5).low < 1e-12);
    }

    #[test]
    fn ninety_five_of_a_hundred_intervals_hold_the_mean() {
        let mut random = terraglue_numerics::random::Random::new(5);
        let mut inside = 0;
        for _ in 0..2000 {
            let values: Vec<f64> = (0..6).map(|_| 3.0 + random.normal()).collect();
            let mean = Sampled::of(&values).expect("six values");
            inside += usize::from(mean.low <= 3.0 && 3.0 <= mean.high);
        }
        let expected = Counted::of(inside, 2000);
        assert!(expected.low < 0.95 && 0.95 < expected.high, "{inside} of 2000");
    }
}
