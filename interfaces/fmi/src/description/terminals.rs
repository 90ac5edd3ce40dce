//! Terminals of FMI 3: named groups of variables that plug into each other.

use super::element::{Element, Reader};
use super::model::{ModelDescription, Terminal};
use crate::error::Result;
use std::path::Path;

/// Reads `terminalsAndIcons.xml`.
pub fn read(path: &Path, bytes: &[u8], description: &ModelDescription) -> Result<Vec<Terminal>> {
    let reader = Reader { path, file: "terminalsAndIcons.xml" };
    let text = reader.text(bytes)?;
    let document = super::parse(&reader, text)?;
    let root = Element { reader: &reader, document: &document, node: document.root_element() };
    let mut all = Vec::new();
    for list in root.children().filter(|e| e.name() == "Terminals") {
        for terminal in list.children().filter(|e| e.name() == "Terminal") {
            collect("", &terminal, description, &mut all)?;
        }
    }
    Ok(all)
}

/// A terminal and those inside it, with dotted names.
fn collect(
    prefix: &str,
    element: &Element,
    description: &ModelDescription,
    all: &mut Vec<Terminal>,
) -> Result {
    let name = format!("{prefix}{}", element.required("name")?);
    let mut members = Vec::new();
    for member in element.children().filter(|e| e.name() == "TerminalMemberVariable") {
        let variable = member.required("variableName")?;
        let position = description.position(variable);
        let position = position.ok_or_else(|| member.error(format!("there is no variable `{variable}`")))?;
        let own = member.attribute("memberName").unwrap_or(variable);
        members.push((own.to_owned(), position));
    }
    all.push(Terminal {
        name: name.clone(),
        kind: element.text("terminalKind").to_owned(),
        rule: element.text("matchingRule").to_owned(),
        members,
    });
    let prefix = format!("{name}.");
    for inner in element.children().filter(|e| e.name() == "Terminal") {
        collect(&prefix, &inner, description, all)?;
    }
    Ok(())
}
