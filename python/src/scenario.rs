//! A scenario from a file, the name of one that comes with the package, or a dictionary.

use crate::errors;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString, PyTuple};
use serde_json::Value;
use std::path::{Path, PathBuf};
use terraglue::scenario::Scenario;

/// The scenario, edited by `set` and `seed`.
pub fn load(
    given: &Bound<'_, PyAny>,
    set: Option<&Bound<'_, PyAny>>,
    seed: Option<u64>,
) -> PyResult<Scenario> {
    let py = given.py();
    let sets = edits(set, seed)?;
    let loaded = match given.cast::<PyMapping>() {
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

/// Key paths and values as of `--set`, the seed among them.
pub fn edits(set: Option<&Bound<'_, PyAny>>, seed: Option<u64>) -> PyResult<Vec<(String, String)>> {
    let mut all = Vec::new();
    if let Some(set) = set {
        let table = set
            .cast::<PyMapping>()
            .map_err(|_| errors::refused(set.py(), "set: a dictionary of key paths and values is wanted"))?;
        for item in table.items()?.iter() {
            let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
            let key: String = key.extract().map_err(|_| {
                errors::refused(set.py(), format!("set: {key} is no key path: a text is wanted"))
            })?;
            all.push((key.clone(), edit(&key, &value)?));
        }
    }
    all.extend(seed.map(|seed| ("world.seed".to_owned(), seed.to_string())));
    Ok(all)
}

/// The value of an edit.
fn edit(key: &str, given: &Bound<'_, PyAny>) -> PyResult<String> {
    let value = value_of(given)?;
    match &value {
        // quoted where it would be read as something else
        Value::String(text) => Ok(toml::Value::from(text.as_str()).to_string()),
        other => written(other).ok_or_else(|| {
            errors::refused(given.py(), format!("set: `{key}` = {other} is no value of a scenario"))
        }),
    }
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

/// Levels of lists and tables in a value.
const DEEPEST: usize = 32;

/// A Python value as JSON, numbers to their last bit; NumPy scalars, arrays and paths too.
pub fn value_of(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    at_level(value, 0)
}

fn at_level(value: &Bound<'_, PyAny>, level: usize) -> PyResult<Value> {
    let py = value.py();
    let refused = |why: String| Err(errors::refused(py, why));
    if level > DEEPEST {
        return refused(format!(
            "a value of a scenario has at most {DEEPEST} levels, and does not hold itself"
        ));
    }
    if value.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Value::String(text.extract()?));
    }
    if let Ok(truth) = value.cast::<PyBool>() {
        return Ok(Value::Bool(truth.is_true()));
    }
    if value.is_instance_of::<PyInt>() {
        let number =
            value.extract::<i64>().map(Value::from).or_else(|_| value.extract::<u64>().map(Value::from));
        return number
            .or_else(|_| refused(format!("{value} is no value of a scenario: it has more than 64 bits")));
    }
    if value.is_instance_of::<PyFloat>() {
        let number = serde_json::Number::from_f64(value.extract()?).map(Value::Number);
        return number
            .map_or_else(|| refused(format!("{value} is no value of a scenario: give a finite number")), Ok);
    }
    if let Ok(table) = value.cast::<PyMapping>() {
        return table_of(table, level);
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        return value
            .try_iter()?
            .map(|item| at_level(&item?, level + 1))
            .collect::<PyResult<Vec<_>>>()
            .map(Value::Array);
    }
    if value.hasattr("tolist")? {
        return at_level(&value.call_method0("tolist")?, level + 1);
    }
    if value.hasattr("__fspath__")? {
        return Ok(Value::String(value.str()?.extract()?));
    }
    refused(format!("{value}, of type {}, is no value of a scenario", value.get_type().name()?))
}

fn table_of(table: &Bound<'_, PyMapping>, level: usize) -> PyResult<Value> {
    let mut all = serde_json::Map::new();
    for item in table.items()?.iter() {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let Ok(key) = key.extract::<String>() else {
            return Err(errors::refused(
                table.py(),
                format!("{key} is no key of a scenario: a text is wanted"),
            ));
        };
        all.insert(key, at_level(&value, level + 1)?);
    }
    Ok(Value::Object(all))
}

/// `[task]` of a scenario as a dictionary; None where it has none.
#[pyfunction]
#[pyo3(signature = (scenario, *, set=None))]
pub fn task<'py>(
    scenario: &Bound<'py, PyAny>,
    set: Option<&Bound<'py, PyAny>>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let loaded = load(scenario, set, None)?;
    let Some(task) = loaded.task else { return Ok(None) };
    let out = PyDict::new(scenario.py());
    for (key, names) in
        [("observe", task.observe), ("reward", task.reward), ("cost", task.cost), ("tilt", task.tilt)]
    {
        out.set_item(key, names)?;
    }
    out.set_item("act", task.act)?;
    out.set_item("fallen_rad", task.fallen_rad)?;
    out.set_item("period_s", task.period_s)?;
    out.set_item("duration_s", task.duration_s.unwrap_or(loaded.time.duration_s))?;
    Ok(Some(out))
}
