//! `parameters = "row"`: a row of the soil table, offered to the module.

use super::nearest::did_you_mean;
use super::node::Node;
use super::source::{InputError, Source};
use super::subsystems::text;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// Columns whose numbers are offered; the names are those of the override keys.
pub const COLUMNS: [&str; 7] = ["n", "k_c", "k_phi", "c_pa", "phi_rad", "K_m", "density_kg_m3"];

/// A row of the soil table.
#[derive(Clone, Debug, PartialEq)]
pub struct SoilRow {
    /// Name.
    pub name: String,
    /// Number by column, in the order of the columns; absent where the source gives none.
    pub values: Vec<(String, f64)>,
    /// Where the numbers come from.
    pub source: String,
    /// Why the row cannot be used; none: it can.
    pub refused: Option<String>,
}

/// The soil table beside a scenario: `../models/soils.csv` or `models/soils.csv` from its folder or from the
/// current one, or that of the installation.
pub fn find_soil_table(folder: &Path) -> Option<PathBuf> {
    let beside_program = || {
        let program = std::env::current_exe().ok()?;
        Some(program.parent()?.join("../share/terraglue/models/soils.csv"))
    };
    let near = ["../models/soils.csv", "models/soils.csv"].map(|p| folder.join(p));
    let here = Some(PathBuf::from("models/soils.csv"));
    near.into_iter().chain(here).chain(beside_program()).find(|path| path.is_file())
}

/// Reads a soil table: `name`, the columns of [`COLUMNS`], `source`, `refused`.
pub fn read_soil_table(path: &Path) -> Result<Vec<SoilRow>, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("cannot read {}: {e}", path.display()))?;
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|e| format!("{}: {e}", path.display()))?.clone();
    let column = |name: &str| headers.iter().position(|h| h == name);
    if column("name").is_none() {
        return Err(format!("{}: there is no column `name`", path.display()));
    }
    reader
        .records()
        .map(|record| {
            let record = record.map_err(|e| format!("{}: {e}", path.display()))?;
            let cell = |name: &str| column(name).and_then(|i| record.get(i)).unwrap_or_default();
            read_row(&cell).map_err(|e| format!("{}: row `{}`: {e}", path.display(), cell("name")))
        })
        .collect()
}

fn read_row<'a>(cell: &impl Fn(&str) -> &'a str) -> Result<SoilRow, String> {
    let refused = Some(cell("refused").to_owned()).filter(|r| !r.is_empty());
    let mut values = Vec::new();
    for name in COLUMNS {
        match (cell(name), cell(name).parse::<f64>()) {
            ("", _) => {}
            (_, Ok(x)) if x.is_finite() => values.push((name.to_owned(), x)),
            _ if refused.is_some() => {}
            (other, _) => return Err(format!("`{name}` = `{other}` is no number")),
        }
    }
    Ok(SoilRow { name: cell("name").into(), values, source: cell("source").into(), refused })
}

/// The numbers of the row that a subsystem's table names; empty when it names none.
pub fn offered(source: &Source, name: &str, node: &Node) -> Result<Map<String, Value>, Box<InputError>> {
    let Some(row) = text(node, "parameters") else { return Ok(Map::new()) };
    let at = |key, message, help| source.error_at_value(&[name, key], message, help);
    let path = match text(node, "parameters_file") {
        Some(file) => Some(source.folder().join(file)),
        None => find_soil_table(&source.folder()),
    };
    let Some(path) = path else {
        let help = Some("give its path with `parameters_file`".to_owned());
        return Err(at("parameters", "no soil table: ../models/soils.csv is not there".to_owned(), help));
    };
    let key = if node.get("parameters_file").is_some() { "parameters_file" } else { "parameters" };
    let rows = read_soil_table(&path).map_err(|message| at(key, message, None))?;
    let Some(found) = rows.iter().find(|r| r.name == row) else {
        let usable = rows.iter().filter(|r| r.refused.is_none()).map(|r| r.name.as_str());
        let message = format!("there is no soil `{row}` in {}", path.display());
        return Err(at("parameters", message, did_you_mean(&row, usable)));
    };
    match &found.refused {
        Some(reason) => {
            let help = Some(format!("`terraglue soils` lists the usable rows; source: {}", found.source));
            Err(at("parameters", format!("the soil `{row}` cannot be used: {reason}"), help))
        }
        None => Ok(found.values.iter().map(|(k, x)| (k.clone(), Value::from(*x))).collect()),
    }
}
