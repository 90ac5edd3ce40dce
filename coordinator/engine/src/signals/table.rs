//! Tables of connections: what each truth value, whole number or item of an enumeration becomes on its way.

use super::access::VariableRef;
use serde_json::Value;
use std::collections::BTreeMap;
use terraglue_host::Instance;
use terraglue_subsystem::{ValueType, Variable};

/// New value by value, both as whole numbers: 0 and 1 of truth values, positions of items.
pub type Table = BTreeMap<i128, i128>;

/// Whether a table can hold values of a type.
pub fn takes(value_type: ValueType) -> bool {
    use ValueType::{Binary, Clock, F32, F64, String};
    !matches!(value_type, F64 | F32 | String | Binary | Clock)
}

/// The table of a connection in numbers; nothing where it has none.
///
/// # Errors
/// An entry that is no value of the variable on its side.
pub fn resolve(
    map: &[(String, Value)],
    instances: &[Instance],
    from: VariableRef,
    to: VariableRef,
) -> Result<Option<Table>, String> {
    if map.is_empty() {
        return Ok(None);
    }
    let (from, to) = (from.describe(instances), to.describe(instances));
    let mut table = Table::new();
    for (key, value) in map {
        let source = number(from, key).ok_or_else(|| none(from, key))?;
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let target = number(to, &text).ok_or_else(|| none(to, &text))?;
        if table.insert(source, target).is_some() {
            return Err(format!("`map` has `{key}` twice"));
        }
    }
    Ok(Some(table))
}

fn none(v: &Variable, text: &str) -> String {
    format!("`map` has `{text}`, which is no value of `{}`", v.name)
}

/// A value as it is written, as a whole number.
fn number(v: &Variable, text: &str) -> Option<i128> {
    match v.value_type {
        ValueType::Bool => match text {
            "true" | "1" => Some(1),
            "false" | "0" => Some(0),
            _ => None,
        },
        ValueType::Enumeration => {
            let named = v.enumeration.iter().position(|n| n == text).map(|k| k as i128);
            let count = v.enumeration.len() as i128;
            named.or_else(|| text.parse().ok().filter(|k| (0..count).contains(k)))
        }
        _ => text.parse().ok(),
    }
}
