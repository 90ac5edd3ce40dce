//! `[soil.mask.rows]`: the soils of the labels of a mask.

use super::model::Region;
use super::node::{Node, Raw};
use super::soil_row;
use super::source::Source;
use terraglue_diagnostics::InputError;

/// The soils of `[name.mask.rows]` in ascending order of their labels, each with its numbers.
pub fn regions(
    source: &Source,
    name: &str,
    node: &Node,
    module: &str,
) -> Result<Vec<Region>, Box<InputError>> {
    let own = node.get(module).and_then(|table| table.get("mask"));
    let Some(rows) = own.or_else(|| node.get("mask")).and_then(|mask| mask.get("rows")) else {
        return Ok(Vec::new());
    };
    let mut regions = rows
        .entries()
        .iter()
        .map(|(key, row)| region(source, name, node, (key, row)))
        .collect::<Result<Vec<Region>, _>>()?;
    regions.sort_by_key(|region| region.label);
    Ok(regions)
}

fn region(
    source: &Source,
    name: &str,
    node: &Node,
    (key, row): (&str, &Node),
) -> Result<Region, Box<InputError>> {
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
