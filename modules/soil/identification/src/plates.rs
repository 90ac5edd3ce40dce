//! Pressure laws fitted to plate tests: least squares of ln p, with confidence intervals.
//!
//! Pressure over sinkage spans decades and its scatter grows with it, so the error of a fit is the root of the mean
//! square of ln(p/p_measured), as Wong (1980, J. Terramechanics 17) weights his fits. The laws are those of [`FitLaw`].

use crate::interval::{self, Basis, Interval};
use crate::plate_law::{FitError, FitLaw, PlateNumbers, Reading};
use crate::solve;

/// A fitted law.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The law.
    pub law: FitLaw,
    /// Its numbers.
    pub numbers: PlateNumbers,
    /// 95 % confidence intervals of A, B and n.
    pub intervals: [Interval; 3],
    /// Basis of the intervals.
    pub basis: Basis,
    /// Root of the mean square of ln(p/p_measured) over the readings.
    pub rms: f64,
    /// Whether the readings hold one size only, so that A is set to 0.
    pub one_size: bool,
}

/// Fits `law` to the readings. With `cohesion` false, or where all readings have one size, A = 0.
///
/// # Errors
/// [`FitError`]: readings from which the parameters cannot be found.
pub fn fit(law: FitLaw, readings: &[Reading], cohesion: bool) -> Result<Fit, FitError> {
    let first = readings.first().ok_or(FitError::TooFew)?;
    let one_size = readings.iter().all(|r| (r.b / first.b - 1.0).abs() < 1e-6);
    let both = cohesion && !one_size;
    let numbers = solve::solve(&law, readings, both)?;
    if numbers.n <= 0.0 {
        return Err(FitError::Falls);
    }
    let (intervals, basis) = interval::intervals(&law, readings, both, &numbers);
    Ok(Fit { law, numbers, intervals, basis, rms: numbers.rms(&law, readings), one_size })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Curves of a law, each scaled by its own factor, as trials scatter.
    fn curves(law: FitLaw, numbers: PlateNumbers, factors: &[f64]) -> Vec<Reading> {
        let mut all = Vec::new();
        for (curve, factor) in factors.iter().enumerate() {
            let b = [0.03, 0.05][curve % 2];
            for k in 3..30 {
                let depth = 1e-3 * f64::from(k);
                let pressure = factor * libm::exp(numbers.ln_pressure(&law, b, depth));
                all.push(Reading { curve, b, depth, pressure });
            }
        }
        all
    }

    const LAWS: [FitLaw; 3] = [FitLaw::Bekker, FitLaw::Reece, FitLaw::Bearing { reference: 0.1 }];

    #[test]
    fn what_a_law_has_drawn_is_found_again() {
        for law in LAWS {
            let numbers = PlateNumbers { cohesive: 4.2e4, frictional: 1.3e6, n: 0.87 };
            let found = fit(law, &curves(law, numbers, &[1.0; 4]), true).unwrap();
            let relative = |a: f64, b: f64| (a / b - 1.0).abs();
            assert!(relative(found.numbers.cohesive, numbers.cohesive) < 1e-6, "{law:?} {found:?}");
            assert!(relative(found.numbers.frictional, numbers.frictional) < 1e-6, "{law:?} {found:?}");
            assert!(relative(found.numbers.n, numbers.n) < 1e-8 && found.rms < 1e-8, "{law:?} {found:?}");
        }
    }

    #[test]
    fn trials_that_scatter_widen_the_intervals_and_they_hold_the_truth() {
        let law = FitLaw::Bearing { reference: 0.1 };
        let numbers = PlateNumbers { cohesive: 3e4, frictional: 6e6, n: 1.3 };
        let narrow = fit(law, &curves(law, numbers, &[1.01, 0.99, 0.99, 1.01, 1.0, 1.0]), true).unwrap();
        let wide = fit(law, &curves(law, numbers, &[1.1, 0.92, 0.9, 1.08, 1.0, 0.97]), true).unwrap();
        let width = |f: &Fit| f.intervals[1].high - f.intervals[1].low;
        assert!(width(&wide) > 5.0 * width(&narrow) && width(&narrow) > 0.0);
        for f in [narrow, wide] {
            assert_eq!(f.basis, Basis::Curves(6));
            assert!(f.intervals[1].low < 6e6 && 6e6 < f.intervals[1].high, "{f:?}");
        }
    }

    #[test]
    fn factors_are_never_negative_and_one_size_cannot_tell_them_apart() {
        // pressure falls faster with 1/size than the cohesive term alone can follow
        let law = FitLaw::Bekker;
        let mut readings = curves(law, PlateNumbers { cohesive: 0.0, frictional: 1e6, n: 1.0 }, &[1.0, 2.0]);
        let found = fit(law, &readings, true).unwrap();
        assert_eq!(found.numbers.cohesive, 0.0);
        assert!(found.rms > 0.3);
        readings.retain(|r| r.curve == 0);
        let single = fit(law, &readings, true).unwrap();
        assert!(single.one_size && single.numbers.cohesive == 0.0 && single.rms < 1e-12);
    }

    #[test]
    fn too_little_is_refused() {
        let reading = Reading { curve: 0, b: 0.03, depth: 0.01, pressure: 1e4 };
        assert_eq!(fit(FitLaw::Bekker, &[], true), Err(FitError::TooFew));
        assert_eq!(fit(FitLaw::Bekker, &[reading; 3], true), Err(FitError::TooFew));
        assert_eq!(fit(FitLaw::Bekker, &[reading; 9], true), Err(FitError::OneDepth));
    }

    #[test]
    fn a_pressure_that_falls_with_the_depth_is_refused() {
        let reading =
            |k: i32| Reading { curve: 0, b: 0.03, depth: 1e-3 * f64::from(k), pressure: 1e3 / f64::from(k) };
        let readings: Vec<Reading> = (3..30).map(reading).collect();
        for law in LAWS {
            assert_eq!(fit(law, &readings, true), Err(FitError::Falls));
        }
    }
}
