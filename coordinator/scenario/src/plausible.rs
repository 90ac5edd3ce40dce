//! Values that are allowed but far from what is usual, most often since their unit is another one: warned of with the likely
//! slip, never refused.
//!
//! The usual spans of soils are those of `models/soils.csv`, widened by about three; a test holds every row to them.

use super::advice::line_of;
use super::model::{Scenario, SubsystemSpec};
use serde_json::{Map, Value};
use terraglue_subsystem::{Config, Schema};

/// The usual span of a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Usual {
    /// Its unit.
    pub unit: &'static str,
    /// Smallest and largest usual value; 0 is always usual.
    pub span: [f64; 2],
}

/// Units that are taken for another one: what a user may have meant, and how many of the right ones it has.
type Slips = &'static [(&'static str, f64)];
const PRESSURES: Slips = &[("kPa", 1e3), ("psi", 6894.757), ("MPa", 1e6), ("bar", 1e5)];
const LENGTHS: Slips = &[("cm", 1e-2), ("mm", 1e-3)];
const SLIPS: &[(&str, Slips)] = &[
    ("Pa", PRESSURES),
    ("N/m^(n+1)", &[("kN", 1e3)]),
    ("N/m^(n+2)", &[("kN", 1e3), ("MN", 1e6)]),
    ("m", LENGTHS),
    ("1/m", &[("1/cm", 1e2), ("1/mm", 1e3)]),
    ("kg/m^3", &[("t/m³ or g/cm³", 1e3)]),
    ("degrees", &[("rad", 180.0 / std::f64::consts::PI)]),
];

impl Usual {
    /// What is doubtful about the value `x` of `what`: how far it is from usual ones, and the unit in which it would be one.
    pub fn doubt(&self, what: &str, x: f64) -> Option<String> {
        let [low, high] = self.span;
        if x == 0.0 || !x.is_finite() || (low..=high).contains(&x) {
            return None;
        }
        let unit = self.unit;
        let far = match () {
            () if x <= 0.0 => "is below".to_owned(),
            () if x < low => format!("is {} times below", rounded(low / x)),
            () => format!("is {} times above", rounded(x / high)),
        };
        let slips = SLIPS.iter().find(|(of, _)| *of == unit).map_or(&[][..], |(_, slips)| slips);
        let likely = slips.iter().filter(|(_, factor)| (low..=high).contains(&(x * factor)));
        let meant = likely.map(|(name, factor)| format!("{name} ({} {unit})", rounded(x * factor)));
        let meant = match meant.collect::<Vec<_>>() {
            none if none.is_empty() => String::new(),
            some => format!("; given in {}?", some.join(" or ")),
        };
        Some(format!("{what} = {x} {unit} {far} the usual {low} … {high} {unit}{meant}"))
    }
}

/// Three digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

const fn usual(unit: &'static str, low: f64, high: f64) -> Usual {
    Usual { unit, span: [low, high] }
}

/// Usual values of the keys of soils.
const SOILS: &[(&str, Usual)] = &[
    ("k_c", usual("N/m^(n+1)", 20.0, 3e5)),
    ("k_phi", usual("N/m^(n+2)", 1.5e4, 2.5e7)),
    ("c_pa", usual("Pa", 100.0, 2e5)),
    ("interface_c_pa", usual("Pa", 10.0, 2e5)),
    ("adhesion_pa", usual("Pa", 10.0, 2e5)),
    ("K_m", usual("m", 0.002, 0.12)),
    ("K_across_m", usual("m", 0.002, 0.12)),
    ("reference_depth_m", usual("m", 0.005, 2.0)),
    ("density_kg_m3", usual("kg/m^3", 100.0, 3500.0)),
    ("curvature_max_per_m", usual("1/m", 2.0, 2000.0)),
    ("mask.pixel_m", usual("m", 1e-3, 5.0)),
];
/// Distance of nodes of ground on which feet and wheels stand.
const SPACING: Usual = usual("m", 5e-4, 0.5);
/// Sinkages and pressures of plate tests: the largest of each.
pub const PLATE_SINKAGE: Usual = usual("m", 1e-3, 1.0);
/// See [`PLATE_SINKAGE`].
pub const PLATE_PRESSURE: Usual = usual("Pa", 100.0, 1e8);
/// Angle of internal friction where it is given in degrees.
pub const FRICTION_DEGREES: Usual = usual("degrees", 3.0, 60.0);

/// The usual values of a key of soils.
pub fn of_soil(key: &str) -> Option<Usual> {
    SOILS.iter().find(|(k, _)| *k == key).map(|(_, usual)| *usual)
}

/// Doubtful values of the ground.
pub fn terrain(scenario: &Scenario) -> Option<String> {
    let spacing = scenario.terrain.as_ref()?.spacing_m;
    let doubt = SPACING.doubt("`spacing_m`", spacing)?;
    Some(line_of(&scenario.source.error_at_value(&["terrain", "spacing_m"], doubt, None)))
}

/// Doubtful values of a soil, its own and those of the regions of its mask.
pub fn soil(scenario: &Scenario, spec: &SubsystemSpec, schema: &Schema, config: &Config) -> Vec<String> {
    let source = &scenario.source;
    let known = |key: &str| schema.parameters.iter().any(|p| p.name == key);
    let say = |path: &[&str], doubt| line_of(&source.error_at_value(path, doubt, None));
    let own = SOILS.iter().filter(|(key, _)| known(key)).filter_map(|(key, usual)| {
        let x = config.optional_number(key).ok().flatten()?;
        let doubt = usual.doubt(&format!("`{key}`"), x)?;
        let parts = key.split('.');
        let below = |table: &[&'static str]| table.iter().copied().chain(parts.clone()).collect::<Vec<_>>();
        let own: Vec<&str> = [spec.name.as_str(), &spec.module].into_iter().chain(below(&[])).collect();
        let plain: Vec<&str> = [spec.name.as_str()].into_iter().chain(below(&[])).collect();
        Some(match [own, plain].into_iter().find(|path| source.has(path)) {
            Some(path) => say(&path, doubt),
            None => say(&[&spec.name, "parameters"], doubt),
        })
    });
    let regions = spec.regions.iter().flat_map(|region| {
        let label = region.label.to_string();
        let doubts = numbers(&region.numbers).collect::<Vec<_>>();
        let of_region = move |doubt| {
            say(
                &[&spec.name, "mask", "rows", &label],
                format!("label {} ({}): {doubt}", region.label, region.soil),
            )
        };
        doubts.into_iter().map(of_region)
    });
    own.chain(regions).collect()
}

/// Doubtful numbers of a row or a soil file.
fn numbers(of: &Map<String, Value>) -> impl Iterator<Item = String> + '_ {
    SOILS.iter().filter_map(|(key, usual)| usual.doubt(&format!("`{key}`"), of.get(*key)?.as_f64()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_soil_law::{COLUMNS, SoilTable};

    #[test]
    fn every_soil_of_the_table_is_usual_and_none_in_another_unit() {
        let text = include_str!("../../../models/soils.csv");
        let table = SoilTable::parse(text).expect("the table");
        let (mut rows, mut caught) = (0, 0);
        for row in &table.rows {
            let all: Map<String, Value> =
                COLUMNS.iter().filter_map(|c| Some(((*c).to_owned(), row.value(c)?.into()))).collect();
            assert_eq!(numbers(&all).collect::<Vec<_>>(), Vec::<String>::new(), "{}", row.name);
            rows += 1;
            // the slips that happen: moduli in kN, K in cm, density in t/m³
            for (key, factor, said) in
                [("k_phi", 1e-3, "kN"), ("K_m", 100.0, "in cm ("), ("density_kg_m3", 1e-3, "t/m³")]
            {
                let Some(x) = row.value(key) else { continue };
                let doubt = of_soil(key).and_then(|u| u.doubt(key, x * factor));
                let doubt = doubt.unwrap_or_else(|| panic!("{}: {key} = {}", row.name, x * factor));
                assert!(doubt.contains(said), "{doubt}");
                caught += 1;
            }
        }
        assert!(rows > 30 && caught > 60, "{rows} {caught}");
    }

    #[test]
    fn a_doubt_names_value_span_and_slip() {
        let doubt =
            |key: &str, x| of_soil(key).and_then(|u| u.doubt(&format!("`{key}`"), x)).unwrap_or_default();
        let said = doubt("k_phi", 1528.0);
        assert!(
            said.starts_with("`k_phi` = 1528 N/m^(n+2) is 9.82 times below the usual 15000 … 25000000"),
            "{said}"
        );
        assert!(said.ends_with("; given in kN (1530000 N/m^(n+2))?"), "{said}");
        assert!(doubt("c_pa", 1.04).contains("given in kPa (1040 Pa)"), "{}", doubt("c_pa", 1.04));
        assert!(
            doubt("K_m", 18.0).contains("150 times above") && doubt("K_m", 18.0).contains("in mm (0.018 m)?")
        );
        assert_eq!(doubt("c_pa", 0.0), "");
        assert!(SPACING.doubt("dx", 10.0).is_some_and(|d| d.contains("in cm (0.1 m) or mm (0.01 m)?")));
        assert!(
            FRICTION_DEGREES.doubt("--phi-deg", 0.61).is_some_and(|d| d.contains("in rad (35 degrees)?"))
        );
        assert!(doubt("density_kg_m3", 1e9).ends_with("3500 kg/m^3"));
    }
}
