//! `[soil.mask]`: a file of labels becomes the number of a soil at every node of the ground.

use super::advice::line_of;
use super::model::{Region, Scenario, SubsystemSpec};
use super::node::{Node, Raw};
use super::soil_row;
use super::source::{InputError, Source};
use crate::error::Result;
use crate::terrain::Labels;
use serde_json::{Map, Value, json};
use terraglue_subsystem::{Config, Terrain};

/// The soils of `[name.mask.rows]` in ascending order of their labels, each with its numbers.
pub fn regions(
    source: &Source,
    name: &str,
    node: &Node,
    module: &str,
) -> std::result::Result<Vec<Region>, Box<InputError>> {
    let own = node.get(module).and_then(|table| table.get("mask"));
    let Some(rows) = own.or_else(|| node.get("mask")).and_then(|mask| mask.get("rows")) else {
        return Ok(Vec::new());
    };
    let mut regions = rows
        .entries()
        .iter()
        .map(|(key, row)| region(source, name, node, (key, row)))
        .collect::<std::result::Result<Vec<Region>, _>>()?;
    regions.sort_by_key(|region| region.label);
    Ok(regions)
}

fn region(
    source: &Source,
    name: &str,
    node: &Node,
    (key, row): (&str, &Node),
) -> std::result::Result<Region, Box<InputError>> {
    let label = key.parse::<u8>().ok().filter(|label| *label > 0).ok_or_else(|| {
        let help =
            "labels are whole numbers from 1 to 255; what lies at 0 is the table's own soil".to_owned();
        source.error(&row.key, format!("`{key}` is no label of a region"), Some(help))
    })?;
    let Raw::Text(soil) = &row.value else {
        let help = Some("e.g. 1 = \"LETE_sand\"; `terraglue soils` lists the rows".to_owned());
        return Err(source.error(&row.at, "a label takes the name of a soil, or of a soil file", help));
    };
    let mut numbers = soil_row::numbers(source, name, node, soil, &[], &row.at)?;
    // the rows of the table are numbers of Bekker's law
    numbers.entry("pressure_law").or_insert_with(|| "bekker".into());
    Ok(Region { label, soil: soil.clone(), numbers })
}

/// The parameters with what a module needs of the mask; unchanged where there is none.
///
/// # Errors
/// A mask without ground, a file that cannot be read, a label that no row stands for.
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
