//! The numbers of any law fitted to plate tests: least squares of ln p within the range of each number, by the method of
//! Levenberg (1944, Quart. Appl. Math. 2) and Marquardt (1963, J. SIAM 11) with differences for derivatives.

use crate::interval::{Basis, Interval, jackknife};
use crate::plate_law::{FitError, Reading};

/// A number that is to be found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Free {
    /// Start of the search.
    pub start: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// Result of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct NumbersFit {
    /// The numbers in their order.
    pub numbers: Vec<f64>,
    /// 95 % confidence; NaN where the readings do not determine a number, which is left at its start then.
    pub intervals: Vec<Interval>,
    /// Basis of the intervals.
    pub basis: Basis,
    /// Root of the mean square of ln(p/p_measured).
    pub rms: f64,
}

/// Pressures (Pa) of a law with these numbers at the readings, in their order; `false`: it has no answer.
pub type Pressures<'a> = dyn FnMut(&[f64], &[Reading], &mut [f64]) -> bool + 'a;

/// Most steps of a search.
const STEPS: usize = 200;
/// Change of ln p by which a number is felt.
const FELT: f64 = 1e-7;
/// Relative gain below which the search ends.
const GAIN: f64 = 1e-13;

/// Finds the numbers.
///
/// # Errors
/// Too few readings.
pub fn fit_numbers(law: &mut Pressures, free: &[Free], readings: &[Reading]) -> Result<NumbersFit, FitError> {
    if readings.len() < 4.max(free.len()) {
        return Err(FitError::TooFew);
    }
    let start: Vec<f64> = free.iter().map(|f| f.start).collect();
    let mut from = |start: &[f64], readings: &[Reading]| {
        least_squares(&mut |x| logarithms(law, x, readings), free, start)
    };
    let Some(found) = from(&start, readings) else { return Err(FitError::TooFew) };
    let mut solve = |rest: &[Reading]| from(&found.numbers, rest).map(|f| f.numbers);
    let (mut intervals, basis) = jackknife(readings, &mut solve, &found.numbers);
    for (interval, _) in intervals.iter_mut().zip(&found.felt).filter(|(_, felt)| !**felt) {
        *interval = Interval { low: f64::NAN, high: f64::NAN };
    }
    let rms = (found.squares / readings.len() as f64).sqrt();
    Ok(NumbersFit { numbers: found.numbers, intervals, basis, rms })
}

/// ln(p/p_measured) of every reading; None: a pressure is none.
fn logarithms(law: &mut Pressures, x: &[f64], readings: &[Reading]) -> Option<Vec<f64>> {
    let mut p = vec![f64::NAN; readings.len()];
    let good = law(x, readings, &mut p) && p.iter().all(|p| *p > 0.0 && p.is_finite());
    let each = |(p, r): (&f64, &Reading)| libm::log(p / r.pressure);
    good.then(|| p.iter().zip(readings).map(each).collect())
}

/// Result of least squares.
#[derive(Clone, Debug, PartialEq)]
pub struct Least {
    /// The numbers in their order.
    pub numbers: Vec<f64>,
    /// Whether the residuals depend on each of them; the others are left at their start.
    pub felt: Vec<bool>,
    /// Sum of the squares of the residuals.
    pub squares: f64,
}

/// Residuals with these numbers; None: there are none.
pub type Residuals<'a> = dyn FnMut(&[f64]) -> Option<Vec<f64>> + 'a;

/// The numbers with the least squares of residuals, each within its range, sought from `start`; None: there are no residuals
/// there.
pub fn least_squares(residuals: &mut Residuals, free: &[Free], start: &[f64]) -> Option<Least> {
    let start: Vec<f64> = start.iter().zip(free).map(|(x, f)| x.clamp(f.min, f.max)).collect();
    Search { residuals, free }.from(&start)
}

struct Search<'a, 'b> {
    residuals: &'a mut Residuals<'b>,
    free: &'a [Free],
}

impl Search<'_, '_> {
    /// The derivative of the residuals `r` by number k; None: it is not felt.
    fn column(&mut self, x: &[f64], k: usize, r: &[f64]) -> Option<Vec<f64>> {
        let range = self.free[k];
        let mut step = 1e-7 * x[k].abs().max(1e-3);
        while step < 1e9 {
            for signed in [step, -step] {
                let mut moved = x.to_vec();
                moved[k] += signed;
                if moved[k] > range.max || moved[k] < range.min {
                    continue;
                }
                let Some(there) = (self.residuals)(&moved) else { continue };
                let taken = moved[k] - x[k];
                if there.iter().zip(r).any(|(a, b)| (a - b).abs() > FELT) {
                    return Some(there.iter().zip(r).map(|(a, b)| (a - b) / taken).collect());
                }
            }
            step *= 10.0;
        }
        None
    }

    fn from(&mut self, start: &[f64]) -> Option<Least> {
        let n = start.len();
        let mut x = start.to_vec();
        let mut r = (self.residuals)(&x)?;
        let mut squares = sum_of_squares(&r);
        let (mut damping, mut felt) = (1e-3, vec![false; n]);
        for _ in 0..STEPS {
            let columns: Vec<Option<Vec<f64>>> = (0..n).map(|k| self.column(&x, k, &r)).collect();
            felt.iter_mut().zip(&columns).for_each(|(felt, c)| *felt |= c.is_some());
            let slope = |c: &Vec<f64>| c.iter().zip(&r).map(|(c, r)| c * r).sum::<f64>();
            // a number at its bound that would go beyond it stays
            let stays =
                |k: usize, g: f64| x[k] <= self.free[k].min && g > 0.0 || x[k] >= self.free[k].max && g < 0.0;
            let moving: Vec<(usize, &Vec<f64>, f64)> = columns
                .iter()
                .enumerate()
                .filter_map(|(k, c)| c.as_ref().map(|c| (k, c, slope(c))))
                .filter(|(k, _, g)| !stays(*k, *g))
                .collect();
            let Some((next, there)) = self.step(&x, &moving, squares, &mut damping) else { break };
            let now = sum_of_squares(&there);
            let gain = squares - now;
            (x, r, squares) = (next, there, now);
            if gain <= GAIN * squares || squares <= 1e-26 {
                break;
            }
        }
        Some(Least { numbers: x, felt, squares })
    }

    /// A step that makes the squares smaller; None: there is none.
    fn step(
        &mut self,
        x: &[f64],
        moving: &[(usize, &Vec<f64>, f64)],
        squares: f64,
        damping: &mut f64,
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let m = moving.len();
        if m == 0 {
            return None;
        }
        for _ in 0..30 {
            // rows of the normal equations with their right side
            let mut rows: Vec<Vec<f64>> = moving
                .iter()
                .map(|(_, a, g)| {
                    let dot = |(_, b, _): &(usize, &Vec<f64>, f64)| {
                        a.iter().zip(b.iter()).map(|(a, b)| a * b).sum()
                    };
                    moving.iter().map(dot).chain([-g]).collect()
                })
                .collect();
            (0..m).for_each(|k| rows[k][k] *= 1.0 + *damping);
            if let Some(change) = solved(&mut rows) {
                let mut next = x.to_vec();
                for ((k, ..), change) in moving.iter().zip(change) {
                    next[*k] = (next[*k] + change).clamp(self.free[*k].min, self.free[*k].max);
                }
                if let Some(there) = (self.residuals)(&next)
                    && sum_of_squares(&there) < squares
                {
                    *damping = (*damping * 0.2).max(1e-12);
                    return Some((next, there));
                }
            }
            *damping *= 5.0;
        }
        None
    }
}

fn sum_of_squares(r: &[f64]) -> f64 {
    r.iter().map(|r| r * r).sum()
}

/// Elimination with pivots, rows scaled by their diagonal; the right side stands last.
fn solved(rows: &mut [Vec<f64>]) -> Option<Vec<f64>> {
    let n = rows.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs()))?;
        rows.swap(k, pivot);
        if rows[k][k] == 0.0 || !rows[k][k].is_finite() {
            return None;
        }
        let (head, below) = rows.split_at_mut(k + 1);
        for row in below {
            let factor = row[k] / head[k][k];
            row.iter_mut().zip(&head[k]).skip(k).for_each(|(a, b)| *a -= factor * b);
        }
    }
    let mut x = vec![0.0; n];
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|j| rows[k][j] * x[j]).sum();
        x[k] = (rows[k][n] - rest) / rows[k][k];
    }
    x.iter().all(|x| x.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// p = (A/b + B)·zⁿ·(1 + z/Z); the fifth number is not felt.
    fn stiffening(x: &[f64], readings: &[Reading], p: &mut [f64]) -> bool {
        for (r, p) in readings.iter().zip(p) {
            *p = (x[0] / r.b + x[1]) * libm::pow(r.depth, x[2]) * (1.0 + r.depth / x[3]);
        }
        true
    }

    #[test]
    fn what_a_law_has_drawn_is_found_again_and_what_is_not_felt_stays() {
        let truth = [2.4e4, 9.1e5, 0.83, 0.06, 7.0];
        let reading = |k: u32| Reading {
            curve: (k % 6) as usize,
            b: [0.03, 0.05, 0.1][(k % 3) as usize],
            depth: 1e-3 * f64::from(3 + k / 3),
            pressure: 1.0,
        };
        let mut readings: Vec<Reading> = (0..120).map(reading).collect();
        let mut p = vec![0.0; readings.len()];
        stiffening(&truth, &readings, &mut p);
        readings.iter_mut().zip(&p).for_each(|(r, p)| r.pressure = *p);
        let free = |start, min, max| Free { start, min, max };
        let free = [
            free(0.0, 0.0, f64::INFINITY),
            free(820e3, 0.0, f64::INFINITY),
            free(1.0, 0.3, 2.0),
            free(0.1, 0.01, 1.0),
            free(3.0, 0.0, 9.0),
        ];
        let found = fit_numbers(&mut stiffening, &free, &readings).expect("enough readings");
        for k in 0..4 {
            assert!((found.numbers[k] / truth[k] - 1.0).abs() < 1e-4, "{k}: {found:?}");
        }
        assert!(found.rms < 1e-6 && found.basis == Basis::Curves(6), "{found:?}");
        assert_eq!(found.numbers[4], 3.0);
        assert!(found.intervals[4].low.is_nan());
    }

    #[test]
    fn a_number_ends_at_its_bound() {
        let readings: Vec<Reading> = (3..40)
            .map(|k| Reading {
                curve: k % 4,
                b: 0.05,
                depth: 1e-3 * k as f64,
                pressure: 5e5 * 1e-3 * k as f64,
            })
            .collect();
        let mut linear = |x: &[f64], readings: &[Reading], p: &mut [f64]| {
            readings.iter().zip(p).for_each(|(r, p)| *p = x[0] * r.depth);
            true
        };
        let free = [Free { start: 1e6, min: 6e5, max: 2e6 }];
        let found = fit_numbers(&mut linear, &free, &readings).expect("enough readings");
        assert_eq!(found.numbers[0], 6e5);
        assert_eq!(fit_numbers(&mut linear, &free, &readings[..3]), Err(FitError::TooFew));
    }
}
