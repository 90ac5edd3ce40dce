//! The model description of an FMU: `modelDescription.xml` of FMI 2.0 and 3.0 as one plain structure.

mod aliases;
mod attributes;
mod defects;
mod details;
pub(crate) mod element;
mod initial_unknowns;
mod model;
mod resize;
mod states;
mod structure;
mod terminals;
pub(crate) mod types;
mod variables;

pub use model::*;
pub use variables::hexadecimal;

use crate::error::{Error, Result};
use element::{Element, Reader};
use roxmltree::{Document, ParsingOptions};
use std::path::Path;

/// Most elements of a description.
const NODES: u32 = 20_000_000;

/// Reads and checks a description.
///
/// # Errors
/// The first thing that makes the FMU unusable, with line and element. Harmless oddities are listed in
/// [`ModelDescription::problems`].
pub fn read(path: &Path, bytes: &[u8], terminals: Option<&[u8]>) -> Result<ModelDescription> {
    let reader = Reader { path, file: "modelDescription.xml" };
    let text = reader.text(bytes)?;
    let document = parse(&reader, text)?;
    let root = Element { reader: &reader, document: &document, node: document.root_element() };
    let mut description = read_root(&root)?;
    if let Some(bytes) = terminals {
        match terminals::read(path, bytes, &description) {
            Ok(found) => description.terminals = found,
            Err(e) => description.problems.push(e.to_string()),
        }
    }
    Ok(description)
}

pub(crate) fn parse<'a>(reader: &Reader, text: &'a str) -> Result<Document<'a>> {
    let options = ParsingOptions { allow_dtd: false, nodes_limit: NODES, ..ParsingOptions::default() };
    reader.depth(text)?;
    Document::parse_with_options(text, options).map_err(|e| reader.error(e.pos().row, "xml", e.to_string()))
}

fn read_root(root: &Element) -> Result<ModelDescription> {
    if root.name() != "fmiModelDescription" {
        return Err(root.error("the root is not <fmiModelDescription>: it is no FMU"));
    }
    let version = version(root)?;
    let token = match version {
        Version::V2 => root.required("guid")?,
        Version::V3 => root.required("instantiationToken")?,
    };
    let co_simulation = co_simulation(root)?;
    let (identifier, odd) = identifier(&co_simulation)?;
    let mut description = ModelDescription {
        version,
        model_name: root.required("modelName")?.to_owned(),
        token: token.to_owned(),
        description: root.text("description").to_owned(),
        author: root.text("author").to_owned(),
        generation_tool: root.text("generationTool").to_owned(),
        identifier,
        capabilities: capabilities(&co_simulation, version)?,
        problems: odd.into_iter().collect(),
        model_exchange: root.child("ModelExchange").is_some(),
        scheduled_execution: root.child("ScheduledExecution").is_some(),
        experiment: experiment(root)?,
        units: types::units(root)?,
        plain_units: types::plain_units(root)?,
        log_categories: log_categories(root)?,
        types: types::types(root, version)?,
        ..ModelDescription::default()
    };
    variables::read(root, &mut description)?;
    structure::read(root, &mut description)?;
    description.details = attributes::defects(root, version);
    description.details.extend(details::defects(root, version, &description.experiment));
    description.details.extend(states::defects(root, &description));
    description.details.extend(aliases::defects(&description));
    description.details.extend(initial_unknowns::defects(root, &description));
    Ok(description)
}

fn version(root: &Element) -> Result<Version> {
    match root.required("fmiVersion")? {
        "2.0" => Ok(Version::V2),
        v if v.starts_with("3.0") => Ok(Version::V3),
        "1.0" => Err(root.unsupported("it is an FMU of FMI 1.0; FMI 2.0 and 3.0 are run here")),
        other => Err(root.error(format!("fmiVersion = \"{}\": FMI 2.0 and 3.0 are known", printable(other)))),
    }
}

fn co_simulation<'a>(root: &Element<'a>) -> Result<Element<'a>> {
    if let Some(element) = root.child("CoSimulation") {
        return Ok(element);
    }
    let name = root.text("modelName");
    Err(root.unsupported(match (root.child("ScheduledExecution"), root.child("ModelExchange")) {
        (Some(_), _) => format!("`{name}` is made for scheduled execution; co-simulation is run here"),
        (None, Some(_)) => format!(
            "`{name}` is made for model exchange and brings no solver; export it again for co-simulation"
        ),
        (None, None) => return Err(root.error("has neither <CoSimulation> nor <ModelExchange>")),
    }))
}

/// The name of the library, and a complaint if it is odd. The standards want an identifier of C, as prefix of functions in
/// source code; a shared library has it in its file name only, so that a plain name breaks the standard and nothing else.
fn identifier(element: &Element) -> Result<(String, Option<String>)> {
    let text = element.required("modelIdentifier")?;
    let odd = format!("modelIdentifier = \"{}\" is no identifier of C", printable(text));
    match (is_identifier(text), is_plain_name(text)) {
        (true, _) => Ok((text.to_owned(), None)),
        (false, true) => Ok((text.to_owned(), Some(format!("line {}: {odd}", element.line())))),
        (false, false) => Err(element.error(odd + ", nor a name of letters, digits, `_`, `-` and `.`")),
    }
}

fn capabilities(element: &Element, version: Version) -> Result<Capabilities> {
    let flag = |name| element.flag(name);
    let own = |v2, v3| element.flag(if version == Version::V2 { v2 } else { v3 });
    Ok(Capabilities {
        state: own("canGetAndSetFMUstate", "canGetAndSetFMUState")?,
        serialize: own("canSerializeFMUstate", "canSerializeFMUState")?,
        directional_derivatives: own("providesDirectionalDerivative", "providesDirectionalDerivatives")?,
        adjoint_derivatives: flag("providesAdjointDerivatives")?,
        variable_step: flag("canHandleVariableCommunicationStepSize")?,
        fixed_step: element.optional_number("fixedInternalStepSize")?,
        once_per_process: flag("canBeInstantiatedOnlyOncePerProcess")?,
        needs_tool: flag("needsExecutionTool")?,
        event_mode: flag("hasEventMode")?,
        may_return_early: flag("mightReturnEarlyFromDoStep")?,
        intermediate_update: flag("providesIntermediateUpdate")?,
        return_early: flag("canReturnEarlyAfterIntermediateUpdate")?,
        interpolates_inputs: flag("canInterpolateInputs")?,
        output_derivatives: element
            .optional_number("maxOutputDerivativeOrder")?
            .is_some_and(|order| order >= 1.0),
    })
}

fn log_categories(root: &Element) -> Result<Vec<String>> {
    let Some(list) = root.child("LogCategories") else { return Ok(Vec::new()) };
    list.children()
        .filter(|e| e.name() == "Category")
        .map(|e| e.required("name").map(str::to_owned))
        .collect()
}

fn experiment(root: &Element) -> Result<Experiment> {
    let Some(element) = root.child("DefaultExperiment") else { return Ok(Experiment::default()) };
    Ok(Experiment {
        start: element.optional_number("startTime")?,
        stop: element.optional_number("stopTime")?,
        tolerance: element.optional_number("tolerance")?,
        step: element.optional_number("stepSize")?,
    })
}

fn is_identifier(text: &str) -> bool {
    let mut characters = text.chars();
    let first = characters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
    first && text.len() <= 200 && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Whether it can be part of the name of a file and of nothing else: no path, no option, no text for a shell.
fn is_plain_name(text: &str) -> bool {
    let first = text.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
    first && text.len() <= 200 && text.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c))
}

/// Foreign text for a message: short and without control characters.
pub(crate) fn printable(text: &str) -> String {
    text.chars().take(80).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

/// The error of a file without usable text.
pub(crate) fn wrong(path: &Path, file: &'static str, line: u32, element: &str, message: String) -> Error {
    Error::Description { path: path.into(), file, line, element: printable(element), message }
}
