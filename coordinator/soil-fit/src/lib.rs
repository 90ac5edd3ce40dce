//! Plate tests, or a wheel's, from a file to the parameters of a soil: readings, fit, soil file, drawing.
//!
//! The fits themselves are in `terraglue_soil_identification`; here are files, names and units.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod columns;
mod drawing;
mod known;
mod module_law;
mod readings;
mod wheel;
mod wheel_drawing;
mod written;
mod written_wheel;

pub use drawing::{Curve, svg};
pub use known::{Options, known, wheel_start};
pub use module_law::{LawFit, LawNumber, fit_module};
pub use readings::{PlateTests, read};
pub use terraglue_soil_identification::{Rim, Rolling, Wheel, WheelNumber, WheelPoint, WheelStart};
pub use wheel::{WheelFit, WheelTests, fit_wheel, parse_wheel, read_wheel};
pub use wheel_drawing::wheel_svg;
pub use written::{Predicted, basis, json, law_json, law_toml, rests, shown, toml};
pub use written_wheel::{wheel_json, wheel_toml};

use terraglue_scenario::InputError;
use terraglue_soil_identification::{Fit, FitError, FitLaw, Interval, fit};

/// Acceleration of gravity under which laboratory plates are pressed, m/s².
pub const LABORATORY_GRAVITY: f64 = 9.81;
/// z_r of the bearing law, m.
pub const REFERENCE_DEPTH: f64 = 0.1;

/// Parameters of the soil that are known beside the plate tests.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Known {
    /// Cohesion, Pa; `Some(0)`: none.
    pub c_pa: Option<f64>,
    /// Angle of internal friction, rad.
    pub phi_rad: Option<f64>,
    /// Shear deformation modulus, m.
    pub shear_m: Option<f64>,
    /// Bulk density, kg/m³.
    pub density: Option<f64>,
}

/// A parameter of a fitted soil as a scenario takes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Key of the scenario.
    pub name: &'static str,
    /// Value.
    pub value: f64,
    /// 95 % confidence.
    pub interval: Interval,
    /// Its help text.
    pub help: &'static str,
}

/// A law fitted to plate tests.
#[derive(Clone, Debug, PartialEq)]
pub struct SoilFit {
    /// Name of the law: a value of `pressure_law`.
    pub law: &'static str,
    /// The fit.
    pub fit: Fit,
    /// Parameters.
    pub parameters: Vec<Fitted>,
    /// Known parameters.
    pub known: Known,
}

/// Fits the law called `name` (one of [`terraglue_soil_law::PRESSURE_LAWS`]).
///
/// # Errors
/// Readings from which nothing can be found; a law whose factors multiply something that is not known.
pub fn fit_law(name: &'static str, tests: &PlateTests, known: Known) -> Result<SoilFit, Box<InputError>> {
    let law = match name {
        "bekker" => FitLaw::Bekker,
        "reece" => FitLaw::Reece,
        _ => FitLaw::Bearing { reference: REFERENCE_DEPTH },
    };
    let weighed = law != FitLaw::Bekker;
    let needed = |value: Option<f64>, what: &str, option: &str| {
        let message = format!("the law `{name}` multiplies the {what} of the soil, which is not known");
        let help = format!("give it with {option}, or take it from a row of the table with --soil NAME");
        value.ok_or_else(|| InputError::plain(message, Some(help)))
    };
    let cohesion = if weighed { needed(known.c_pa, "cohesion", "--cohesion-pa")? } else { 1.0 };
    let weight =
        if weighed { LABORATORY_GRAVITY * needed(known.density, "density", "--density")? } else { 1.0 };
    let fit = fit(law, &tests.readings, cohesion > 0.0).map_err(refused)?;
    let [cohesive, frictional, exponent] = fit.intervals;
    let scaled = |i: Interval, s: f64| Interval { low: i.low / s, high: i.high / s };
    let names = match name {
        "bekker" => [("k_c", "cohesive modulus, N/m^(n+1)"), ("k_phi", "frictional modulus, N/m^(n+2)")],
        "reece" => [("k_c_prime", "factor of the cohesion"), ("k_phi_prime", "factor of the weight")],
        _ => [("N_c", "factor of the cohesion"), ("N_gamma", "factor of the weight")],
    };
    let divisor = if cohesion > 0.0 { cohesion } else { 1.0 };
    let row = |(name, help), value, interval| Fitted { name, value, interval, help };
    let parameters = vec![
        row(("n", "exponent"), fit.numbers.n, exponent),
        row(names[0], fit.numbers.cohesive / divisor, scaled(cohesive, divisor)),
        row(names[1], fit.numbers.frictional / weight, scaled(frictional, weight)),
    ];
    Ok(SoilFit { law: name, fit, parameters, known })
}

/// Error about readings from which nothing can be found, with the way out.
fn refused(error: FitError) -> Box<InputError> {
    let help = match error {
        FitError::Falls => {
            "look whether the columns of sinkage and pressure are exchanged, and leave out what comes after the peak"
        }
        FitError::OneDepth => "give readings from several sinkages",
        _ => "give more readings, or lower --from-mm",
    };
    InputError::plain(error.to_string(), Some(help.into()))
}

impl SoilFit {
    /// The fitted curve, to be drawn.
    pub fn curve(&self) -> Curve<'_> {
        let pressure = Box::new(|b, z| self.fit.numbers.ln_pressure(&self.fit.law, b, z).exp());
        Curve { law: self.law, rms: self.fit.rms, pressure }
    }
}
