//! A law that is a module, fitted to plate tests: the numbers of its schema, each within its range.

use super::{Known, PlateTests};
use std::path::Path;
use std::sync::Arc;
use terraglue_host::{HostServices, LoadError, LoadedModule, SearchPath, law};
use terraglue_scenario::InputError;
use terraglue_soil_identification::{
    Basis, FitError, FitLaw, Free, Interval, LawNumbers, Reading, fit, fit_numbers, range, start,
};
use terraglue_subsystem::{NodeLaw, Parameter};

/// A number of the law.
#[derive(Clone, Debug, PartialEq)]
pub struct LawNumber {
    /// Its name in the schema.
    pub name: String,
    /// Its help text.
    pub help: String,
    /// Value.
    pub value: f64,
    /// 95 % confidence, NaN: unknown; None: it was given, or plates do not identify it.
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
    /// Basis of the intervals.
    pub basis: Basis,
    law: Arc<dyn NodeLaw>,
}

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
    let trial = law::LawTrial::open(&module, &values, &services)
        .map_err(|e| plain(format!("--law {plugin}: {e}")))?;
    if !trial.law().has_pressure() {
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
        trial.with(&numbers).is_ok_and(|law| LawNumbers(law.as_ref()).pressures(readings, p).is_ok())
    };
    let found = fit_numbers(&mut pressures, &free, &tests.readings).map_err(|e| {
        plain(format!("{e}, or the law has no pressure there with the numbers of its schema"))
    })?;
    sought.iter().zip(&found.numbers).for_each(|(k, x)| values[*k] = *x);
    let law = trial.with(&values).map_err(plain)?;
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

impl LawFit {
    /// Pressure (Pa) of first loading; NaN where the law has no answer.
    pub fn pressure(&self, b: f64, depth: f64) -> f64 {
        LawNumbers(self.law.as_ref()).pressure(b, depth)
    }

    /// Root of the mean square of ln(p/p_measured) over other tests.
    pub fn rms_of(&self, tests: &PlateTests) -> f64 {
        LawNumbers(self.law.as_ref()).rms(&tests.readings)
    }
}
