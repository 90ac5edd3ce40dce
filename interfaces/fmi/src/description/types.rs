//! Units and declared types.

use super::element::Element;
use super::model::{DeclaredType, Version};
use crate::error::Result;
use terraglue_subsystem::unit::Unit;

const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

/// Units whose base unit is given; the others are names without a meaning.
pub fn units(root: &Element) -> Result<Vec<(String, Unit)>> {
    root.child("UnitDefinitions").map_or(Ok(Vec::new()), |list| listed(&list))
}

/// Names of units whose base unit is not given.
pub fn plain_units(root: &Element) -> Result<Vec<String>> {
    let Some(list) = root.child("UnitDefinitions") else { return Ok(Vec::new()) };
    let plain = list.children().filter(|e| e.name() == "Unit" && e.child("BaseUnit").is_none());
    plain.map(|e| e.required("name").map(str::to_owned)).collect()
}

/// The same below the element that holds the list.
pub fn listed(list: &Element) -> Result<Vec<(String, Unit)>> {
    let mut all = Vec::new();
    for element in list.children().filter(|e| e.name() == "Unit") {
        let name = element.required("name")?;
        let Some(base) = element.child("BaseUnit") else { continue };
        let mut unit = Unit::ONE;
        for (exponent, symbol) in unit.exponents.iter_mut().zip(BASE) {
            *exponent = base.whole(symbol, "a small whole number")?.unwrap_or(0);
        }
        unit.factor = base.optional_number("factor")?.unwrap_or(1.0);
        unit.offset = base.optional_number("offset")?.unwrap_or(0.0);
        if !unit.factor.is_finite() || unit.factor == 0.0 || !unit.offset.is_finite() {
            return Err(base.error(format!("the unit `{name}` has no usable factor and offset")));
        }
        all.push((name.to_owned(), unit));
    }
    Ok(all)
}

/// Declared types of both versions.
pub fn types(root: &Element, version: Version) -> Result<Vec<DeclaredType>> {
    let Some(list) = root.child("TypeDefinitions") else { return Ok(Vec::new()) };
    list.children().map(|e| one(&e, version)).filter_map(Result::transpose).collect()
}

/// The element that is the type of a declaration or a variable: FMI 2.0 wraps it, FMI 3.0 is it.
pub fn inner<'a>(element: &Element<'a>, version: Version) -> Option<Element<'a>> {
    match version {
        Version::V2 => element.children().next(),
        Version::V3 => Some(*element),
    }
}

fn one(element: &Element, version: Version) -> Result<Option<DeclaredType>> {
    let name = element.required("name")?.to_owned();
    let Some(inner) = inner(element, version) else { return Ok(None) };
    let mut items = Vec::new();
    for item in inner.children().filter(|e| e.name() == "Item") {
        let value = item.whole("value", "a whole number")?;
        let value = value.ok_or_else(|| item.error("lacks the attribute `value`"))?;
        items.push((item.required("name")?.to_owned(), value));
    }
    Ok(Some(DeclaredType {
        name,
        unit: inner.attribute("unit").map(str::to_owned),
        items,
        min: inner.optional_number("min")?,
        max: inner.optional_number("max")?,
    }))
}
