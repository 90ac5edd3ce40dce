//! A fit as a soil file for scenarios, and as JSON.

use super::{Known, LawFit, PlateTests, SoilFit};
use serde_json::{Value, json as value};
use terraglue_soil_identification::{Basis, Interval};

/// Rounds to the significant digits of the output: more than any plate test resolves.
pub(super) fn digits(x: f64) -> String {
    if x == 0.0 {
        return "0.0".into();
    }
    if !x.is_finite() {
        return "unknown".into();
    }
    let rounded: f64 = format!("{x:.6e}").parse().unwrap_or(x);
    let text = format!("{rounded}");
    if text.contains('.') { text } else { format!("{text}.0") }
}

/// `low … high` with each end as `number` writes it; "unknown" where readings were too few for an interval.
pub(super) fn ends(i: Interval, number: impl Fn(f64) -> String) -> String {
    if i.low.is_finite() && i.high.is_finite() {
        format!("{} … {}", number(i.low), number(i.high))
    } else {
        "unknown".into()
    }
}

/// An interval for the screen.
pub fn shown(i: Interval) -> String {
    ends(i, |x| format!("{x:.4}"))
}

/// How a fit does on other tests.
#[derive(Clone, Debug, PartialEq)]
pub struct Predicted {
    /// Name of the file.
    pub file: String,
    /// Root of the mean square of ln(p/p_measured).
    pub rms: f64,
    /// Readings.
    pub readings: usize,
    /// Those of them that the fit has seen.
    pub seen: usize,
}

impl Predicted {
    /// Of the tests `other`, after a fit to `fitted`.
    pub fn of(file: String, rms: f64, other: &PlateTests, fitted: &PlateTests) -> Self {
        let same = |r: &&terraglue_soil_identification::Reading| {
            fitted.readings.iter().any(|f| [f.b, f.depth, f.pressure] == [r.b, r.depth, r.pressure])
        };
        let seen = other.readings.iter().filter(same).count();
        Self { file, rms, readings: other.readings.len(), seen }
    }

    fn json(&self) -> Value {
        value!({ "file": self.file, "rms": self.rms, "readings": self.readings, "readings_of_the_fit": self.seen })
    }
}

impl std::fmt::Display for Predicted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let new = match self.seen {
            0 => "not seen before".to_owned(),
            all if all == self.readings => "the very readings of the fit: no test of it".to_owned(),
            some => format!("{some} of its readings are those of the fit: no clean test of it"),
        };
        write!(f, "{}, {new}: rms {:.2} % over {} readings", self.file, 100.0 * self.rms, self.readings)
    }
}

/// The table of a soil, for `parameters = "soil.toml"` or to be copied into a scenario. `source` says where the
/// numbers come from.
pub fn toml(fit: &SoilFit, source: &str) -> String {
    let mut text = format!("# {source}\n# {}\n\n[soil]\npressure_law = \"{}\"\n", basis(fit), fit.law);
    for p in &fit.parameters {
        let known = format!("95 %: {}", ends(p.interval, digits));
        text += &format!("{} = {}  # {}; {known}\n", p.name, digits(p.value), p.help);
    }
    if fit.law == "bekker" {
        text += &measured_gravity();
    }
    if fit.law == "bearing" {
        text += &format!("reference_depth_m = {}\n", digits(super::REFERENCE_DEPTH));
    }
    for (key, number, what) in others(&fit.known) {
        match number {
            Some(x) => text += &format!("{key} = {}\n", digits(x)),
            None => text += &format!("# {key} = …  # plates do not tell the {what}\n"),
        }
    }
    text
}

/// Under which gravity the moduli of Bekker's law hold.
pub(super) fn measured_gravity() -> String {
    let g = digits(super::LABORATORY_GRAVITY);
    format!("measured_gravity_m_s2 = {g}  # of the tests; k_phi stands for the weight of the soil\n")
}

fn others(known: &Known) -> [(&'static str, Option<f64>, &'static str); 4] {
    [
        ("c_pa", known.c_pa, "cohesion"),
        ("phi_rad", known.phi_rad, "angle of internal friction"),
        ("K_m", known.shear_m, "shear deformation modulus"),
        ("density_kg_m3", known.density, "density"),
    ]
}

/// How good the fit is and what its intervals rest on, in words.
pub fn basis(fit: &SoilFit) -> String {
    let size =
        if fit.fit.one_size { "; one size of plate only: the cohesive factor is set to 0" } else { "" };
    rests(fit.fit.rms, fit.fit.basis) + size
}

/// The same of any law.
pub fn rests(rms: f64, basis: Basis) -> String {
    let rests = match basis {
        Basis::Curves(n) => format!("intervals: each of {n} presses left out in turn"),
        Basis::Pieces(n) => {
            format!(
                "intervals: each of {n} pieces of the curves left out in turn; too narrow, presses differ more"
            )
        }
    };
    format!("rms of ln(p/p_measured) {:.2} %; {rests}", 100.0 * rms)
}

/// A law that is a module with its numbers, as lines for the table of a soil in a scenario. Numbers that plates do not
/// identify are left to the soil and to their defaults.
pub fn law_toml(fit: &LawFit, source: &str) -> String {
    let mut text = format!(
        "# {source}\n# {}\n# Into a scenario, below its soil:\n\n[soil.law]\nplugin = {:?}\n[soil.law.parameters]\n",
        rests(fit.rms, fit.basis),
        fit.plugin
    );
    for n in &fit.numbers {
        match n.interval {
            Some(i) => {
                let known = format!("95 %: {}", ends(i, digits));
                text += &format!("{} = {}  # {}; {known}\n", n.name, digits(n.value), n.help);
            }
            None => {
                text += &format!("# {} = {}  # {}; plates do not tell it\n", n.name, digits(n.value), n.help)
            }
        }
    }
    text
}

/// A number with the ends of its interval, for programs; null where it is unknown.
pub(super) fn number_json(number: f64, interval: Option<Interval>) -> Value {
    let end = |end: fn(Interval) -> f64| interval.map(end).filter(|x| x.is_finite());
    value!({ "value": number, "low": end(|i| i.low), "high": end(|i| i.high) })
}

/// The JSON that all fits share.
fn fit_json(
    law: &str,
    rms: f64,
    basis: Basis,
    from: f64,
    parameters: serde_json::Map<String, Value>,
    predicted: Option<&Predicted>,
) -> Value {
    let (basis, groups) = match basis {
        Basis::Curves(n) => ("curves", n),
        Basis::Pieces(n) => ("pieces", n),
    };
    value!({
        "law": law,
        "parameters": parameters,
        "rms": rms,
        "from_m": from,
        "intervals_from": { "basis": basis, "groups": groups, "confidence": 0.95 },
        "predicted": predicted.map(Predicted::json),
    })
}

/// A law that is a module, for programs.
pub fn law_json(fit: &LawFit, from: f64, predicted: Option<&Predicted>) -> Value {
    let parameters = fit.numbers.iter().map(|n| (n.name.clone(), number_json(n.value, n.interval))).collect();
    let mut all = fit_json(&fit.name, fit.rms, fit.basis, from, parameters, predicted);
    all["plugin"] = value!(fit.plugin);
    all
}

/// Everything for programs.
pub fn json(fit: &SoilFit, all: &[SoilFit], from: f64, predicted: Option<&Predicted>) -> Value {
    let number = |p: &super::Fitted| (p.name.to_owned(), number_json(p.value, Some(p.interval)));
    let parameters = fit.parameters.iter().map(number).collect();
    let laws: serde_json::Map<_, _> = all.iter().map(|f| (f.law.to_owned(), value!(f.fit.rms))).collect();
    let mut out = fit_json(fit.law, fit.fit.rms, fit.fit.basis, from, parameters, predicted);
    out["rms_of_laws"] = value!(laws);
    out
}
