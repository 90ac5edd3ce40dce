//! What a variable of an FMU takes as a start value: its range, and the items of an enumeration.

use terraglue_fmi::description::Variable;
use terraglue_fmi::{Error, Result};
use terraglue_subsystem::ValueType;

/// Refuses numbers that a variable cannot start with.
///
/// # Errors
/// [`Error::WrongInput`]: one that is not finite, or outside the range of the description.
pub fn check(v: &Variable, name: &str, numbers: &[f64]) -> Result {
    let good = |x: &f64| x.is_finite() && (v.min > v.max || (v.min..=v.max).contains(x));
    let Some(wrong) = numbers.iter().find(|x| !good(x)) else { return Ok(()) };
    Err(Error::WrongInput(match wrong.is_finite() {
        true => format!("`{name}` = {wrong} is outside its range from {} to {}", v.min, v.max),
        false => format!("`{name}` = {wrong} is no finite number"),
    }))
}

/// Whether an enumeration may have this number: that of an item, or any where the description lists none.
pub fn is_item(v: &Variable, number: i64) -> bool {
    v.items.is_empty() || v.items.iter().any(|(_, item)| *item == number)
}

/// The number of an item by its name.
pub fn named_item(v: &Variable, name: &str) -> Option<i64> {
    v.items.iter().find(|(item, _)| item == name).map(|(_, number)| *number)
}

/// The items of an enumeration with their numbers, for an error.
pub fn items(v: &Variable) -> String {
    let all: Vec<String> = v.items.iter().map(|(name, number)| format!("{name} = {number}")).collect();
    format!("the items are {}", all.join(", "))
}

/// The kind and number of values that a variable takes, for an error.
pub fn kind(v: &Variable) -> String {
    let kind = match v.value_type {
        ValueType::F64 | ValueType::F32 => "number",
        ValueType::Bool => "truth value (true, false)",
        ValueType::String => "text",
        ValueType::Binary => "row of bytes in hexadecimal digits, as 00ff",
        ValueType::Clock => "tick",
        ValueType::Enumeration => "item of its enumeration",
        _ => "whole number in the range of its type",
    };
    match v.len() {
        1 => format!("one {kind}"),
        count => format!("{count} values with spaces between them, each a {kind}"),
    }
}
