//! Transformations of connections and mappings: a line, or a table of values.

use super::{Table, Transformation, Value};
use crate::description::element::Element;
use crate::error::Result;

/// The transformation inside a connection or an entry of a mapping.
pub fn transformation(element: &Element) -> Result<Transformation> {
    let mut found =
        Transformation { keeps_unit: element.flag("suppressUnitConversion")?, ..Transformation::default() };
    for inner in element.children() {
        match inner.name() {
            "LinearTransformation" => {
                found.factor = inner.optional_number("factor")?.unwrap_or(1.0);
                found.offset = inner.optional_number("offset")?.unwrap_or(0.0);
                if !(found.factor.is_finite() && found.offset.is_finite()) {
                    return Err(inner.error("factor and offset must be finite"));
                }
            }
            "BooleanMappingTransformation" => {
                found.table =
                    Some(table(&inner, |e, key| e.required(key).and(e.flag(key)).map(Value::Boolean))?);
            }
            "IntegerMappingTransformation" => {
                let whole = |e: &Element, key: &str| {
                    e.required(key)?;
                    let number = e.whole(key, "a whole number")?;
                    number.map(Value::Integer).ok_or_else(|| e.error(format!("lacks the attribute `{key}`")))
                };
                found.table = Some(table(&inner, whole)?);
            }
            "EnumerationMappingTransformation" => {
                let text = |e: &Element, key: &str| Ok(Value::Text(e.required(key)?.to_owned()));
                found.table = Some(table(&inner, text)?);
            }
            name if name.ends_with("Transformation") => {
                return Err(inner.error("this transformation is not read here"));
            }
            _ => {}
        }
    }
    Ok(found)
}

/// The entries of a table, each value once.
fn table(element: &Element, value: impl Fn(&Element, &str) -> Result<Value>) -> Result<Table> {
    let mut found = Table::default();
    for entry in element.children().filter(|e| e.name() == "MapEntry") {
        let (source, target) = (value(&entry, "source")?, value(&entry, "target")?);
        if found.of(&source).is_some() {
            return Err(entry.error(format!("the value {} occurs twice", entry.text("source"))));
        }
        found.0.push((source, target));
    }
    match found.0.is_empty() {
        true => Err(element.error("has no <MapEntry>")),
        false => Ok(found),
    }
}
