//! `terraglue soils`: the rows of the soil table.

use super::list::fits;
use super::output::outln;
use super::{Exit, show};
use serde_json::{Map, Value, json};
use std::path::Path;
use terraglue_diagnostics::Result;
use terraglue_scenario::{COLUMNS, SoilRow, SoilTable};
use terraglue_scenario::{InputError, did_you_mean, find_soil_table, read_soil_table};

/// Units of the columns.
const UNITS: [&str; COLUMNS.len()] =
    ["", "N/m^(n+1)", "N/m^(n+2)", "Pa", "rad", "m", "kg/m³", "Pa/m", "m/s²", "Pa"];

/// Headings of the columns, of which the numbers are those of [`COLUMNS`].
const HEADS: [&str; COLUMNS.len() + 3] = [
    "soil",
    "n",
    "k_c",
    "k_phi",
    "c, Pa",
    "phi, rad",
    "K, m",
    "density, kg/m³",
    "elastic, Pa/m",
    "measured at, m/s²",
    "wall c, Pa",
    "source",
    "confidence",
];

/// All soils, or everything about one.
pub fn soils(name: Option<&str>, file: Option<&Path>, as_json: bool) -> Result<Exit> {
    let path = file.map(Path::to_owned).or_else(|| find_soil_table(Path::new(".")));
    let path = path.ok_or_else(|| {
        let help = Some("name a table with --file".into());
        InputError::plain("no soil table: models/soils.csv is not there", help)
    })?;
    let mut soils = read_soil_table(&path).map_err(|message| {
        let help = "its first line names the columns, as that of models/soils.csv does";
        InputError::plain(message, Some(help.into()))
    })?;
    match name {
        Some(name) if !as_json && soils.rows.iter().any(|r| r.name == name) => {
            one(soils.row(name).map_err(|e| InputError::plain(e.to_string(), None))?)
        }
        Some(part) => {
            let names: Vec<String> = soils.rows.iter().map(|r| r.name.clone()).collect();
            match names.iter().any(|name| name == part) {
                true => soils.rows.retain(|r| r.name == part),
                false => soils.rows.retain(|r| fits(part, &r.name)),
            }
            if soils.rows.is_empty() {
                let help = did_you_mean(part, names.iter().map(String::as_str));
                let none = if part.contains('*') { "no soil matches" } else { "there is no soil" };
                let message = format!("{none} `{part}` in {}", path.display());
                return Err(InputError::plain(message, help).into());
            }
            list(&soils, as_json);
        }
        None => list(&soils, as_json),
    }
    if !as_json {
        outln!("from {}", path.display());
    }
    Ok(Exit::Done)
}

fn list(soils: &SoilTable, as_json: bool) {
    match as_json {
        true => outln!("{}", Value::from_iter(soils.rows.iter().map(json_of))),
        false => all(soils),
    }
}

/// The names of the columns are those of the table.
fn json_of(row: &SoilRow) -> Value {
    let words = [("name", &row.name), ("source", &row.source), ("confidence", &row.confidence)];
    let words = words.into_iter().map(|(key, word)| (key.to_owned(), json!(word)));
    let numbers = COLUMNS.iter().zip(&row.values).map(|(column, value)| ((*column).to_owned(), json!(value)));
    words.chain(numbers).chain([("refused".to_owned(), json!(row.refused))]).collect::<Map<_, _>>().into()
}

fn all(soils: &SoilTable) {
    let mut table = show::listing(&HEADS);
    let mut refused = show::listing(&["refused", "reason"]);
    for row in &soils.rows {
        if let Some(reason) = &row.refused {
            refused.add_row([&row.name, reason]);
            continue;
        }
        let cells = row.values.iter().map(|v| v.map_or_else(|| "–".to_owned(), |x| x.to_string()));
        let name = std::iter::once(row.name.clone());
        table.add_row(name.chain(cells).chain([row.source.clone(), row.confidence.clone()]));
    }
    outln!("{}", table.trim_fmt());
    if refused.row_count() > 0 {
        outln!("{}", refused.trim_fmt());
    }
}

fn one(row: &SoilRow) {
    let mut table = show::listing(&[row.name.as_str(), "value", "unit"]);
    for ((column, value), unit) in COLUMNS.iter().zip(&row.values).zip(UNITS) {
        let value = value.map_or_else(|| "–".to_owned(), |x| x.to_string());
        table.add_row([(*column).to_owned(), value, unit.to_owned()]);
    }
    outln!("{}", table.trim_fmt());
    outln!("source: {}\nconfidence: {}", row.source, row.confidence);
    match &row.refused {
        Some(reason) => outln!("refused as it stands: {reason}"),
        None => outln!("in a scenario: parameters = \"{}\"", row.name),
    }
}
