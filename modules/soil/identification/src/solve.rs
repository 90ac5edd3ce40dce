//! Least squares of ln p = ln m + ln(λ·u/u_0 + (1 − λ)·w/w_0) + n·ln x: for a share λ of the cohesive factor the rest
//! is a straight line, so only λ in 0 … 1 is searched.

use crate::plate_law::{FitError, FitLaw, PlateNumbers, Reading};

/// Points of the coarse search for λ, and halvings of the interval around the best one.
const COARSE: u32 = 64;
const GOLDEN_STEPS: u32 = 80;
/// Smallest spread of ln x that determines an exponent.
const SPREAD: f64 = 1e-9;

/// One reading as the fit sees it: u/u_0, w/w_0, ln x and ln p.
type Sample = [f64; 4];

/// The best numbers; `both`: A may differ from 0.
pub fn solve(law: &FitLaw, readings: &[Reading], both: bool) -> Result<PlateNumbers, FitError> {
    if readings.len() < 4 {
        return Err(FitError::TooFew);
    }
    let mean = |pick: fn([f64; 3]) -> f64| {
        readings.iter().map(|r| pick(law.terms(r.b, r.depth))).sum::<f64>() / readings.len() as f64
    };
    let scale = [mean(|t| t[0]), mean(|t| t[1])];
    let rows: Vec<Sample> = readings
        .iter()
        .map(|r| {
            let [u, w, x] = law.terms(r.b, r.depth);
            [u / scale[0], w / scale[1], x, libm::log(r.pressure)]
        })
        .collect();
    let share = if both { best_share(&rows) } else { 0.0 };
    let line = Line::through(&rows, share).ok_or(FitError::OneDepth)?;
    let modulus = libm::exp(line.offset);
    Ok(PlateNumbers {
        cohesive: modulus * share / scale[0],
        frictional: modulus * (1.0 - share) / scale[1],
        n: line.slope,
    })
}

/// λ with the least squares, by a coarse search and golden sections around its best point.
fn best_share(rows: &[Sample]) -> f64 {
    let error = |share: f64| Line::through(rows, share).map_or(f64::INFINITY, |l| l.squares);
    let at = |k: u32| f64::from(k) / f64::from(COARSE);
    let best = (0..=COARSE).min_by(|a, b| error(at(*a)).total_cmp(&error(at(*b)))).unwrap_or(0);
    let (mut low, mut high) = (at(best.saturating_sub(1)), at((best + 1).min(COARSE)));
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..GOLDEN_STEPS {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if error(a) <= error(b) { high = b } else { low = a }
    }
    let inside = 0.5 * (low + high);
    [0.0, 1.0].into_iter().find(|end| error(*end) <= error(inside)).unwrap_or(inside)
}

/// ln p − ln(…) = offset + slope·ln x.
struct Line {
    offset: f64,
    slope: f64,
    squares: f64,
}

impl Line {
    fn through(rows: &[Sample], share: f64) -> Option<Self> {
        let y = |r: &Sample| r[3] - libm::log(share * r[0] + (1.0 - share) * r[1]);
        let count = rows.len() as f64;
        let (x_0, y_0) = rows.iter().fold((0.0, 0.0), |(a, b), r| (a + r[2] / count, b + y(r) / count));
        let (xx, xy) = rows.iter().fold((0.0, 0.0), |(xx, xy), r| {
            let d = r[2] - x_0;
            (xx + d * d, xy + d * (y(r) - y_0))
        });
        if xx < SPREAD {
            return None;
        }
        let slope = xy / xx;
        let offset = y_0 - slope * x_0;
        let squares = rows.iter().map(|r| (y(r) - offset - slope * r[2]).powi(2)).sum();
        Some(Self { offset, slope, squares })
    }
}
