//! A scenario from a file, the name of one that comes with the package, or a dictionary.

use crate::errors;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;
use std::path::{Path, PathBuf};
use terraglue::scenario::Scenario;

/// The scenario, edited by `set` and `seed`.
pub fn load(
    given: &Bound<'_, PyAny>,
    set: Option<&Bound<'_, PyDict>>,
    seed: Option<u64>,
) -> PyResult<Scenario> {
    let py = given.py();
    let mut sets = set.map(edits).transpose()?.unwrap_or_default();
    sets.extend(seed.map(|seed| ("world.seed".to_owned(), seed.to_string())));
    let loaded = match given.cast::<PyDict>() {
        Ok(table) => {
            let value = value_of(table.as_any())?;
            let text = toml::to_string(&value)
                .map_err(|e| errors::refused(py, format!("the dictionary is no scenario: {e}")))?;
            Scenario::parse(&text, "scenario.toml", &sets)
        }
        Err(_) => {
            let path: PathBuf =
                py.import("terraglue.paths")?.getattr("scenario")?.call1((given,))?.extract()?;
            Scenario::load(&path, &sets)
        }
    };
    loaded.map_err(|error| errors::wrong_input(py, &error))
}

/// Folders with modules: those that are named, then that of the package.
pub fn module_paths(py: Python<'_>, given: Vec<PathBuf>) -> PyResult<Vec<PathBuf>> {
    let own: PathBuf = py.import("terraglue.paths")?.getattr("MODULES")?.extract()?;
    Ok(given.into_iter().chain([own].into_iter().filter(|own| Path::new(own).is_dir())).collect())
}

/// Key paths and values as of `--set`.
pub fn edits(set: &Bound<'_, PyDict>) -> PyResult<Vec<(String, String)>> {
    let one = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let value = value_of(&value)?;
        let text = match &value {
            // quoted where it would be read as something else
            Value::String(text) => toml::Value::from(text.as_str()).to_string(),
            other => written(other).ok_or_else(|| {
                errors::refused(key.py(), format!("set: {other} is no value of a scenario"))
            })?,
        };
        Ok((key.extract()?, text))
    };
    set.iter().map(one).collect()
}

/// A value within a line of TOML.
fn written(value: &Value) -> Option<String> {
    Some(match value {
        Value::Array(items) => {
            format!("[{}]", items.iter().map(written).collect::<Option<Vec<_>>>()?.join(", "))
        }
        Value::Object(entries) => {
            let entry = |(key, value): (&String, &Value)| {
                Some(format!("{} = {}", toml::Value::from(key.as_str()), written(value)?))
            };
            format!("{{ {} }}", entries.iter().map(entry).collect::<Option<Vec<_>>>()?.join(", "))
        }
        Value::Null => return None,
        Value::String(text) => toml::Value::from(text.as_str()).to_string(),
        Value::Number(number) if number.is_f64() => format!("{:?}", number.as_f64()?),
        other => other.to_string(),
    })
}

/// A Python value as JSON, by Python's own writer; NumPy scalars, arrays and paths too.
pub fn value_of(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    let py = value.py();
    let plain = |item: &Bound<'_, PyAny>| -> PyResult<Py<PyAny>> {
        match item.hasattr("tolist")? {
            true => Ok(item.call_method0("tolist")?.unbind()),
            false => Ok(item.str()?.into_any().unbind()),
        }
    };
    let default = pyo3::types::PyCFunction::new_closure(py, None, None, move |arguments, _| {
        plain(&arguments.get_item(0)?)
    })?;
    let keywords = PyDict::new(py);
    keywords.set_item("default", default)?;
    let text: String = py.import("json")?.call_method("dumps", (value,), Some(&keywords))?.extract()?;
    serde_json::from_str(&text)
        .map_err(|e| errors::refused(py, format!("{text} is no value of a scenario: {e}")))
}
