//! `parameters = "row"` or `"soil.toml"`: a row of the soil table or a soil file, offered to the module.

use super::node::{Node, Place, text};
use super::soil_table::{COLUMNS, SoilTable, TableError};
use super::source::Source;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};
use terraglue_diagnostics::InputError;
use terraglue_diagnostics::did_you_mean;

/// Variable with the folder `share/terraglue` of an installation, for programs that are not its own: the interpreter of Python.
const SHARE: &str = "TERRAGLUE_SHARE";

/// The soil table beside a scenario: `models/soils.csv` or `../models/soils.csv` from its folder, the nearer first, that of the
/// current folder, that of the installation (`TERRAGLUE_SHARE`, or beside the program), or that of the sources from whose `target` folder the
/// program runs.
pub fn find_soil_table(folder: &Path) -> Option<PathBuf> {
    let program = std::env::current_exe().ok();
    let program = program.as_deref().and_then(Path::parent);
    let beside_program = ["../share/terraglue/models/soils.csv", "../../models/soils.csv"]
        .into_iter()
        .filter_map(|p| Some(program?.join(p)));
    let near = ["models/soils.csv", "../models/soils.csv"].map(|p| folder.join(p));
    let here = Some(PathBuf::from("models/soils.csv"));
    let share = std::env::var_os(SHARE).map(|share| PathBuf::from(share).join("models/soils.csv"));
    near.into_iter().chain(here).chain(share).chain(beside_program).find(|path| path.is_file())
}

/// Whether the rows of a soil table have a number of this name.
pub fn gives(parameter: &str) -> bool {
    COLUMNS.contains(&parameter)
}

/// Reads a soil table.
///
/// # Errors
/// A file that cannot be read or is malformed, with its path.
pub fn read_soil_table(path: &Path) -> Result<SoilTable, String> {
    let text = terraglue_subsystem::files::read_text(path)
        .map_err(|e| format!("cannot read {}: {e}", path.display()))?;
    SoilTable::parse(&text).map_err(|e| format!("{}: {e}", path.display()))
}

/// The numbers of the row that a subsystem's table names; empty when it names none. A row that lacks a number is
/// refused unless the table gives that number itself.
pub fn offered(
    source: &Source,
    name: &str,
    node: &Node,
    module: &str,
) -> Result<Map<String, Value>, Box<InputError>> {
    let Some(row) = text(node, "parameters") else { return Ok(Map::new()) };
    let overridden: Vec<&str> = keys(node).chain(node.get(module).into_iter().flat_map(keys)).collect();
    let place = source.value_place(&[name, "parameters"]);
    numbers(source, name, node, &row, &overridden, &place)
}

/// The numbers of a row, or of a soil file, that is named at `place` in the subsystem's table.
pub fn numbers(
    source: &Source,
    name: &str,
    node: &Node,
    row: &str,
    overridden: &[&str],
    place: &Place,
) -> Result<Map<String, Value>, Box<InputError>> {
    let at = |key, message: String, help| match key {
        "parameters" => source.error(place, message, help),
        _ => source.error_at_value(&[name, key], message, help),
    };
    if row.ends_with(".toml") {
        return own_file(&source.folder().join(row))
            .map_err(|(message, help)| at("parameters", message, help));
    }
    let file = text(node, "parameters_file").map(|file| source.folder().join(file));
    let key = if file.is_some() { "parameters_file" } else { "parameters" };
    let Some(path) = file.or_else(|| find_soil_table(&source.folder())) else {
        let help = Some("give its path with `parameters_file`".to_owned());
        return Err(at("parameters", "no soil table: ../models/soils.csv is not there".to_owned(), help));
    };
    let table = read_soil_table(&path).map_err(|message| at(key, message, None))?;
    let numbers = table.row(row).and_then(|found| found.offered(overridden));
    match numbers {
        Ok(numbers) => Ok(numbers.into_iter().map(|(key, x)| (key.to_owned(), Value::from(x))).collect()),
        Err(TableError::Unknown { name, known }) => {
            let message = format!("there is no soil `{name}` in {}", path.display());
            Err(at("parameters", message, did_you_mean(&name, known.iter().map(String::as_str))))
        }
        Err(other) => {
            let help = Some("`terraglue soils` lists the rows that can be used".to_owned());
            Err(at("parameters", other.to_string(), help))
        }
    }
}

/// The table `[soil]` of a soil file, as `terraglue fit-soil` writes it.
fn own_file(path: &Path) -> Result<Map<String, Value>, (String, Option<String>)> {
    let said = |what: String| (format!("{}: {what}", path.display()), None);
    let text =
        terraglue_subsystem::files::read_text(path).map_err(|e| said(format!("cannot read it: {e}")))?;
    let document: toml_edit::DocumentMut = text.parse().map_err(|e| said(format!("{e}")))?;
    let table = document.get("soil").and_then(|t| t.as_table_like()).ok_or_else(|| {
        let help = Some("`terraglue fit-soil` writes such files".to_owned());
        (format!("{}: there is no table [soil]", path.display()), help)
    })?;
    let value = |key: &str, item: &toml_edit::Item| {
        let number = item.as_float().or_else(|| item.as_integer().map(|i| i as f64)).map(Value::from);
        let value =
            number.or_else(|| item.as_str().map(Value::from)).or_else(|| item.as_bool().map(Value::from));
        let wrong = || said(format!("`{key}` takes a number, a text, true or false"));
        value.map(|v| (key.to_owned(), v)).ok_or_else(wrong)
    };
    table.iter().map(|(key, item)| value(key, item)).collect()
}

fn keys(node: &Node) -> impl Iterator<Item = &str> {
    node.entries().iter().map(|(key, _)| key.as_str())
}
