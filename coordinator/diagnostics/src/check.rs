//! Checks one value against a [`Parameter`]: type, range, choices. The same for the scenario's own keys and for
//! the parameters of modules.

use crate::did_you_mean;
use serde_json::Value;
use terraglue_subsystem::{Parameter, ParameterType};

/// A problem with a value; the caller adds the place.
#[derive(Debug, PartialEq)]
pub struct Complaint {
    /// Description of the problem.
    pub message: String,
    /// The way out.
    pub help: Option<String>,
}

/// The way out where an angle is refused that is one in degrees.
fn in_radians(unit: &str, x: f64, allowed: impl Fn(f64) -> bool) -> Option<String> {
    let radians = three_digits(x.to_radians());
    (unit == "rad" && x.abs() > 1.0 && allowed(radians))
        .then(|| format!("angles are in radians: {x} degrees are {radians} rad"))
}

fn three_digits(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

/// Checks a value; `count` demands a list of that length.
///
/// # Errors
/// The first [`Complaint`]: a wrong type, a number out of range, a wrong choice or a list of another length.
pub fn check_value(parameter: &Parameter, count: Option<usize>, value: &Value) -> Result<(), Complaint> {
    match parameter.parameter_type {
        ParameterType::Number => check_number(parameter, count, value.as_f64(), value),
        ParameterType::Integer => {
            check_number(parameter, count, value.as_i64().map(|i| i as f64).filter(|_| value.is_i64()), value)
        }
        ParameterType::Bool => typed(parameter, count, value.is_boolean(), value),
        ParameterType::Text | ParameterType::Path => check_text(parameter, count, value),
        ParameterType::Numbers => check_list(parameter, count, value),
        ParameterType::NumberTable => {
            let ok = value.as_object().is_some_and(|o| o.values().all(Value::is_number));
            typed(parameter, count, ok, value)?;
            let values = value.as_object().into_iter().flatten();
            values.into_iter().try_for_each(|(key, v)| {
                in_range(&below(parameter, key), count, v.as_f64().unwrap_or(f64::NAN), v)
            })
        }
        ParameterType::NumberByName => {
            by_name(parameter, value).try_for_each(|(p, v)| check_number(&p, count, v.as_f64(), v))
        }
        ParameterType::TextByName => {
            by_name(parameter, value).try_for_each(|(p, v)| check_text(&p, count, v))
        }
        ParameterType::Tables => {
            let ok = value.as_array().is_some_and(|list| list.iter().all(Value::is_object));
            typed(parameter, count, ok, value)
        }
    }
}

/// The values of a table under their own names, or the value itself.
fn by_name<'a>(p: &'a Parameter, value: &'a Value) -> Box<dyn Iterator<Item = (Parameter, &'a Value)> + 'a> {
    match value {
        Value::Object(table) => Box::new(table.iter().map(|(key, value)| (below(p, key), value))),
        one => Box::new(std::iter::once((p.clone(), one))),
    }
}

/// A parameter as an entry of its table.
fn below(p: &Parameter, key: &str) -> Parameter {
    Parameter { name: format!("{}.{key}", p.name), ..p.clone() }
}

fn check_number(
    p: &Parameter,
    count: Option<usize>,
    number: Option<f64>,
    value: &Value,
) -> Result<(), Complaint> {
    typed(p, count, number.is_some(), value)?;
    in_range(p, count, number.unwrap_or(f64::NAN), value)
}

fn check_list(p: &Parameter, count: Option<usize>, value: &Value) -> Result<(), Complaint> {
    let list = value.as_array().filter(|l| l.iter().all(Value::is_number));
    typed(p, count, list.is_some_and(|l| count.is_none_or(|n| n == l.len())), value)?;
    list.into_iter().flatten().try_for_each(|v| in_range(p, count, v.as_f64().unwrap_or(f64::NAN), value))
}

fn check_text(p: &Parameter, count: Option<usize>, value: &Value) -> Result<(), Complaint> {
    typed(p, count, value.is_string(), value)?;
    let text = value.as_str().unwrap_or_default();
    if p.choices.is_empty() || p.choices.iter().any(|c| c == text) {
        return Ok(());
    }
    let help = did_you_mean(text, p.choices.iter().map(String::as_str));
    Err(Complaint { message: format!("unknown {} `{text}`", last_part(&p.name)), help })
}

fn in_range(p: &Parameter, count: Option<usize>, x: f64, value: &Value) -> Result<(), Complaint> {
    let low = p.min.is_none_or(|min| x > min || x == min && !p.above_min);
    let high = p.max.is_none_or(|max| x <= max);
    if x.is_finite() && low && high {
        return plausible(p, x, value);
    }
    let message =
        format!("`{}` = {value} is out of range: it takes {}", last_part(&p.name), allowed(p, count));
    let degrees = in_radians(&p.unit, x, |x| p.min.is_none_or(|a| x >= a) && p.max.is_none_or(|b| x <= b));
    Err(Complaint { message, help: degrees.or_else(|| help_line(p)) })
}

/// The magnitudes of quantities by unit, from the smallest of those that must be positive to the largest: far beyond all that is
/// simulated, and near enough to 1 that products of a few of them are still numbers.
const MAGNITUDES: [(&str, f64, f64); 8] = [
    ("m", 1e-9, 1e6),
    ("s", 1e-15, 1e9),
    ("rad", 1e-9, 1e6),
    ("m/s", 1e-9, 1e6),
    ("rad/s", 1e-9, 1e6),
    ("m/s^2", 1e-9, 1e6),
    ("kg", 1e-9, 1e9),
    ("kg/m^3", 1e-3, 1e6),
];
/// Those of all other quantities and of pure numbers.
const ANY_MAGNITUDE: [f64; 2] = [1e-30, 1e15];

/// The largest magnitude that a quantity of such a unit can plausibly have: more is refused where it has no bound of its own.
pub fn largest_plausible(unit: &str) -> f64 {
    magnitudes(unit)[1]
}

fn magnitudes(unit: &str) -> [f64; 2] {
    let own = MAGNITUDES.iter().find(|(name, ..)| *name == unit).map(|(_, low, high)| [*low, *high]);
    own.unwrap_or(ANY_MAGNITUDE)
}

/// Refuses what is far beyond all that the quantity can be, where the parameter itself has no bound on that side.
fn plausible(p: &Parameter, x: f64, value: &Value) -> Result<(), Complaint> {
    let [smallest, largest] = magnitudes(&p.unit);
    // whole numbers are counts and seeds, whose bounds are those of their type
    let is_count = p.parameter_type == ParameterType::Integer;
    let too_small = p.above_min && p.min == Some(0.0) && x < smallest;
    let too_large = p.max.is_none() && x.abs() > largest;
    if is_count || !(too_small || too_large) {
        return Ok(());
    }
    let unit = if ["", "1"].contains(&p.unit.as_str()) { String::new() } else { format!(" {}", p.unit) };
    let span = match () {
        () if too_small => format!("at least {smallest:e}{unit}"),
        () if p.min.is_some_and(|min| min >= 0.0) => format!("at most {largest:e}{unit}"),
        () => format!("at most {largest:e}{unit} in either direction"),
    };
    let message = format!("`{}` = {value} is out of range: plausible is {span}", last_part(&p.name));
    Err(Complaint { message, help: help_line(p) })
}

fn typed(p: &Parameter, count: Option<usize>, ok: bool, value: &Value) -> Result<(), Complaint> {
    if ok {
        return Ok(());
    }
    if let Some(digits) =
        value.as_str().filter(|text| p.parameter_type == ParameterType::Integer && is_whole(text))
    {
        let message =
            format!("`{}` = {digits} is out of range: it takes {}", last_part(&p.name), allowed(p, count));
        return Err(Complaint { message, help: Some(LARGEST_WHOLE.into()) });
    }
    let message = format!("`{}` takes {}, not {}", last_part(&p.name), allowed(p, count), describe(value));
    Err(Complaint { message, help: help_line(p) })
}

/// Help about whole numbers that TOML cannot hold; an edit brings them as text.
pub const LARGEST_WHOLE: &str =
    "whole numbers of a scenario go from -9223372036854775808 to 9223372036854775807 (64 bits, signed)";

fn is_whole(text: &str) -> bool {
    let digits = text.trim_start_matches(['-', '+']);
    !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
}

fn help_line(p: &Parameter) -> Option<String> {
    let default = if p.default.is_null() { String::new() } else { format!(" (default {})", p.default) };
    Some(format!("{}: {}{default}", p.name, p.help))
}

fn last_part(name: &str) -> &str {
    name.strip_suffix(".*").unwrap_or(name).rsplit('.').next().unwrap_or(name)
}

/// Numbers of TOML that no parameter takes.
const NOT_FINITE: &str = "nan or inf";

fn describe(value: &Value) -> String {
    match value {
        Value::Null => NOT_FINITE.into(),
        // as which nan and inf of a list or table arrive
        Value::Array(items) if items.contains(&Value::Null) => format!("a list with {NOT_FINITE} in it"),
        Value::Object(table) if table.values().any(Value::is_null) => {
            format!("a table with {NOT_FINITE} in it")
        }
        Value::Bool(b) => format!("{b}"),
        Value::Number(n) => format!("{n}"),
        Value::String(t) => format!("the text \"{t}\""),
        Value::Array(items) => format!("the list {} of {}", value, items.len()),
        Value::Object(_) => "a table".into(),
    }
}

/// The allowed values of a parameter in words, e.g. `a number greater than 0 m`.
pub fn allowed_values(p: &Parameter) -> String {
    allowed(p, None)
}

/// The same for a list of `count` numbers.
pub fn allowed(p: &Parameter, count: Option<usize>) -> String {
    let range = range(p);
    match (p.parameter_type, count) {
        (ParameterType::Number, _) => format!("a number{range}"),
        (ParameterType::Integer, _) => format!("a whole number{range}"),
        (ParameterType::Bool, _) => "true or false".into(),
        (ParameterType::Path, _) => "the path of a file".into(),
        (ParameterType::Text, _) if p.choices.is_empty() => "text in quotes".into(),
        (ParameterType::Text, _) => {
            let quoted: Vec<String> = p.choices.iter().map(|c| format!("\"{c}\"")).collect();
            quoted.join(" or ")
        }
        (ParameterType::Numbers, Some(n)) => format!("a list of {n} numbers{range}"),
        (ParameterType::Numbers, None) => format!("a list of numbers{range}"),
        (ParameterType::Tables, _) => "a list of tables, [[...]]".into(),
        (ParameterType::NumberTable, _) => format!("a table of numbers{range}"),
        (ParameterType::NumberByName, _) => format!("a number{range}, or a table of them by name"),
        (ParameterType::TextByName, _) => {
            let quoted: Vec<String> = p.choices.iter().map(|c| format!("\"{c}\"")).collect();
            format!("{}, or a table of them by name", quoted.join(" or "))
        }
    }
}

/// ` from 0 to 1 m`, ` greater than 0`, or nothing.
fn range(p: &Parameter) -> String {
    let unit = if ["", "1"].contains(&p.unit.as_str()) { String::new() } else { format!(" {}", p.unit) };
    match (p.min, p.max) {
        (Some(min), Some(max)) if p.above_min => format!(" greater than {min} and at most {max}{unit}"),
        (Some(min), Some(max)) => format!(" from {min} to {max}{unit}"),
        (Some(min), None) if p.above_min => format!(" greater than {min}{unit}"),
        (Some(min), None) => format!(" of at least {min}{unit}"),
        (None, Some(max)) => format!(" of at most {max}{unit}"),
        (None, None) => {
            if unit.is_empty() {
                unit
            } else {
                format!(" in{unit}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_are_recognised() {
        assert_eq!(
            in_radians("rad", 35.0, |x| x < 1.2),
            Some("angles are in radians: 35 degrees are 0.611 rad".into())
        );
        assert_eq!(in_radians("m", 35.0, |_| true).or(in_radians("rad", 0.5, |_| true)), None);
    }

    #[test]
    fn what_nothing_can_mean_is_refused_by_its_unit() {
        let length = Parameter::number("gait.hip_m", "m", 0.1, "Hip").positive();
        let force = Parameter::of("max", ParameterType::NumberByName, "Force").optional();
        let seed = Parameter::of("seed", ParameterType::Integer, "Seed").within(0.0, f64::INFINITY);
        let bounded = Parameter::number("stiff", "m", 1.0, "Own bounds").within(0.0, 1e200);
        let told = |p: &Parameter, x: Value| check_value(p, None, &x).err().map(|c| c.message);
        for (p, x) in [
            (&length, 1e6.into()),
            (&length, 1e-9.into()),
            (&force, (-1e15).into()),
            (&force, 0.0.into()),
            (&force, 1e-300.into()),
            (&seed, i64::MAX.into()),
            (&bounded, 1e150.into()),
        ] {
            assert_eq!(told(p, x), None, "{}", p.name);
        }
        let refused = |p, x| told(p, x).unwrap_or_default();
        assert!(refused(&length, 1e7.into()).ends_with("plausible is at most 1e6 m"));
        assert!(refused(&length, 1e-10.into()).ends_with("plausible is at least 1e-9 m"));
        let by_name = serde_json::json!({ "arm": 1.0, "leg": -1e16 });
        assert!(refused(&force, by_name).ends_with("plausible is at most 1e15 in either direction"));
    }
}
