//! `[soil.mask]`: a file of labels becomes the number of a soil at every node of the ground.

use super::labels::Labels;
use serde_json::{Map, Value, json};
use terraglue_diagnostics::Result;
use terraglue_scenario::advice::line_of;
use terraglue_scenario::{Scenario, SubsystemSpec};
use terraglue_subsystem::{Config, Terrain};

/// The parameters with what a module needs of the mask; unchanged where there is none.
///
/// # Errors
/// A mask without ground, a file that cannot be read, a label without a row.
pub fn resolve(
    scenario: &Scenario,
    spec: &SubsystemSpec,
    config: Config,
    ground: Option<&dyn Terrain>,
) -> Result<Config> {
    let Some(file) = config.get("mask.file").and_then(Value::as_str) else { return Ok(config) };
    let at = |key: &str, message: String, help: Option<String>| {
        scenario.source.error_at_value(&[&spec.name, "mask", key], message, help)
    };
    let Some(ground) = ground else {
        return Err(at("file", "a mask needs ground: there is no table `[terrain]`".into(), None).into());
    };
    let labels = Labels::read(
        &scenario.folder.join(file),
        config.optional_number("mask.pixel_m").ok().flatten(),
        ground,
    )?;
    let number = |label: u8| spec.regions.iter().position(|region| region.label == label);
    if let Some((label, place)) = labels.unknown(|label| number(label).is_some()) {
        let message = format!("label {label} of {file}, first {place}, stands for no soil");
        let help = format!(
            "write [{}.mask.rows] {label} = \"LETE_sand\", or another row of `terraglue soils`",
            spec.name
        );
        return Err(at("file", message, Some(help)).into());
    }
    let mut runs: Vec<[u32; 2]> = Vec::new();
    let ([ox, oy], [nx, ny], spacing) = (ground.origin(), ground.size(), ground.spacing());
    for (j, i) in (0..ny).flat_map(|j| (0..nx).map(move |i| (j, i))) {
        let label = labels.at([ox + f64::from(i) * spacing, oy + f64::from(j) * spacing]);
        let soil = number(label).map_or(0, |k| k as u32 + 1);
        match runs.last_mut() {
            Some([count, last]) if *last == soil => *count += 1,
            _ => runs.push([1, soil]),
        }
    }
    for (k, region) in spec.regions.iter().enumerate() {
        if !runs.iter().any(|[_, soil]| *soil == k as u32 + 1) {
            let message =
                format!("label {} of {file} ({}) covers no node of the ground", region.label, region.soil);
            let path: [&str; 4] = [&spec.name, "mask", "rows", &region.label.to_string()];
            log::warn!("{}", line_of(&scenario.source.error_at_value(&path, message, None)));
        }
    }
    let soils: Vec<&Map<String, Value>> = spec.regions.iter().map(|region| &region.numbers).collect();
    let mut all: Value = serde_json::from_str(&config.to_json()).unwrap_or_default();
    all["mask"]["soils"] = json!(soils);
    all["mask"]["runs"] = json!(runs.concat());
    Config::parse(&all.to_string()).map_err(|e| at("file", e.to_string(), None).into())
}
