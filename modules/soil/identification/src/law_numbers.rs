//! The numbers of a law that is a module, from its schema, and its pressures at readings.

use crate::least_squares::Free;
use crate::plate_law::Reading;
use terraglue_subsystem::{NodeLaw, Parameter, PressureAnswer, PressureNodes, Result};

/// Numbers to start from where a schema gives none: a loose soil.
const TYPICAL: [(&str, f64); 3] = [("n", 1.0), ("k_c", 1400.0), ("k_phi", 820e3)];

/// Start of the search for a number: its default, else a typical value, else the middle of its range.
pub fn start(p: &Parameter) -> f64 {
    let typical = TYPICAL.iter().find(|(name, _)| *name == p.name).map(|(_, x)| *x);
    let middle = match (p.min, p.max) {
        (Some(a), Some(b)) => 0.5 * (a + b),
        (Some(a), None) => a + 1.0,
        (None, Some(b)) => b - 1.0,
        (None, None) => 1.0,
    };
    p.default.as_f64().or(typical).unwrap_or(middle)
}

/// A number that is sought from `start` within the range of its parameter.
pub fn range(p: &Parameter, start: f64) -> Free {
    let min = p.min.unwrap_or(f64::NEG_INFINITY);
    // "above" is open: the smallest number that differs
    let min = if p.above_min { min + 1e-9 * min.abs().max(1e-3) } else { min };
    Free { start, min, max: p.max.unwrap_or(f64::INFINITY) }
}

/// A law with its numbers, seen from plate tests.
pub struct LawNumbers<'a>(pub &'a dyn NodeLaw);

impl LawNumbers<'_> {
    /// Pressures (Pa) of first loading at the readings, those of one size at once.
    ///
    /// # Errors
    /// That of the law.
    pub fn pressures(&self, readings: &[Reading], out: &mut [f64]) -> Result {
        let mut first = 0;
        while first < readings.len() {
            let b = readings[first].b;
            let count = readings[first..].iter().take_while(|r| r.b == b).count();
            let depth: Vec<f64> = readings[first..first + count].iter().map(|r| r.depth).collect();
            self.of_one_size(b, &depth, &mut out[first..first + count])?;
            first += count;
        }
        Ok(())
    }

    fn of_one_size(&self, b: f64, depth: &[f64], pressure: &mut [f64]) -> Result {
        let (count, doubles) = (depth.len(), self.0.state_doubles());
        let kept = if doubles > 0 { count } else { 0 };
        let states = vec![0.0; count * doubles];
        let (zero, mut slope) = (vec![0.0; kept], vec![0.0; count]);
        let (mut permanent, mut state) = (zero.clone(), states.clone());
        let nodes = PressureNodes { b, h: 1.0, depth, permanent: &zero, slip: &zero, state: &states };
        let (slope, permanent, state) = (&mut slope[..], &mut permanent[..], &mut state[..]);
        let mut answer = PressureAnswer { pressure, slope, permanent, state, longest_s: f64::INFINITY };
        self.0.pressure(&nodes, &mut answer)
    }

    /// Pressure (Pa) of first loading under a contact of size `b` (m) at `depth` (m); NaN where the law has no answer.
    pub fn pressure(&self, b: f64, depth: f64) -> f64 {
        let mut out = [f64::NAN];
        match self.pressures(&[Reading { curve: 0, b, depth, pressure: 1.0 }], &mut out) {
            Ok(()) => out[0],
            Err(_) => f64::NAN,
        }
    }

    /// Root of the mean square of ln(p/p_measured) over readings; NaN where the law has no answer.
    pub fn rms(&self, readings: &[Reading]) -> f64 {
        let mut p = vec![f64::NAN; readings.len()];
        if self.pressures(readings, &mut p).is_err() {
            return f64::NAN;
        }
        let square = |(p, r): (&f64, &Reading)| (p / r.pressure).ln().powi(2);
        (p.iter().zip(readings).map(square).sum::<f64>() / p.len() as f64).sqrt()
    }
}
