//! Values that are allowed but far from what is usual, most often since their unit is another one: warned of with the likely
//! slip, never refused.
//!
//! A module gives the usual values in its schema ([`Usual`]).

use super::advice::line_of;
use super::model::{Scenario, SubsystemSpec};
use serde_json::{Map, Value};
use terraglue_subsystem::{Config, Parameter, Schema, Usual};

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

/// Doubt about the value `x` of `what`: how far it is from usual ones, and the unit in which it would be one.
pub fn doubt(usual: &Usual, what: &str, x: f64) -> Option<String> {
    let [low, high] = usual.span;
    if x == 0.0 || !x.is_finite() || (low..=high).contains(&x) {
        return None;
    }
    let unit = &usual.unit;
    let far = match () {
        () if x <= 0.0 => "is below".to_owned(),
        () if x < low => format!("is {} times below", rounded(low / x)),
        () => format!("is {} times above", rounded(x / high)),
    };
    let slips = SLIPS.iter().find(|(of, _)| of == unit).map_or(&[][..], |(_, slips)| slips);
    let likely = slips.iter().filter(|(_, factor)| (low..=high).contains(&(x * factor)));
    let meant = likely.map(|(name, factor)| format!("{name} ({} {unit})", rounded(x * factor)));
    let meant = match meant.collect::<Vec<_>>() {
        none if none.is_empty() => String::new(),
        some => format!("; given in {}?", some.join(" or ")),
    };
    Some(format!("{what} = {x} {unit} {far} the usual {low} … {high} {unit}{meant}"))
}

/// Three digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

/// Distance of nodes of ground on which feet and wheels stand.
fn spacing() -> Usual {
    Usual::new("m", 5e-4, 0.5)
}

/// Doubtful values of the ground.
pub fn terrain(scenario: &Scenario) -> Option<String> {
    let doubt = doubt(&spacing(), "`spacing_m`", scenario.terrain.as_ref()?.spacing_m)?;
    Some(line_of(&scenario.source.error_at_value(&["terrain", "spacing_m"], doubt, None)))
}

/// Parameters with usual values.
fn usual(schema: &Schema) -> impl Iterator<Item = (&Parameter, &Usual)> {
    schema.parameters.iter().filter_map(|p| Some((p, p.usual.as_ref()?)))
}

/// Doubtful values of a subsystem, its own and those of the regions of its mask.
pub fn parameters(
    scenario: &Scenario,
    spec: &SubsystemSpec,
    schema: &Schema,
    config: &Config,
) -> Vec<String> {
    let source = &scenario.source;
    let say = |path: &[&str], doubt| line_of(&source.error_at_value(path, doubt, None));
    let own = usual(schema).filter_map(|(parameter, usual)| {
        let key = parameter.name.as_str();
        let x = config.optional_number(key).ok().flatten()?;
        let doubt = doubt(usual, &format!("`{key}`"), x)?;
        let below = |table: &[&str]| {
            table.iter().map(|t| (*t).to_owned()).chain(key.split('.').map(Into::into)).collect()
        };
        let paths: [Vec<String>; 2] = [below(&[&spec.name, &spec.module]), below(&[&spec.name])];
        let paths = paths.iter().map(|path| path.iter().map(String::as_str).collect::<Vec<_>>());
        Some(match paths.into_iter().find(|path| source.has(path)) {
            Some(path) => say(&path, doubt),
            None => say(&[&spec.name, "parameters"], doubt),
        })
    });
    let regions = spec.regions.iter().flat_map(|region| {
        let label = region.label.to_string();
        let of_region = move |doubt| {
            say(
                &[&spec.name, "mask", "rows", &label],
                format!("label {} ({}): {doubt}", region.label, region.soil),
            )
        };
        numbers(schema, &region.numbers).into_iter().map(of_region)
    });
    own.chain(regions).collect()
}

/// Doubtful numbers of a row or a soil file.
fn numbers(schema: &Schema, of: &Map<String, Value>) -> Vec<String> {
    let doubt =
        |(p, usual): (&Parameter, &Usual)| doubt(usual, &format!("`{}`", p.name), of.get(&p.name)?.as_f64()?);
    usual(schema).filter_map(doubt).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::soil_table::{COLUMNS, SoilTable};
    use terraglue_soil_law::SoilParameters;
    use terraglue_subsystem::Kind;

    fn schema() -> Schema {
        let parameters = SoilParameters::schema();
        Schema { name: "soil".into(), kind: Kind::Soil, help: String::new(), parameters }
    }

    fn of_soil(key: &str, what: &str, x: f64) -> Option<String> {
        let schema = schema();
        let (_, usual) = usual(&schema).find(|(p, _)| p.name == key)?;
        doubt(usual, what, x)
    }

    #[test]
    fn every_soil_of_the_table_is_usual_and_none_in_another_unit() {
        let text = include_str!("../../../models/soils.csv");
        let table = SoilTable::parse(text).expect("the table");
        let (mut rows, mut caught) = (0, 0);
        for row in &table.rows {
            let all: Map<String, Value> =
                COLUMNS.iter().filter_map(|c| Some(((*c).to_owned(), row.value(c)?.into()))).collect();
            assert_eq!(numbers(&schema(), &all), Vec::<String>::new(), "{}", row.name);
            rows += 1;
            // the slips that happen: moduli in kN, K in cm, density in t/m³
            for (key, factor, said) in
                [("k_phi", 1e-3, "kN"), ("K_m", 100.0, "in cm ("), ("density_kg_m3", 1e-3, "t/m³")]
            {
                let Some(x) = row.value(key) else { continue };
                let doubt = of_soil(key, key, x * factor);
                let doubt = doubt.unwrap_or_else(|| panic!("{}: {key} = {}", row.name, x * factor));
                assert!(doubt.contains(said), "{doubt}");
                caught += 1;
            }
        }
        assert!(rows > 30 && caught > 60, "{rows} {caught}");
    }

    #[test]
    fn a_doubt_names_value_span_and_slip() {
        let doubt = |key: &str, x| of_soil(key, &format!("`{key}`"), x).unwrap_or_default();
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
        assert!(
            super::doubt(&spacing(), "dx", 10.0).is_some_and(|d| d.contains("in cm (0.1 m) or mm (0.01 m)?"))
        );
        assert!(doubt("density_kg_m3", 1e9).ends_with("3500 kg/m^3"));
    }
}
