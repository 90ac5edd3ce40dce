//! Numbers of a soil that are accepted and yet unlikely to be meant.

use crate::parameters::{Family, SoilParameters};
use crate::softened::SMALL_CONTACT;
use crate::{PressureLaw, SoilExpressions};
use serde_json::{Map, Value};
use terraglue_subsystem::{Advice, Config};

/// Depth up to which the elastic line may replace the law without advice, m.
const UNNOTICED: f64 = 1e-4;
/// Relative difference of gravities from which on they are different ones.
const SAME_GRAVITY: f64 = 0.01;
const STIFFNESS: &str = "elastic_stiffness_pa_m";

/// Advice on the table of a soil under `gravity` (m/s²) and on those of its `regions`: the owner of each, as named in
/// messages, and the numbers that it has in place of those of the table.
///
/// It names soils whose law the elastic line of unloading changes at depths that matter, since it stands for the start of a
/// power law and bounds the slope of any (the soil itself checks laws that are modules), and soils whose moduli were
/// measured under another gravity and are not scaled.
pub fn advice(config: &Config, regions: &[(String, Map<String, Value>)], gravity: f64) -> Vec<Advice> {
    let merged = |(whose, numbers): &(String, Map<String, Value>)| {
        Some((whose.clone(), SoilParameters::of_region(config, numbers).ok()?))
    };
    let own = std::iter::once((String::new(), config.clone()));
    let soils: Vec<(String, Config)> = own.chain(regions.iter().filter_map(merged)).collect();
    let given = |key: &str| config.get(key).is_some_and(|v| !v.is_null());
    let mut all = Vec::new();
    if given(STIFFNESS) && !given("law.plugin") {
        let said = soils.iter().filter_map(|(whose, config)| replaced_law(config, whose, gravity)).flatten();
        all.extend(said.map(|message| Advice { key: STIFFNESS, message }));
    }
    if !given("law") {
        let said = soils.iter().filter_map(|(whose, config)| foreign_gravity(config, whose, gravity));
        all.extend(said.map(|message| Advice { key: "parameters", message }));
    }
    all
}

/// Effect of the elastic line on one soil.
fn replaced_law(config: &Config, whose: &str, gravity: f64) -> Option<Vec<String>> {
    let soil = SoilParameters::from_config(config, gravity).ok()?;
    let stiffness = soil.elastic_stiffness_pa_m?;
    let text = SoilExpressions::from_config(config).ok()?;
    let law = match text.and_then(|text| text.pressure(&soil).transpose()) {
        Some(law) => PressureLaw::Expression(law.ok()?),
        None => soil.pressure(),
    };
    let mut all: Vec<String> = law.softened(stiffness).map(|s| s.message(whose)).into_iter().collect();
    let depth = law.curve(SMALL_CONTACT, stiffness).ok()?.elastic_limit();
    if depth > UNNOTICED && !matches!(law, PressureLaw::Expression(_)) {
        let needed = stiffness * libm::pow(depth / UNNOTICED, 1.0 - soil.n);
        all.push(format!(
            "`{STIFFNESS}` = {stiffness:e} takes the place of the soil's law{whose} down to {:.2} mm under a contact of b = {} \
             mm; {needed:.1e} would down to {} mm",
            1e3 * depth,
            1e3 * SMALL_CONTACT,
            1e3 * UNNOTICED
        ));
    }
    Some(all)
}

/// A soil whose moduli were measured under another gravity than `gravity` (m/s²), and are not scaled.
fn foreign_gravity(config: &Config, whose: &str, gravity: f64) -> Option<String> {
    let soil = SoilParameters::from_config(config, gravity).ok()?;
    let measured = soil.measured_gravity.filter(|g| (g - gravity).abs() > SAME_GRAVITY * gravity)?;
    (soil.family == Family::Bekker && soil.k_phi > 0.0 && !soil.gravity_scaling).then(|| {
        let here = (gravity * 1e4).round() / 1e4;
        format!(
            "`k_phi`{whose} was measured under {measured} m/s², the scenario has {here}: soil of this weight bears \
             {:.2} of it; `gravity_scaling = true` scales it (Reece 1965)",
            gravity / measured
        )
    })
}
