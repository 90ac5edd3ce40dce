//! The variables of both versions.

use super::element::{Element, LineCounter, number};
use super::model::*;
use super::printable;
use crate::error::Result;
use std::collections::BTreeMap;
use terraglue_subsystem::ValueType;

/// Reads all variables into the description.
pub fn read(root: &Element, description: &mut ModelDescription) -> Result {
    let list = root.child("ModelVariables").ok_or_else(|| root.error("has no <ModelVariables>"))?;
    let mut names: BTreeMap<&str, ()> = BTreeMap::new();
    let mut references: BTreeMap<(u32, bool), String> = BTreeMap::new();
    let types: BTreeMap<String, DeclaredType> =
        description.types.iter().map(|t| (t.name.clone(), t.clone())).collect();
    let mut lines = LineCounter::of(&list);
    for element in list.children() {
        let line = lines.line(&element);
        let variable = match description.version {
            Version::V2 => two(&element, &types, line)?,
            Version::V3 => three(&element, &types, line)?,
        };
        let Some(variable) = variable else {
            description.problems.push(format!("line {line}: <{}> is no variable", printable(element.name())));
            continue;
        };
        let name = element.required("name")?;
        if name.is_empty() {
            return Err(element.error("has an empty name"));
        }
        if names.insert(name, ()).is_some() {
            return Err(element.error(format!("the name `{}` occurs twice", printable(name))));
        }
        let is_text = variable.value_type == ValueType::String;
        let twin = references.insert((variable.reference, is_text), variable.name.clone());
        if let (Some(other), Version::V3) = (twin, description.version) {
            let message = format!("valueReference {} belongs to `{other}` already", variable.reference);
            return Err(element.error(message));
        }
        let first = description.variables.len();
        description.variables.push(variable);
        for alias in element.children().filter(|e| e.name() == "Alias") {
            let name = alias.required("name")?;
            if names.insert(name, ()).is_some() {
                return Err(alias.error(format!("the name `{}` occurs twice", printable(name))));
            }
            let mut other = description.variables[first].clone();
            (other.name, other.alias) = (name.to_owned(), true);
            other.description = alias.text("description").to_owned();
            description.variables.push(other);
        }
    }
    sizes(root, description)
}

type Types = BTreeMap<String, DeclaredType>;

fn two(element: &Element, types: &Types, line: u32) -> Result<Option<Variable>> {
    if element.name() != "ScalarVariable" {
        return Ok(None);
    }
    let known = |e: &Element| value_type_2(e.name()).is_some();
    let inner = element.children().find(known);
    let inner =
        inner.ok_or_else(|| element.error("has no type (Real, Integer, Boolean, String, Enumeration)"))?;
    let Some(value_type) = value_type_2(inner.name()) else { return Ok(None) };
    variable(element, &inner, value_type, types, line).map(Some)
}

fn three(element: &Element, types: &Types, line: u32) -> Result<Option<Variable>> {
    let Some(value_type) = value_type_3(element.name()) else { return Ok(None) };
    let mut v = variable(element, element, value_type, types, line)?;
    for dimension in element.children().filter(|e| e.name() == "Dimension") {
        let kind = "a whole number of at least 1";
        let fixed: Option<u64> = dimension.whole("start", kind)?;
        v.dimensions.push(match (fixed, dimension.attribute("valueReference")) {
            (Some(n), None) if n > 0 => Dimension::Fixed(n),
            (None, Some(_)) => Dimension::Parameter(dimension.reference("valueReference")?),
            (Some(_), None) => return Err(dimension.wrong("start", "0", kind)),
            _ => return Err(dimension.error("has either `start` or `valueReference`")),
        });
    }
    Ok(Some(v))
}

fn value_type_2(name: &str) -> Option<ValueType> {
    Some(match name {
        "Real" => ValueType::F64,
        "Integer" => ValueType::I32,
        "Boolean" => ValueType::Bool,
        "String" => ValueType::String,
        "Enumeration" => ValueType::Enumeration,
        _ => return None,
    })
}

fn value_type_3(name: &str) -> Option<ValueType> {
    Some(match name {
        "Float64" => ValueType::F64,
        "Float32" => ValueType::F32,
        "Int8" => ValueType::I8,
        "UInt8" => ValueType::U8,
        "Int16" => ValueType::I16,
        "UInt16" => ValueType::U16,
        "Int32" => ValueType::I32,
        "UInt32" => ValueType::U32,
        "Int64" => ValueType::I64,
        "UInt64" => ValueType::U64,
        "Boolean" => ValueType::Bool,
        "String" => ValueType::String,
        "Binary" => ValueType::Binary,
        "Enumeration" => ValueType::Enumeration,
        "Clock" => ValueType::Clock,
        _ => return None,
    })
}

fn variable(
    element: &Element,
    inner: &Element,
    value_type: ValueType,
    types: &Types,
    line: u32,
) -> Result<Variable> {
    let declared = match inner.attribute("declaredType") {
        None => None,
        Some(name) => Some(types.get(name).ok_or_else(|| {
            element.error(format!("the declared type `{}` does not exist", printable(name)))
        })?),
    };
    let (causality, variability) = role(element, value_type)?;
    let bound =
        |name: &str, own: Option<f64>| -> Result<Option<f64>> { Ok(inner.optional_number(name)?.or(own)) };
    let unit = inner.attribute("unit").map(str::to_owned).or_else(|| declared?.unit.clone());
    let numeric =
        !matches!(value_type, ValueType::String | ValueType::Binary | ValueType::Clock | ValueType::Bool);
    let (min, max) = match numeric {
        true => (bound("min", declared.and_then(|d| d.min))?, bound("max", declared.and_then(|d| d.max))?),
        false => (None, None),
    };
    Ok(Variable {
        name: element.required("name")?.to_owned(),
        reference: element.reference("valueReference")?,
        value_type,
        causality,
        variability,
        initial: match element.attribute("initial") {
            None => None,
            Some("exact") => Some(Initial::Exact),
            Some("approx") => Some(Initial::Approx),
            Some("calculated") => Some(Initial::Calculated),
            Some(other) => return Err(element.wrong("initial", other, "exact, approx or calculated")),
        },
        start: start(inner, value_type)?,
        min: min.unwrap_or(f64::NEG_INFINITY),
        max: max.unwrap_or(f64::INFINITY),
        unit,
        items: declared.map(|d| d.items.clone()).unwrap_or_default(),
        dimensions: Vec::new(),
        sizes: Vec::new(),
        description: element.text("description").to_owned(),
        line,
        alias: false,
        ticks: if value_type == ValueType::Clock { ticks(inner, causality)? } else { None },
        told: if value_type == ValueType::Clock { told(inner, causality)? } else { None },
        fraction: value_type == ValueType::Clock && inner.flag("supportsFraction")?,
        triggered: value_type == ValueType::Clock
            && (causality == Causality::Output
                || causality == Causality::Input && inner.text("intervalVariability") == "triggered"),
        clocks: clocks(element)?,
        // one that is no number leads nowhere, as a wrong one does
        derivative_of: inner.attribute("derivative").map(|text| text.trim().parse().unwrap_or(u32::MAX)),
        resized: false,
        intermediate: element.flag("intermediateUpdate")?,
    })
}

/// The list of clocks of a variable.
fn clocks(element: &Element) -> Result<Vec<u32>> {
    let text = element.text("clocks");
    let one =
        |word: &str| word.parse().map_err(|_| element.wrong("clocks", text, "a list of value references"));
    text.split_whitespace().map(one).collect()
}

/// How an input clock ticks whose intervals are known while the FMU runs.
fn told(element: &Element, causality: Causality) -> Result<Option<Told>> {
    let decimal = |name: &str| element.optional_number(name);
    let counted = decimal("shiftCounter")?
        .zip(decimal("resolution")?)
        .map(|(counter, resolution)| counter / resolution);
    let shift = decimal("shiftDecimal")?.or(counted).unwrap_or(0.0);
    let shift = if shift.is_finite() { shift.max(0.0) } else { 0.0 };
    Ok(match (causality, element.text("intervalVariability")) {
        (Causality::Input, "countdown") => Some(Told::Countdown),
        (Causality::Input, "calculated" | "tunable" | "changing") => Some(Told::Each(shift)),
        _ => None,
    })
}

/// When a clock ticks; nothing where that is not known beforehand.
fn ticks(element: &Element, causality: Causality) -> Result<Option<Ticks>> {
    let periodic = matches!(element.text("intervalVariability"), "constant" | "fixed");
    if causality != Causality::Input || !periodic {
        return Ok(None);
    }
    let decimal = |name: &str| element.optional_number(name);
    let resolution = decimal("resolution")?;
    let time =
        |decimal: Option<f64>, counter: Option<f64>| decimal.or(counter.zip(resolution).map(|(c, r)| c / r));
    let interval = time(decimal("intervalDecimal")?, decimal("intervalCounter")?);
    let shift = time(decimal("shiftDecimal")?, decimal("shiftCounter")?).unwrap_or(0.0);
    match interval {
        Some(interval) if interval > 0.0 && interval.is_finite() && shift >= 0.0 && shift.is_finite() => {
            Ok(Some(Ticks { interval, shift }))
        }
        _ => {
            Err(element.error("a periodic clock needs an interval greater than 0 and a shift of at least 0"))
        }
    }
}

fn role(element: &Element, value_type: ValueType) -> Result<(Causality, Variability)> {
    let causality = match element.attribute("causality").unwrap_or("local") {
        "parameter" => Causality::Parameter,
        "calculatedParameter" => Causality::CalculatedParameter,
        "structuralParameter" => Causality::StructuralParameter,
        "input" => Causality::Input,
        "output" => Causality::Output,
        "local" => Causality::Local,
        "independent" => Causality::Independent,
        other => return Err(element.wrong("causality", other, "a causality of the standard")),
    };
    let float = matches!(value_type, ValueType::F64 | ValueType::F32);
    let parameter = matches!(
        causality,
        Causality::Parameter | Causality::CalculatedParameter | Causality::StructuralParameter
    );
    let variability = match element.attribute("variability") {
        Some("constant") => Variability::Constant,
        Some("fixed") => Variability::Fixed,
        Some("tunable") => Variability::Tunable,
        Some("discrete") => Variability::Discrete,
        Some("continuous") => Variability::Continuous,
        None if parameter => Variability::Fixed,
        None if float => Variability::Continuous,
        None => Variability::Discrete,
        Some(other) => return Err(element.wrong("variability", other, "a variability of the standard")),
    };
    Ok((causality, variability))
}

fn start(inner: &Element, value_type: ValueType) -> Result<Start> {
    if matches!(value_type, ValueType::String | ValueType::Binary) {
        let texts: Vec<&str> = match inner.attribute("start") {
            Some(text) => vec![text],
            None => inner.children().filter(|e| e.name() == "Start").map(|e| e.text("value")).collect(),
        };
        if texts.is_empty() {
            return Ok(Start::None);
        }
        if value_type == ValueType::String {
            return Ok(Start::Texts(texts.into_iter().map(str::to_owned).collect()));
        }
        let bytes = texts.iter().map(|t| hexadecimal(t)).collect::<Option<Vec<_>>>();
        return bytes.map(Start::Bytes).ok_or_else(|| inner.wrong("start", texts[0], "hexadecimal bytes"));
    }
    let Some(text) = inner.attribute("start") else { return Ok(Start::None) };
    let words = text.split_whitespace();
    let wrong = |kind: &str| inner.wrong("start", text, kind);
    match value_type {
        ValueType::F64 | ValueType::F32 => {
            words.map(number).collect::<Option<_>>().map(Start::Numbers).ok_or_else(|| wrong("numbers"))
        }
        ValueType::Bool => words
            .map(|w| match w {
                "true" | "1" => Some(1.0),
                "false" | "0" => Some(0.0),
                _ => None,
            })
            .collect::<Option<_>>()
            .map(Start::Numbers)
            .ok_or_else(|| wrong("true or false")),
        ValueType::Clock => Ok(Start::None),
        _ => words
            .map(|w| w.parse().ok())
            .collect::<Option<_>>()
            .map(Start::Integers)
            .ok_or_else(|| wrong("whole numbers")),
    }
}

/// Bytes written in hexadecimal digits.
pub fn hexadecimal(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = text.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
    if !digits.len().is_multiple_of(2) || !digits.is_ascii() {
        return None;
    }
    let text = std::str::from_utf8(&digits).ok()?;
    (0..digits.len()).step_by(2).map(|k| u8::from_str_radix(text.get(k..k + 2)?, 16).ok()).collect()
}

/// Sizes of all arrays, with the start values of the structural parameters.
fn sizes(root: &Element, description: &mut ModelDescription) -> Result {
    let parameters = description.structure();
    let own = |v: &Variable| match v.shape(&parameters) {
        Ok(sizes) => Ok(sizes),
        Err(message) => Err(root.reader.error(v.line, "Dimension", message)),
    };
    let all = description.variables.iter().map(own).collect::<Result<Vec<_>>>()?;
    description.variables.iter_mut().zip(all).for_each(|(v, sizes)| v.sizes = sizes);
    Ok(())
}
