//! The table of an FMU in a scenario: keys of the host, structural parameters and start values.

use serde_json::{Map, Value};
use terraglue_subsystem::{Error, Result};

/// What a value that is no number does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnNan {
    /// It stops the run.
    Stop,
    /// It is logged; what reads it decides.
    Warn,
}

/// Keys of the host in the table of an FMU.
pub struct Options {
    /// What a value that is no number does.
    pub on_nan: OnNan,
    /// Whether events are handled in event mode.
    pub event_mode: bool,
    /// Whether the FMU's state may be saved before a step.
    pub rollback: bool,
    /// Glued bodies by name.
    pub bodies: Map<String, Value>,
}

/// The host's keys and the start values, whose nested tables become dotted names.
pub fn options(parameters: &Map<String, Value>) -> Result<(Options, Vec<(String, Value)>)> {
    let mut options = Options { on_nan: OnNan::Stop, event_mode: false, rollback: true, bodies: Map::new() };
    let mut start = Vec::new();
    for (key, value) in parameters {
        let wrong = |takes: &str| Error::Refused(format!("`{key}` takes {takes}, not {value}"));
        match (key.as_str(), value) {
            ("on_nan", Value::String(t)) if t == "stop" => options.on_nan = OnNan::Stop,
            ("on_nan", Value::String(t)) if t == "warn" => options.on_nan = OnNan::Warn,
            ("on_nan", _) => return Err(wrong("\"stop\" or \"warn\"")),
            ("event_mode", Value::Bool(on)) => options.event_mode = *on,
            ("event_mode", _) => return Err(wrong("true or false")),
            ("rollback", Value::Bool(on)) => options.rollback = *on,
            ("rollback", _) => return Err(wrong("true or false")),
            ("bodies", Value::Object(table)) => options.bodies = table.clone(),
            ("start", Value::Object(below)) => {
                below.iter().for_each(|(k, v)| flatten(k.clone(), v, &mut start));
            }
            _ => flatten(key.clone(), value, &mut start),
        }
    }
    Ok((options, start))
}

/// Values of structural parameters, and all others, which may be elements of the arrays that those give their sizes.
pub type Structure = (Vec<(String, i128)>, Vec<(String, Value)>);

/// Divides them.
///
/// # Errors
/// A structural parameter that is no whole number.
pub fn structure(
    description: &terraglue_fmi::ModelDescription,
    start: Vec<(String, Value)>,
) -> Result<Structure> {
    use terraglue_fmi::description::Causality;
    let structural = |name: &str| {
        let variable = description.position(name).map(|k| &description.variables[k]);
        variable.is_some_and(|v| v.causality == Causality::StructuralParameter)
    };
    let (own, others): (Vec<_>, Vec<_>) = start.into_iter().partition(|(name, _)| structural(name));
    let whole = |(name, value): (String, Value)| {
        let number = value.as_i64().map(i128::from).or(value.as_u64().map(i128::from));
        match number {
            Some(number) => Ok((name, number)),
            None => Err(Error::Refused(format!(
                "`{name}` of the FMU is a structural parameter and takes a whole number, not {value}"
            ))),
        }
    };
    Ok((own.into_iter().map(whole).collect::<Result<_>>()?, others))
}

/// Names of single values: `a.b` of tables, `a[2]` and `a[2,1]` of lists and lists of lists.
fn flatten(name: String, value: &Value, all: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(below) => below.iter().for_each(|(k, v)| flatten(format!("{name}.{k}"), v, all)),
        Value::Array(items) => {
            for (k, v) in items.iter().enumerate() {
                let index = match name.strip_suffix(']') {
                    Some(outer) => format!("{outer},{}]", k + 1),
                    None => format!("{name}[{}]", k + 1),
                };
                flatten(index, v, all);
            }
        }
        other => all.push((name, other.clone())),
    }
}
