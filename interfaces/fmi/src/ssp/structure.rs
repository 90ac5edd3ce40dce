//! Reads `SystemStructure.ssd`.

use super::context::Context;
use super::transformation::transformation;
use super::{
    Component, Connection, Connector, Dictionary, DictionaryReference, End, Files, Structure, System,
    SystemElement, parameters,
};
use crate::description::element::{Element, Reader};
use crate::description::{parse, types};
use crate::error::Result;

/// Deepest nesting of systems, those in files of their own counted.
const DEPTH: usize = 50;

/// Reads a description; `file` names it in errors.
pub fn read(files: &Files, bytes: &[u8], file: &'static str) -> Result<Structure> {
    read_at(files, bytes, file, 0)
}

fn read_at(files: &Files, bytes: &[u8], file: &'static str, depth: usize) -> Result<Structure> {
    let reader = Reader { path: files.path, file };
    let text = reader.text(bytes)?;
    let document = parse(&reader, text)?;
    let root = Element { reader: &reader, document: &document, node: document.root_element() };
    if root.name() != "SystemStructureDescription" {
        return Err(root.error("the root is not <SystemStructureDescription>: it is no system structure"));
    }
    let version = root.required("version")?;
    if !version.starts_with("1.") && !version.starts_with("2.") {
        return Err(root.error(format!("version = \"{version}\": SSP 1.0 and 2.0 are known")));
    }
    let top = root.child("System").ok_or_else(|| root.error("has no <System>"))?;
    let experiment = root.child("DefaultExperiment");
    let time = |name: &str| experiment.map_or(Ok(None), |e| e.optional_number(name));
    let units = root.child("Units").map_or(Ok(Vec::new()), |list| types::listed(&list))?;
    Ok(Structure {
        name: root.text("name").to_owned(),
        system: system(Context { files, units: &units, depth }, &top)?,
        start_s: time("startTime")?,
        stop_s: time("stopTime")?,
    })
}

fn system(context: Context, element: &Element) -> Result<System> {
    if context.depth > DEPTH {
        return Err(element.error(format!("systems are nested deeper than {DEPTH} levels")));
    }
    let name = element.text("name").to_owned();
    let mut elements: Vec<SystemElement> = Vec::new();
    for inner in element.child("Elements").iter().flat_map(Element::children) {
        let read = match inner.name() {
            "Component" => component(context, &inner)?,
            "System" => SystemElement::System(named(
                system(Context { depth: context.depth + 1, ..context }, &inner)?,
                &inner,
            )?),
            "SignalDictionaryReference" => SystemElement::Dictionary(DictionaryReference {
                name: inner.required("name")?.to_owned(),
                dictionary: inner.required("dictionary")?.to_owned(),
            }),
            other => return Err(inner.error(format!("<{other}> is not read here"))),
        };
        if elements.iter().any(|e| e.name() == read.name()) {
            return Err(
                inner.error(format!("the name `{}` occurs twice in the system `{name}`", read.name()))
            );
        }
        elements.push(read);
    }
    let connections = element.child("Connections").map_or(Ok(Vec::new()), |list| {
        list.children().filter(|e| e.name() == "Connection").map(|e| connection(&e)).collect()
    })?;
    Ok(System {
        name,
        connectors: connectors(context, element)?,
        bindings: parameters::bindings(context, element)?,
        elements,
        connections,
        dictionaries: dictionaries(context, element)?,
    })
}

/// Signal dictionaries of a system, inside or in files of their own (`.ssb`).
fn dictionaries(context: Context, element: &Element) -> Result<Vec<Dictionary>> {
    let mut all: Vec<Dictionary> = Vec::new();
    for one in element.child("SignalDictionaries").iter().flat_map(Element::children) {
        if one.name() != "SignalDictionary" {
            continue;
        }
        let mut found = Dictionary { name: one.required("name")?.to_owned(), entries: Vec::new() };
        if all.iter().any(|d| d.name == found.name) {
            return Err(one.error(format!("the dictionary `{}` occurs twice", found.name)));
        }
        match (one.attribute("source"), one.child("SignalDictionary")) {
            (Some(source), _) => parameters::in_file(context, &one, source, "a signal dictionary", |root| {
                entries(context, root, &mut found.entries)
            })?,
            (None, Some(inside)) => entries(context, &inside, &mut found.entries)?,
            (None, None) => return Err(one.error("has neither `source` nor a <SignalDictionary> inside")),
        }
        all.push(found);
    }
    Ok(all)
}

fn entries(context: Context, root: &Element, entries: &mut Vec<Connector>) -> Result {
    if root.name() != "SignalDictionary" {
        return Err(root.error("the root is not <SignalDictionary>"));
    }
    let units = root.child("Units").map_or(Ok(Vec::new()), |list| types::listed(&list))?;
    for entry in root.children().filter(|e| e.name() == "DictionaryEntry") {
        let name = entry.required("name")?.to_owned();
        if entries.iter().any(|e| e.name == name) {
            return Err(entry.error(format!("the signal `{name}` occurs twice")));
        }
        let unit = entry.children().find_map(|of_type| of_type.attribute("unit"));
        entries.push(Connector { name, unit: unit.and_then(|name| context.unit(name, &units)) });
    }
    Ok(())
}

/// Elements need a name, the outermost system does not.
fn named(system: System, element: &Element) -> Result<System> {
    element.required("name").map(|_| system)
}

fn component(context: Context, element: &Element) -> Result<SystemElement> {
    const FMU: &str = "application/x-fmu-sharedlibrary";
    const STRUCTURE: &str = "application/x-ssp-definition";
    let name = element.required("name")?.to_owned();
    let source = element.required("source")?;
    let kind = element.attribute("type").unwrap_or(FMU);
    if kind == STRUCTURE {
        let bytes = context.files.bytes(source)?;
        let inner = read_at(context.files, &bytes, "a nested .ssd", context.depth + 1)?;
        let mut bindings = inner.system.bindings;
        bindings.extend(parameters::bindings(context, element)?);
        return Ok(SystemElement::System(System { name, bindings, ..inner.system }));
    }
    if kind != FMU {
        return Err(element.error(format!("type = \"{kind}\": {FMU} and {STRUCTURE} are read here")));
    }
    if element.text("implementation") == "ModelExchange" {
        return Err(
            element.error(format!("`{name}` is wanted for model exchange; co-simulation is run here"))
        );
    }
    let path =
        super::relative(source).map_err(|why| element.error(format!("source = \"{source}\" {why}")))?;
    Ok(SystemElement::Component(Component {
        name,
        source: path.display().to_string(),
        connectors: connectors(context, element)?,
        bindings: parameters::bindings(context, element)?,
    }))
}

fn connectors(context: Context, element: &Element) -> Result<Vec<Connector>> {
    let Some(list) = element.child("Connectors") else { return Ok(Vec::new()) };
    let one = |e: Element| -> Result<Connector> {
        let unit = e.children().find_map(|of_type| of_type.attribute("unit"));
        let unit = unit.and_then(|name| context.unit(name, &[]));
        Ok(Connector { name: e.required("name")?.to_owned(), unit })
    };
    list.children().filter(|e| e.name() == "Connector").map(one).collect()
}

fn connection(element: &Element) -> Result<Connection> {
    let end = |of: &str, connector: &str| -> Result<End> {
        let element_name = element.attribute(of).map(str::to_owned);
        Ok(End { element: element_name, connector: element.required(connector)?.to_owned() })
    };
    Ok(Connection {
        start: end("startElement", "startConnector")?,
        end: end("endElement", "endConnector")?,
        transformation: transformation(element)?,
    })
}
