//! Confidence intervals of a fit. The readings of one press are no independent numbers: they err together. So whole
//! curves are left out in turn (jackknife over groups; Efron and Tibshirani 1993, An Introduction to the
//! Bootstrap, ch. 11) and the spread of the answers shows how well the numbers are known.

use crate::plate_law::{FitLaw, PlateNumbers, Reading};
use crate::{solve::solve, student};

/// Probability that the interval holds the number.
const CONFIDENCE: f64 = 0.95;
/// Pieces of each curve where there are fewer than three curves.
const PIECES: usize = 5;

/// An interval; NaN ends: unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Basis of intervals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// Whole curves were left out in turn, as many as there are.
    Curves(usize),
    /// There are fewer than three curves: pieces of them were left out, so many. How presses differ remains unknown,
    /// and the intervals are too narrow.
    Pieces(usize),
}

/// Intervals of A, B and n.
pub fn intervals(
    law: &FitLaw,
    readings: &[Reading],
    both: bool,
    at: &PlateNumbers,
) -> ([Interval; 3], Basis) {
    let of = |n: PlateNumbers| vec![n.cohesive, n.frictional, n.n];
    let mut answer = |rest: &[Reading]| solve(law, rest, both).ok().map(of);
    let (found, basis) = jackknife(readings, &mut answer, &of(*at));
    let unknown = Interval { low: f64::NAN, high: f64::NAN };
    let mut all = [unknown; 3];
    for (all, found) in all.iter_mut().zip(found).filter(|(_, found)| !found.low.is_nan()) {
        *all = Interval { low: found.low.max(0.0), ..found };
    }
    (all, basis)
}

/// Intervals of the numbers `at` that `answer` finds: it is called again with whole curves, or pieces of them, left out.
pub(crate) fn jackknife(
    readings: &[Reading],
    answer: &mut dyn FnMut(&[Reading]) -> Option<Vec<f64>>,
    at: &[f64],
) -> (Vec<Interval>, Basis) {
    let curves = groups(readings.iter().map(|r| r.curve).collect());
    let (group_of, basis) = if curves.count >= 3 {
        let basis = Basis::Curves(curves.count);
        (curves, basis)
    } else {
        let pieces = groups(pieces(readings));
        let basis = Basis::Pieces(pieces.count);
        (pieces, basis)
    };
    let answers: Vec<Vec<f64>> = (0..group_of.count)
        .filter_map(|left_out| {
            let rest = readings.iter().zip(&group_of.of).filter(|(_, g)| **g != left_out);
            answer(&rest.map(|(r, _)| *r).collect::<Vec<_>>())
        })
        .collect();
    (spread(&answers, at), basis)
}

/// Intervals of the numbers `at` from the answers that were found with one group of readings left out each.
pub fn spread(answers: &[Vec<f64>], at: &[f64]) -> Vec<Interval> {
    let of = |k: usize| interval(&answers.iter().map(|a| a[k]).collect::<Vec<_>>(), at[k]);
    (0..at.len()).map(of).collect()
}

fn interval(answers: &[f64], at: f64) -> Interval {
    let count = answers.len() as f64;
    if answers.len() < 2 {
        return Interval { low: f64::NAN, high: f64::NAN };
    }
    let mean = answers.iter().sum::<f64>() / count;
    let squares: f64 = answers.iter().map(|a| (a - mean) * (a - mean)).sum();
    let error = ((count - 1.0) / count * squares).sqrt();
    let half = student::quantile(0.5 + 0.5 * CONFIDENCE, count - 1.0) * error;
    Interval { low: at - half, high: at + half }
}

struct Groups {
    /// Number of the group of each reading.
    of: Vec<usize>,
    count: usize,
}

/// Groups numbered from 0 in the order of their labels.
fn groups(labels: Vec<usize>) -> Groups {
    let mut known = labels.clone();
    known.sort_unstable();
    known.dedup();
    let of = labels.iter().map(|l| known.binary_search(l).unwrap_or(0)).collect();
    Groups { of, count: known.len() }
}

/// Labels of pieces of curves, each in the order of its readings.
fn pieces(readings: &[Reading]) -> Vec<usize> {
    let length = |curve: usize| readings.iter().filter(|r| r.curve == curve).count();
    let mut seen: Vec<(usize, usize)> = Vec::new();
    readings
        .iter()
        .map(|r| {
            let place = seen.iter().position(|(curve, _)| *curve == r.curve).unwrap_or_else(|| {
                seen.push((r.curve, 0));
                seen.len() - 1
            });
            let number = seen[place].1;
            seen[place].1 += 1;
            PIECES * place + number * PIECES / length(r.curve)
        })
        .collect()
}
