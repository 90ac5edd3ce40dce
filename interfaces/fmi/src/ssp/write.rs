//! Writes the description of a system structure (SSP 1.0): one system of FMUs, their connections and values.

use super::Value;
use crate::export::Xml;
use std::fmt::Display;

/// A component with the connectors that are used.
#[derive(Clone, Debug, Default)]
pub struct NewComponent {
    /// Name in the system.
    pub name: String,
    /// File in the archive.
    pub source: String,
    /// Name, `input` or `output`, and type (`Real`, `Integer`, `Boolean`, `String`, `Binary`) of each connector; no type: that of the variable
    /// of the FMU.
    pub connectors: Vec<(String, &'static str, Option<&'static str>)>,
    /// Values of variables at the start.
    pub values: Vec<(String, Value)>,
}

/// A connection of two connectors.
#[derive(Clone, Debug)]
pub struct NewConnection {
    /// Component and connector of its source.
    pub from: [String; 2],
    /// The same of its target.
    pub to: [String; 2],
    /// to = factor · from + offset, after the conversion of units.
    pub affine: (f64, f64),
    /// Whether units are converted.
    pub converts: bool,
}

const NAMESPACES: [(&str, &str); 3] = [
    ("xmlns:ssd", "http://ssp-standard.org/SSP1/SystemStructureDescription"),
    ("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon"),
    ("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues"),
];

/// `SystemStructure.ssd` of a system that runs from 0 to `stop_s`, s.
pub fn describe(
    (name, tool): (&str, &str),
    stop_s: f64,
    components: &[NewComponent],
    connections: &[NewConnection],
) -> String {
    let mut xml = Xml::new();
    let mut attributes: Vec<(&str, &dyn Display)> = Vec::new();
    attributes.extend(NAMESPACES.iter().map(|(key, space)| (*key, space as &dyn Display)));
    attributes.extend([("version", &"1.0" as &dyn Display), ("name", &name), ("generationTool", &tool)]);
    xml.open("ssd:SystemStructureDescription", &attributes);
    xml.open("ssd:System", &[("name", &name)]);
    xml.open("ssd:Elements", &[]);
    components.iter().for_each(|c| component(&mut xml, c));
    xml.close("ssd:Elements");
    if !connections.is_empty() {
        xml.open("ssd:Connections", &[]);
        connections.iter().for_each(|c| connection(&mut xml, c));
        xml.close("ssd:Connections");
    }
    xml.close("ssd:System");
    xml.leaf("ssd:DefaultExperiment", &[("startTime", &"0"), ("stopTime", &stop_s)]);
    xml.close("ssd:SystemStructureDescription");
    xml.finish()
}

fn component(xml: &mut Xml, c: &NewComponent) {
    let kind = "application/x-fmu-sharedlibrary";
    xml.open("ssd:Component", &[("name", &c.name), ("type", &kind), ("source", &c.source)]);
    if !c.connectors.is_empty() {
        xml.open("ssd:Connectors", &[]);
        for (name, kind, value_type) in &c.connectors {
            xml.open("ssd:Connector", &[("name", name), ("kind", kind)]);
            if let Some(value_type) = value_type {
                xml.leaf(&format!("ssc:{value_type}"), &[]);
            }
            xml.close("ssd:Connector");
        }
        xml.close("ssd:Connectors");
    }
    if !c.values.is_empty() {
        const AROUND: [&str; 3] = ["ssd:ParameterBindings", "ssd:ParameterBinding", "ssd:ParameterValues"];
        AROUND.iter().for_each(|name| xml.open(name, &[]));
        xml.open("ssv:ParameterSet", &[("version", &"1.0"), ("name", &"start")]);
        xml.open("ssv:Parameters", &[]);
        for (name, value) in &c.values {
            xml.open("ssv:Parameter", &[("name", name)]);
            let (kind, text) = match value {
                Value::Real(x) => ("ssv:Real", format!("{x:?}")),
                Value::Integer(n) => ("ssv:Integer", n.to_string()),
                Value::Boolean(b) => ("ssv:Boolean", b.to_string()),
                Value::Text(text) => ("ssv:String", text.clone()),
            };
            xml.leaf(kind, &[("value", &text)]);
            xml.close("ssv:Parameter");
        }
        xml.close("ssv:Parameters");
        xml.close("ssv:ParameterSet");
        AROUND.iter().rev().for_each(|name| xml.close(name));
    }
    xml.close("ssd:Component");
}

fn connection(xml: &mut Xml, c: &NewConnection) {
    let mut attributes: Vec<(&str, &dyn Display)> = vec![
        ("startElement", &c.from[0]),
        ("startConnector", &c.from[1]),
        ("endElement", &c.to[0]),
        ("endConnector", &c.to[1]),
    ];
    if !c.converts {
        attributes.push(("suppressUnitConversion", &"true"));
    }
    if c.affine == (1.0, 0.0) {
        return xml.leaf("ssd:Connection", &attributes);
    }
    xml.open("ssd:Connection", &attributes);
    let (factor, offset) = (format!("{:?}", c.affine.0), format!("{:?}", c.affine.1));
    xml.leaf("ssc:LinearTransformation", &[("factor", &factor), ("offset", &offset)]);
    xml.close("ssd:Connection");
}
