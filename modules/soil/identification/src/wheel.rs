//! A soil from a wheel: sinkage and drawbar pull of a driven wheel over its slip, fitted by the integral of the stresses below
//! the rim with Bekker's pressure, Ding's slip sinkage and the shear between rim and soil.
//!
//! A few slips hardly determine six numbers, so each is held to where the search starts (a row of the soil table) as loosely
//! as such numbers are known (Tikhonov's regularisation), and the intervals show the contribution of the measured slips.

use crate::interval::{Interval, spread};
use crate::least_squares::{Free, least_squares};
use crate::rim::{Rim, Rolling};
use terraglue_soil_law::{Bekker, PressureLaw};

/// A wheel on a test bench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// Radius, m.
    pub radius: f64,
    /// Width, m.
    pub width: f64,
    /// Vertical load where the measurements do not contain it, N.
    pub load: Option<f64>,
}

/// Measurement at a slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelPoint {
    /// Slip 1 − v/(rω), from 0 to below 1.
    pub slip: f64,
    /// Vertical load, N.
    pub load: f64,
    /// Sinkage, m.
    pub sinkage: f64,
    /// Drawbar pull, N.
    pub pull: f64,
}

/// Properties of the soil that bound the search.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SoilBounds {
    /// Cohesion, Pa.
    pub c_pa: Option<f64>,
    /// Angle of internal friction, rad.
    pub phi_rad: Option<f64>,
}

/// Why no soil can be fitted to a wheel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WheelError {
    /// Fewer than two slips; so many there are.
    TooFew(usize),
    /// The integral carries the wheel on no soil.
    Carries,
}

impl std::fmt::Display for WheelError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooFew(count) => write!(f, "{count} slips of a driven wheel are too few: two at least"),
            Self::Carries => f.write_str("no soil carries this wheel"),
        }
    }
}

impl std::error::Error for WheelError {}

/// Points of the integrals.
const POINTS: usize = 100;
/// Uncertainty of measured means: sinkage 5 %, drawbar pull 2.8 % of the load.
const SCATTER: [f64; 2] = [0.05, 0.028];
/// ln k_φ, n_0, n_1 of Ding's slip sinkage, shear strength between rim and soil without pressure (Pa), tan of their angle of
/// friction, ln K.
type WheelNumbers = [f64; 6];
/// Prior width about the start.
const PRIOR: WheelNumbers = [3.0, 0.5, 0.6, 800.0, 0.3, 1.0];

/// Keys of a scenario, and their meanings.
const KEYS: [(&str, &str); 6] = [
    ("k_phi", "frictional modulus, N/m^(n+2); k_c = 0, one width does not tell it"),
    ("n", "exponent of a wheel without slip"),
    ("slip_sinkage_n1", "growth of the exponent with the slip"),
    ("interface_c_pa", "shear strength between rim and soil without pressure, Pa"),
    ("interface_phi_rad", "angle of friction between rim and soil, rad"),
    ("K_m", "shear deformation modulus, m"),
];

/// A number that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelNumber {
    /// Key of a scenario.
    pub key: &'static str,
    /// Value.
    pub value: f64,
    /// 95 % confidence; NaN: unknown.
    pub interval: Interval,
    /// Its description.
    pub help: &'static str,
}

/// A soil fitted to a wheel.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelFit {
    /// The wheel.
    pub wheel: Wheel,
    /// The numbers.
    pub numbers: Vec<WheelNumber>,
    /// Slips that were left out in turn for the intervals.
    pub groups: usize,
    at: WheelNumbers,
}

/// Start of the search, in addition to known properties of the soil: exponent and modulus k_φ of its row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelStart {
    /// Exponent.
    pub n: f64,
    /// k_φ, N/m^(n+2).
    pub k_phi: f64,
}

impl Default for WheelStart {
    /// Loose soil.
    fn default() -> Self {
        Self { n: 1.0, k_phi: 820e3 }
    }
}

/// Fits a soil to a wheel.
///
/// # Errors
/// Fewer than two slips.
pub fn fit_wheel(
    wheel: Wheel,
    points: &[WheelPoint],
    known: SoilBounds,
    start: WheelStart,
) -> Result<WheelFit, WheelError> {
    if points.len() < 2 {
        return Err(WheelError::TooFew(points.len()));
    }
    let begin: WheelNumbers = [start.k_phi.ln(), start.n, 0.3, 200.0, 0.4, 0.01f64.ln()];
    let low: WheelNumbers = [8.0, 0.1, 0.0, 0.0, 0.05, -6.9];
    let most = [known.c_pa.unwrap_or(1000.0).max(1.0), known.phi_rad.unwrap_or(0.7).tan().max(0.1)];
    let high: WheelNumbers = [20.0, 2.0, 1.5, most[0], most[1], -2.3];
    let free: Vec<Free> = (0..6).map(|k| Free { start: begin[k], min: low[k], max: high[k] }).collect();
    let solve = |points: &[WheelPoint], from: &[f64]| {
        let mut residuals = |x: &[f64]| Some(residuals(&wheel, &begin, x, points));
        least_squares(&mut residuals, &free, from).map(|least| least.numbers)
    };
    let found = solve(points, &begin).ok_or(WheelError::Carries)?;
    let answers: Vec<Vec<f64>> = (0..points.len())
        .filter_map(|left_out| {
            let rest: Vec<WheelPoint> =
                points.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, p)| *p).collect();
            solve(&rest, &found)
        })
        .collect();
    let at: WheelNumbers = std::array::from_fn(|k| found[k]);
    let numbers = spread(&answers, &at).into_iter().enumerate().map(|(k, interval)| {
        let (key, help) = KEYS[k];
        let ends = [interval.low.max(low[k]), interval.high.min(high[k])].map(|x| in_scenario(k, x));
        // a value that is not finite stays unknown
        let known = interval.low.is_finite() && interval.high.is_finite();
        let [low, high] = if known { ends } else { [f64::NAN; 2] };
        WheelNumber { key, value: in_scenario(k, at[k]), interval: Interval { low, high }, help }
    });
    Ok(WheelFit { wheel, numbers: numbers.collect(), groups: points.len(), at })
}

/// Number k as a scenario takes it.
fn in_scenario(k: usize, x: f64) -> f64 {
    match k {
        0 | 5 => x.exp(),
        4 => x.atan(),
        _ => x,
    }
}

fn rim(wheel: &Wheel, x: &[f64], slip: f64) -> Rim {
    Rim {
        radius: wheel.radius,
        width: wheel.width,
        modulus: x[0].exp(),
        n: x[1] + x[2] * slip.max(0.0),
        cohesion: x[3],
        friction: x[4],
        shear: x[5].exp(),
        peak: [0.0; 2],
        unloading: unloading(x[0].exp(), x[1]),
        points: POINTS,
    }
}

/// Default stiffness with which soil of this law springs back, Pa/m.
fn unloading(k_phi: f64, n: f64) -> f64 {
    // a built-in law always answers
    PressureLaw::Bekker(Bekker { k_c: 0.0, k_phi, n }).unloading().unwrap_or(f64::INFINITY)
}

/// Errors of the integral over their scatter, and how far the numbers are from the start.
fn residuals(wheel: &Wheel, begin: &WheelNumbers, x: &[f64], points: &[WheelPoint]) -> Vec<f64> {
    let mut all = Vec::with_capacity(2 * points.len() + 6);
    for p in points {
        let state = rim(wheel, x, p.slip).under(p.load, p.slip);
        all.push((state.sinkage / p.sinkage).ln() / SCATTER[0]);
        all.push((state.pull - p.pull) / (SCATTER[1] * p.load));
    }
    all.extend((0..6).map(|k| (x[k] - begin[k]) / PRIOR[k]));
    all
}

impl WheelFit {
    /// The wheel under `load` (N) at a slip.
    pub fn state(&self, slip: f64, load: f64) -> Rolling {
        rim(&self.wheel, &self.at, slip).under(load, slip)
    }

    /// Largest errors over points: of the sinkage (relative) and of the pull (N).
    pub fn errors(&self, points: &[WheelPoint]) -> [f64; 2] {
        points.iter().fold([0.0; 2], |[a, b], p| {
            let state = self.state(p.slip, p.load);
            [a.max((state.sinkage / p.sinkage - 1.0).abs()), b.max((state.pull - p.pull).abs())]
        })
    }

    /// The value of a key.
    pub fn value(&self, key: &str) -> f64 {
        self.numbers.iter().find(|n| n.key == key).map_or(f64::NAN, |n| n.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHEEL: Wheel = Wheel { radius: 0.058, width: 0.05, load: None };

    #[test]
    fn what_a_soil_has_done_to_a_wheel_is_found_again() {
        let known = SoilBounds { c_pa: Some(1000.0), phi_rad: Some(0.5) };
        let truth = [(2e6_f64).ln(), 1.2, 0.25, 300.0, 0.45, (0.012_f64).ln()];
        let slips = [0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9];
        let points: Vec<WheelPoint> = slips
            .iter()
            .map(|slip| {
                let state = rim(&WHEEL, &truth, *slip).under(25.0, *slip);
                WheelPoint { slip: *slip, load: 25.0, sinkage: state.sinkage, pull: state.pull }
            })
            .collect();
        let fit = fit_wheel(WHEEL, &points, known, WheelStart { n: 1.1, k_phi: 1e6 }).expect("fitted");
        let [sinkage, pull] = fit.errors(&points);
        // held to its start, the answer is not the truth, but does as the soil did
        assert!(sinkage < 0.01 && pull < 0.1, "{sinkage} {pull} {fit:?}");
        assert!((fit.value("n") - 1.2).abs() < 0.15 && fit.numbers.iter().all(|n| n.interval.low <= n.value));
        let one = fit_wheel(WHEEL, &points[..1], known, WheelStart::default());
        assert_eq!(one, Err(WheelError::TooFew(1)));
    }
}
