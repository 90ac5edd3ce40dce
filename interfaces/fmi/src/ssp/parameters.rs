//! Reads parameter bindings with their sets (`.ssv`) and mappings (`.ssm`), inside the structure or in files of their own.

use super::context::Context;
use super::transformation::transformation;
use super::{Binding, MappingEntry, Parameter, Value};
use crate::description::element::{Element, Reader};
use crate::description::{parse, types};
use crate::error::Result;

/// All bindings of a system or a component; of two that name the same parameter the later one holds.
pub fn bindings(context: Context, element: &Element) -> Result<Vec<Binding>> {
    let Some(list) = element.child("ParameterBindings") else { return Ok(Vec::new()) };
    list.children().filter(|e| e.name() == "ParameterBinding").map(|e| binding(context, &e)).collect()
}

fn binding(context: Context, element: &Element) -> Result<Binding> {
    let mut found = Binding { prefix: element.text("prefix").to_owned(), ..Binding::default() };
    let inside = element.child("ParameterValues").and_then(|v| v.child("ParameterSet"));
    match (element.attribute("source"), inside) {
        (Some(source), _) => {
            in_file(context, element, source, "a parameter set", |root| set(context, root, &mut found))?
        }
        (None, Some(inside)) => set(context, &inside, &mut found)?,
        (None, None) => return Err(element.error("has neither `source` nor <ParameterValues>")),
    }
    if let Some(mapping) = element.child("ParameterMapping") {
        let mut entries = Vec::new();
        match (mapping.attribute("source"), mapping.child("ParameterMapping")) {
            (Some(source), _) => {
                in_file(context, &mapping, source, "a parameter mapping", |root| {
                    self::mapping(root, &mut entries)
                })?;
            }
            (None, Some(inside)) => self::mapping(&inside, &mut entries)?,
            (None, None) => return Err(mapping.error("has neither `source` nor a <ParameterMapping> inside")),
        }
        found.mapping = Some(entries);
    }
    Ok(found)
}

/// Reads a file that `element` names.
pub fn in_file(
    context: Context,
    element: &Element,
    source: &str,
    what: &'static str,
    read: impl FnOnce(&Element) -> Result,
) -> Result {
    if element.text("sourceBase") == "component" {
        return Err(
            element.error("sourceBase = \"component\" is not read here: put the file beside the structure")
        );
    }
    let bytes = context.files.bytes(source)?;
    let path = context.files.base.join(source);
    let reader = Reader { path: &path, file: what };
    let text = reader.text(&bytes)?;
    let document = parse(&reader, text)?;
    read(&Element { reader: &reader, document: &document, node: document.root_element() })
}

fn set(context: Context, root: &Element, found: &mut Binding) -> Result {
    if root.name() != "ParameterSet" {
        return Err(root.error("the root is not <ParameterSet>"));
    }
    let units = root.child("Units").map_or(Ok(Vec::new()), |list| types::listed(&list))?;
    for element in root.child("Parameters").iter().flat_map(Element::children) {
        let name = element.required("name")?.to_owned();
        let Some(of_type) = element.children().next() else { return Err(element.error("has no value")) };
        let unit = of_type.attribute("unit").and_then(|name| context.unit(name, &units));
        found.parameters.push(Parameter { name, value: value(&of_type)?, unit });
    }
    Ok(())
}

fn value(element: &Element) -> Result<Value> {
    let text = element.required("value")?;
    match element.name() {
        "Real" | "Float64" | "Float32" => match element.optional_number("value")?.filter(|x| x.is_finite()) {
            Some(number) => Ok(Value::Real(number)),
            None => Err(element.wrong("value", text, "a finite number")),
        },
        "Boolean" => element.flag("value").map(Value::Boolean),
        "String" | "Enumeration" => Ok(Value::Text(text.to_owned())),
        name if name == "Integer" || name.starts_with("Int") || name.starts_with("UInt") => element
            .whole("value", "a whole number")?
            .map(Value::Integer)
            .ok_or_else(|| element.error("has no value")),
        other => Err(element.error(format!("values of type {other} are not read here"))),
    }
}

fn mapping(root: &Element, entries: &mut Vec<MappingEntry>) -> Result {
    if root.name() != "ParameterMapping" {
        return Err(root.error("the root is not <ParameterMapping>"));
    }
    for element in root.children().filter(|e| e.name() == "MappingEntry") {
        entries.push(MappingEntry {
            source: element.required("source")?.to_owned(),
            target: element.required("target")?.to_owned(),
            transformation: transformation(&element)?,
        });
    }
    Ok(())
}
