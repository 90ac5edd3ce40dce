//! The table of an FMU in a scenario: keys of the host, structural parameters and start values.

use serde_json::{Map, Value};
use std::path::PathBuf;
use terraglue_subsystem::{Error, Result};

/// Reaction to a value that is no number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnNan {
    /// It stops the run.
    #[default]
    Stop,
    /// It is logged; what reads it decides.
    Warn,
}

impl OnNan {
    /// By its name.
    pub fn of(name: &str) -> Option<Self> {
        match name {
            "stop" => Some(Self::Stop),
            "warn" => Some(Self::Warn),
            _ => None,
        }
    }
}

/// Keys of the host in the table of an FMU.
pub struct Options {
    /// Reaction to a value that is no number.
    pub on_nan: OnNan,
    /// Whether events are handled in event mode.
    pub event_mode: bool,
    /// Whether the FMU's state may be saved before a step.
    pub rollback: bool,
    /// Glued bodies by name.
    pub bodies: Map<String, Value>,
    /// Relative tolerance; none: that of the description.
    pub tolerance: Option<f64>,
    /// Time of the FMU at t = 0 of the run, s.
    pub start_time_s: f64,
    /// Time of the FMU after which it is not stepped, s.
    pub stop_time_s: Option<f64>,
    /// Categories of its log that are switched on.
    pub log_categories: Vec<String>,
    /// Whether defects of its description are errors.
    pub strict: bool,
    /// File that takes a line for each call, if any.
    pub trace: Option<PathBuf>,
    /// Which of these keys are set.
    pub keys: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            on_nan: OnNan::Stop,
            event_mode: false,
            rollback: true,
            bodies: Map::new(),
            tolerance: None,
            start_time_s: 0.0,
            stop_time_s: None,
            log_categories: Vec::new(),
            strict: false,
            trace: None,
            keys: Vec::new(),
        }
    }
}

/// The host's keys and the start values, whose nested tables become dotted names.
pub fn options(parameters: &Map<String, Value>) -> Result<(Options, Vec<(String, Value)>)> {
    let mut options = Options::default();
    let mut start = Vec::new();
    for (key, value) in parameters {
        let wrong = |takes: &str| Error::Refused(format!("`{key}` takes {takes}, not {value}"));
        let time = || value.as_f64().filter(|x| x.is_finite()).ok_or_else(|| wrong("a time in s"));
        match (key.as_str(), value) {
            ("on_nan", _) => {
                let own = value.as_str().and_then(OnNan::of);
                options.on_nan = own.ok_or_else(|| wrong("\"stop\" or \"warn\""))?;
            }
            ("event_mode", Value::Bool(on)) => options.event_mode = *on,
            ("event_mode", _) => return Err(wrong("true or false")),
            ("rollback", Value::Bool(on)) => options.rollback = *on,
            ("rollback", _) => return Err(wrong("true or false")),
            ("strict", Value::Bool(on)) => options.strict = *on,
            ("strict", _) => return Err(wrong("true or false")),
            ("trace", Value::String(path)) => options.trace = Some(path.into()),
            ("trace", _) => return Err(wrong("the path of a file")),
            ("tolerance", _) => {
                let number = value.as_f64().filter(|x| *x > 0.0 && x.is_finite());
                options.tolerance = Some(number.ok_or_else(|| wrong("a number above 0"))?);
            }
            ("start_time_s", _) => options.start_time_s = time()?,
            ("stop_time_s", _) => options.stop_time_s = Some(time()?),
            ("log_categories", Value::Array(list)) => {
                let name = |v: &Value| v.as_str().map(str::to_owned);
                let names: Option<Vec<String>> = list.iter().map(name).collect();
                options.log_categories = names.ok_or_else(|| wrong("a list of names"))?;
            }
            ("log_categories", _) => return Err(wrong("a list of names, or [\"all\"]")),
            ("bodies", Value::Object(table)) => options.bodies = table.clone(),
            ("start", Value::Object(below)) => {
                below.iter().for_each(|(k, v)| flatten(k.clone(), v, &mut start));
                continue;
            }
            _ => {
                flatten(key.clone(), value, &mut start);
                continue;
            }
        }
        options.keys.push(key.clone());
    }
    if let Some(stop) = options.stop_time_s.filter(|stop| *stop <= options.start_time_s) {
        let begins = options.start_time_s;
        return Err(Error::Refused(format!(
            "`stop_time_s` = {stop} is not after `start_time_s` = {begins}: the FMU would end before it begins"
        )));
    }
    Ok((options, start))
}

/// Keys of the host that are set in the table of an FMU, which are no start values.
///
/// # Errors
/// A key of the host with a value that it does not take.
pub fn host_keys(parameters: &Map<String, Value>) -> Result<Vec<String>> {
    Ok(options(parameters)?.0.keys)
}

/// Start values in the table of an FMU, without the keys of the host.
///
/// # Errors
/// A key of the host with a value that it does not take.
pub fn start_values(parameters: &Map<String, Value>) -> Result<Vec<(String, Value)>> {
    Ok(options(parameters)?.1)
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
