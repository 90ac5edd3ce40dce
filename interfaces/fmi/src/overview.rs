//! The description of an FMU of any version, as it is written: also of FMI 1.0, model exchange and scheduled execution, which
//! are not run here.
//!
//! Texts are those of the description; nothing is completed or checked ([`crate::Fmu::inspect`] does that for FMUs that are run).

use crate::archive::{Archive, Limits};
use crate::binary::platforms;
use crate::error::{Error, Result};
use roxmltree::{Document, Node};
use std::collections::BTreeMap;
use std::path::Path;

/// Elements for the interface types of an FMU, and the words for them.
const INTERFACES: [(&str, &str); 5] = [
    ("CoSimulation", "co-simulation"),
    ("ModelExchange", "model exchange"),
    ("ScheduledExecution", "scheduled execution"),
    ("CoSimulation_StandAlone", "co-simulation"),
    ("CoSimulation_Tool", "co-simulation with a tool"),
];

/// A name with its text.
pub type Fact = (String, String);

/// An FMU at a glance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overview {
    /// Attributes of the root: `fmiVersion`, `modelName`, `guid`, `author`, ….
    pub facts: Vec<Fact>,
    /// Its interface types, each with its attributes.
    pub interfaces: Vec<(String, Vec<Fact>)>,
    /// Attributes of the default experiment.
    pub experiment: Vec<Fact>,
    /// Categories of its log with their descriptions.
    pub log_categories: Vec<Fact>,
    /// Its variables in the order of the file.
    pub variables: Vec<VariableFacts>,
    /// Names and kinds of its terminals.
    pub terminals: Vec<Fact>,
    /// Platforms that it has a library for.
    pub platforms: Vec<String>,
    /// Layered standards that it follows: name, version, description.
    pub standards: Vec<[String; 3]>,
}

/// A variable as the description has it; empty where an attribute is missing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VariableFacts {
    /// Its name.
    pub name: String,
    /// Its value reference.
    pub reference: String,
    /// Its type, with the sizes of an array.
    pub value_type: String,
    /// `input`, `output`, ….
    pub causality: String,
    /// `continuous`, `discrete`, ….
    pub variability: String,
    /// `exact`, `approx`, `calculated`.
    pub initial: String,
    /// Its unit, or its declared type in parentheses.
    pub unit: String,
    /// Its start value.
    pub start: String,
    /// One line for people.
    pub description: String,
}

impl Overview {
    /// Reads the description of an FMU; none of its code runs.
    ///
    /// # Errors
    /// The file is no archive with a description in XML.
    pub fn read(path: &Path) -> Result<Self> {
        let mut archive = Archive::open(path, Limits::default())?;
        let bytes = archive.text("modelDescription.xml")?.unwrap_or_default();
        let mut overview = Self::of(&bytes).map_err(|message| Error::Archive {
            path: path.to_owned(),
            entry: Some("modelDescription.xml".into()),
            message,
        })?;
        for place in ["terminalsAndIcons/terminalsAndIcons.xml", "icons/terminalsAndIcons.xml"] {
            if let Some(text) = archive.text(place)? {
                overview.terminals = terminals(&text);
                break;
            }
        }
        let names: Vec<String> = archive.names().map(str::to_owned).collect();
        overview.platforms = platforms(names.iter().map(String::as_str));
        let manifests =
            names.iter().filter(|n| n.starts_with("extra/") && n.ends_with("/fmi-ls-manifest.xml"));
        for manifest in manifests {
            let text = archive.text(manifest)?.unwrap_or_default();
            overview.standards.extend(standard(&text));
        }
        Ok(overview)
    }

    /// Of the bytes of a description.
    fn of(bytes: &[u8]) -> std::result::Result<Self, String> {
        let text = std::str::from_utf8(bytes).map_err(|e| format!("it is no text: {e}"))?;
        let document = Document::parse(text).map_err(|e| e.to_string())?;
        let root = document.root_element();
        if root.tag_name().name() != "fmiModelDescription" {
            return Err(format!("the root is <{}>, not <fmiModelDescription>", root.tag_name().name()));
        }
        let mut overview = Self { facts: facts(root), ..Self::default() };
        overview.interfaces = interfaces(root);
        let child = |name: &str| elements(root).find(|n| n.tag_name().name() == name);
        overview.experiment = child("DefaultExperiment").map(facts).unwrap_or_default();
        let categories = child("LogCategories").into_iter().flat_map(elements);
        let category = |n: Node| (attribute(n, "name"), attribute(n, "description"));
        overview.log_categories = categories.map(category).collect();
        let variables = || child("ModelVariables").into_iter().flat_map(elements);
        let sizes = variables().filter(|n| n.attribute("causality") == Some("structuralParameter"));
        let sizes =
            sizes.filter_map(|n| Some((n.attribute("valueReference")?, n.attribute("name")?))).collect();
        overview.variables = variables().map(|n| variable(n, &sizes)).collect();
        Ok(overview)
    }

    /// A fact of the root; empty where it is missing.
    pub fn fact(&self, name: &str) -> &str {
        self.facts.iter().find(|(own, _)| own == name).map_or("", |(_, text)| text)
    }
}

fn elements<'a, 'input>(of: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    of.children().filter(Node::is_element)
}

fn facts(of: Node) -> Vec<Fact> {
    let own = of.attributes().filter(|a| a.namespace().is_none());
    own.map(|a| (a.name().to_owned(), a.value().trim().to_owned())).collect()
}

fn attribute(of: Node, name: &str) -> String {
    of.attribute(name).unwrap_or_default().trim().to_owned()
}

/// Its interface types. An FMU of FMI 1.0 without `<Implementation>` is one for model exchange.
fn interfaces(root: Node) -> Vec<(String, Vec<Fact>)> {
    let implementation = elements(root).find(|n| n.tag_name().name() == "Implementation");
    let places = elements(root).chain(implementation.into_iter().flat_map(elements));
    let known = |n: Node| {
        let (_, words) = INTERFACES.iter().find(|(name, _)| n.tag_name().name() == *name)?;
        let capabilities = elements(n).find(|c| c.tag_name().name() == "Capabilities");
        let own = facts(n).into_iter().chain(capabilities.into_iter().flat_map(facts));
        Some(((*words).to_owned(), own.collect()))
    };
    let found: Vec<_> = places.filter_map(known).collect();
    match found.is_empty() && root.attribute("fmiVersion") == Some("1.0") {
        true => vec![("model exchange".into(), Vec::new())],
        false => found,
    }
}

/// A variable; `named` are the structural parameters by value reference.
fn variable(of: Node, named: &BTreeMap<&str, &str>) -> VariableFacts {
    // the type of FMI 1.0 and 2.0 is an element inside, that of FMI 3.0 the element itself
    let inside = elements(of).find(|n| TYPES.contains(&n.tag_name().name()));
    let typed = inside.unwrap_or(of);
    let sizes: Vec<String> = elements(of)
        .filter(|n| n.tag_name().name() == "Dimension")
        .map(|n| {
            let parameter =
                || n.attribute("valueReference").and_then(|reference| named.get(reference).copied());
            n.attribute("start").or_else(parameter).unwrap_or("?").to_owned()
        })
        .collect();
    let name = typed.tag_name().name();
    let value_type = if sizes.is_empty() { name.to_owned() } else { format!("{name}[{}]", sizes.join(",")) };
    let unit = match typed.attribute("unit") {
        Some(unit) => unit.trim().to_owned(),
        None => typed.attribute("declaredType").map(|t| format!("({t})")).unwrap_or_default(),
    };
    let start = elements(of).find(|n| n.tag_name().name() == "Start").and_then(|n| n.attribute("value"));
    VariableFacts {
        name: attribute(of, "name"),
        reference: attribute(of, "valueReference"),
        value_type,
        causality: attribute(of, "causality"),
        variability: attribute(of, "variability"),
        initial: attribute(of, "initial"),
        unit,
        start: typed.attribute("start").or(start).unwrap_or_default().trim().to_owned(),
        description: attribute(of, "description"),
    }
}

/// Elements of types in FMI 1.0 and 2.0.
const TYPES: [&str; 5] = ["Real", "Integer", "Boolean", "String", "Enumeration"];

fn terminals(bytes: &[u8]) -> Vec<Fact> {
    let Some(document) = std::str::from_utf8(bytes).ok().and_then(|text| Document::parse(text).ok()) else {
        return Vec::new();
    };
    let all = document.descendants().filter(|n| n.tag_name().name() == "Terminal");
    all.map(|n| (attribute(n, "name"), attribute(n, "terminalKind"))).collect()
}

/// Name, version and description of a layered standard.
fn standard(bytes: &[u8]) -> Option<[String; 3]> {
    let document = Document::parse(std::str::from_utf8(bytes).ok()?).ok()?;
    let root = document.root_element();
    // the attributes are in the namespace of the layered standards
    let of = |name: &str| {
        let found = root.attributes().find(|a| a.name() == name);
        found.map(|a| a.value().trim().to_owned()).unwrap_or_default()
    };
    Some([of("fmi-ls-name"), of("fmi-ls-version"), of("fmi-ls-description")])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descriptions_of_all_versions_are_read() -> std::result::Result<(), String> {
        let first = Overview::of(
            br#"<fmiModelDescription fmiVersion="1.0" modelName="old" guid="{1}"><ModelVariables>
            <ScalarVariable name="h" valueReference="0" causality="output"><Real start="1.5" unit="m"/></ScalarVariable>
            </ModelVariables><Implementation><CoSimulation_StandAlone><Capabilities canHandleEvents="true"/></CoSimulation_StandAlone>
            </Implementation></fmiModelDescription>"#,
        )?;
        assert_eq!((first.fact("fmiVersion"), first.interfaces[0].0.as_str()), ("1.0", "co-simulation"));
        assert_eq!(first.interfaces[0].1, [("canHandleEvents".to_owned(), "true".to_owned())]);
        let v = &first.variables[0];
        assert_eq!(
            (v.name.as_str(), v.value_type.as_str(), v.unit.as_str(), v.start.as_str()),
            ("h", "Real", "m", "1.5")
        );
        let bare = Overview::of(br#"<fmiModelDescription fmiVersion="1.0" modelName="bare"/>"#)?;
        assert_eq!(bare.interfaces[0].0, "model exchange");
        let third = Overview::of(
            br#"<fmiModelDescription fmiVersion="3.0" modelName="new"><ScheduledExecution modelIdentifier="new"/>
            <ModelVariables><Float64 name="x" valueReference="3" causality="parameter" start="1 2"><Dimension start="2"/></Float64>
            <String name="s" valueReference="4"><Start value="text"/></String></ModelVariables></fmiModelDescription>"#,
        )?;
        assert_eq!(
            third.interfaces,
            [("scheduled execution".to_owned(), vec![("modelIdentifier".to_owned(), "new".to_owned())])]
        );
        assert_eq!(
            (third.variables[0].value_type.as_str(), third.variables[1].start.as_str()),
            ("Float64[2]", "text")
        );
        assert!(
            Overview::of(b"<other/>").is_err()
                && Overview::of(b"\xff").is_err()
                && Overview::of(b"<a>").is_err()
        );
        Ok(())
    }

    #[test]
    fn layered_standards_are_named() {
        let manifest = br#"<fmiLayeredStandardManifest xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest"
            fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-bus" fmi-ls:fmi-ls-version="1.0.0" fmi-ls:fmi-ls-description="buses"/>"#;
        let found = standard(manifest);
        assert_eq!(found, Some(["org.fmi-standard.fmi-ls-bus", "1.0.0", "buses"].map(str::to_owned)));
    }
}
