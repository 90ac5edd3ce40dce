//! A law that is a module, fitted to plate tests: the numbers of its schema, each within its range.

use super::{Known, PlateTests};
use std::path::Path;
use std::sync::Arc;
use terraglue_host::{HostServices, LoadError, LoadedModule, SearchPath, law};
use terraglue_scenario::InputError;
use terraglue_soil_law::fit::{Basis, FitError, FitLaw, Free, Interval, Reading, fit, fit_numbers};
use terraglue_subsystem::{NodeLaw, Parameter, PressureAnswer, PressureNodes};

/// A number of the law.
#[derive(Clone, Debug, PartialEq)]
pub struct LawNumber {
    /// Its name in the schema.
    pub name: String,
    /// What it is.
    pub help: String,
    /// Value.
    pub value: f64,
    /// 95 % confidence, NaN: unknown; None: it was given, or plates do not tell it.
    pub interval: Option<Interval>,
}

/// A law that is a module, fitted.
pub struct LawFit {
    /// Name of the law.
    pub name: String,
    /// As a scenario names it.
    pub plugin: String,
    /// All its numbers.
    pub numbers: Vec<LawNumber>,
    /// Root of the mean square of ln(p/p_measured).
    pub rms: f64,
    /// What the intervals rest on.
    pub basis: Basis,
    law: Arc<dyn NodeLaw>,
}

/// Numbers to start from where a schema gives none: a loose soil.
const TYPICAL: [(&str, f64); 3] = [("n", 1.0), ("k_c", 1400.0), ("k_phi", 820e3)];

/// Fits the law that `plugin` names, as `[soil.law] plugin` of a scenario in this folder would.
///
/// # Errors
/// It is not found or no law with a pressure function, or the readings are too few.
pub fn fit_module(plugin: &str, tests: &PlateTests, known: Known) -> Result<LawFit, Box<InputError>> {
    let plain = |text: String| InputError::plain(text, None);
    if fit(FitLaw::Bekker, &tests.readings, false).is_err_and(|e| e == FitError::Falls) {
        return Err(super::refused(FitError::Falls));
    }
    let search = SearchPath::standard(&[], Path::new("."));
    let missing = |e: LoadError| plain(format!("--law {plugin}: {e}"));
    let path = law::locate(plugin, &search, Path::new(".")).map_err(missing)?;
    let module = LoadedModule::load(&path).map_err(missing)?;
    let parameters = &module.schema().parameters;
    let given = |p: &Parameter| match p.name.as_str() {
        "c_pa" => known.c_pa,
        "phi_rad" => known.phi_rad,
        "K_m" => known.shear_m,
        "density_kg_m3" => known.density,
        _ => None,
    };
    let mut values: Vec<f64> = parameters.iter().map(|p| given(p).unwrap_or_else(|| start(p))).collect();
    let services = HostServices::new(1, Path::new("."));
    let bench =
        law::Bench::open(&module, &values, &services).map_err(|e| plain(format!("--law {plugin}: {e}")))?;
    if !bench.law().has_pressure() {
        return Err(plain(format!(
            "--law {plugin}: it has no pressure function, so plates tell nothing of it"
        )));
    }
    let sought: Vec<usize> = (0..values.len()).filter(|k| given(&parameters[*k]).is_none()).collect();
    let free: Vec<Free> = sought.iter().map(|k| range(&parameters[*k], values[*k])).collect();
    let all = values.clone();
    let mut pressures = |x: &[f64], readings: &[Reading], p: &mut [f64]| {
        let mut numbers = all.clone();
        sought.iter().zip(x).for_each(|(k, x)| numbers[*k] = *x);
        bench.with(&numbers).is_ok_and(|law| press(law.as_ref(), readings, p))
    };
    let found = fit_numbers(&mut pressures, &free, &tests.readings).map_err(|e| {
        plain(format!("{e}, or the law has no pressure there with the numbers of its schema"))
    })?;
    sought.iter().zip(&found.numbers).for_each(|(k, x)| values[*k] = *x);
    let law = bench.with(&values).map_err(plain)?;
    let interval = |k: usize| {
        let at = sought.iter().position(|s| *s == k)?;
        Some(found.intervals[at]).filter(|i| !i.low.is_nan() || values[k] != all[k])
    };
    let numbers = parameters.iter().enumerate().map(|(k, p)| LawNumber {
        name: p.name.clone(),
        help: p.help.clone(),
        value: values[k],
        interval: interval(k),
    });
    let numbers = numbers.collect();
    let name = module.schema().name.clone();
    Ok(LawFit { name, plugin: plugin.into(), numbers, rms: found.rms, basis: found.basis, law })
}

/// Where the search for a number starts.
fn start(p: &Parameter) -> f64 {
    let typical = TYPICAL.iter().find(|(name, _)| *name == p.name).map(|(_, x)| *x);
    let middle = match (p.min, p.max) {
        (Some(a), Some(b)) => 0.5 * (a + b),
        (Some(a), None) => a + 1.0,
        (None, Some(b)) => b - 1.0,
        (None, None) => 1.0,
    };
    p.default.as_f64().or(typical).unwrap_or(middle)
}

fn range(p: &Parameter, start: f64) -> Free {
    let min = p.min.unwrap_or(f64::NEG_INFINITY);
    // "above" is open: the smallest number that differs
    let min = if p.above_min { min + 1e-9 * min.abs().max(1e-3) } else { min };
    Free { start, min, max: p.max.unwrap_or(f64::INFINITY) }
}

/// Pressures of first loading at the readings, those of one size at once.
fn press(law: &dyn NodeLaw, readings: &[Reading], out: &mut [f64]) -> bool {
    let mut first = 0;
    while first < readings.len() {
        let b = readings[first].b;
        let count = readings[first..].iter().take_while(|r| r.b == b).count();
        let depth: Vec<f64> = readings[first..first + count].iter().map(|r| r.depth).collect();
        let kept = if law.state_doubles() > 0 { count } else { 0 };
        let states = vec![0.0; count * law.state_doubles()];
        let (zero, mut slope) = (vec![0.0; kept], vec![0.0; count]);
        let (mut permanent, mut state) = (zero.clone(), states.clone());
        let nodes = PressureNodes { b, h: 1.0, depth: &depth, permanent: &zero, slip: &zero, state: &states };
        let mut answer = PressureAnswer {
            pressure: &mut out[first..first + count],
            slope: &mut slope,
            permanent: &mut permanent,
            state: &mut state,
            longest_s: f64::INFINITY,
        };
        if law.pressure(&nodes, &mut answer).is_err() {
            return false;
        }
        first += count;
    }
    true
}

impl LawFit {
    /// Pressure (Pa) of first loading; NaN where the law has no answer.
    pub fn pressure(&self, b: f64, depth: f64) -> f64 {
        let mut out = [f64::NAN];
        press(self.law.as_ref(), &[Reading { curve: 0, b, depth, pressure: 1.0 }], &mut out);
        out[0]
    }

    /// Root of the mean square of ln(p/p_measured) over other tests.
    pub fn rms_of(&self, tests: &PlateTests) -> f64 {
        let mut p = vec![f64::NAN; tests.readings.len()];
        press(self.law.as_ref(), &tests.readings, &mut p);
        let square = |(p, r): (&f64, &Reading)| (p / r.pressure).ln().powi(2);
        (p.iter().zip(&tests.readings).map(square).sum::<f64>() / p.len() as f64).sqrt()
    }
}
