//! Writes `modelDescription.xml` from the variables of a subsystem.

use super::xml::Xml;
use super::{Entry, Layout, values::FmiType};
use crate::description::Version;
use std::fmt::Display;
use terraglue_subsystem::unit::Unit;
use terraglue_subsystem::{Capabilities, Causality, Effect, Result, Subsystem, ValueType, Variable};

/// Where a model comes from; fields that are not given are left out of the description.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Author.
    pub author: Option<String>,
    /// Version of the model.
    pub version: Option<String>,
    /// Date and time in ISO 8601, UTC.
    pub date: Option<String>,
}

/// Attributes of the description other than the variables.
#[derive(Clone, Debug)]
pub struct About {
    /// Name for people.
    pub name: String,
    /// Name of the library and prefix of nothing else: a C identifier.
    pub identifier: String,
    /// One line.
    pub description: String,
    /// Token (FMI 3.0) or GUID (FMI 2.0).
    pub token: String,
    /// Program that made it, with its version.
    pub tool: String,
    /// Licence of the FMU.
    pub license: String,
    /// Who made it, and when.
    pub origin: Origin,
    /// Usual end of a run, s.
    pub stop_s: f64,
    /// Usual communication step, s.
    pub step_s: f64,
    /// Steps are whole multiples of this, s; none: any step.
    pub fixed_step_s: Option<f64>,
}

/// A C identifier from any name.
pub fn identifier(name: &str) -> String {
    let mut out: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if !out.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        out.insert(0, '_');
    }
    out
}

/// The description of an FMU that shows `subsystem`.
///
/// # Errors
/// A start value that cannot be read.
pub fn describe(subsystem: &dyn Subsystem, layout: &Layout, about: &About) -> Result<String> {
    let writer = Writer { subsystem, layout, about, variables: subsystem.variables() };
    writer.document()
}

struct Writer<'a> {
    subsystem: &'a dyn Subsystem,
    layout: &'a Layout,
    about: &'a About,
    variables: &'a [Variable],
}

impl Writer<'_> {
    fn two(&self) -> bool {
        self.layout.version == Version::V2
    }

    fn document(&self) -> Result<String> {
        let mut xml = Xml::new();
        let a = self.about;
        let (version, token) = if self.two() { ("2.0", "guid") } else { ("3.0", "instantiationToken") };
        let convention = if self.structured() { "structured" } else { "flat" };
        let mut attributes: Vec<(&str, &dyn Display)> = vec![
            ("fmiVersion", &version),
            ("modelName", &a.name),
            (token, &a.token),
            ("description", &a.description),
        ];
        let origin = [("author", &a.origin.author), ("version", &a.origin.version)];
        let given =
            origin.into_iter().filter_map(|(name, text)| Some((name, text.as_ref()? as &dyn Display)));
        attributes.extend(given);
        attributes.extend([("license", &a.license as &dyn Display), ("generationTool", &a.tool)]);
        attributes.extend(a.origin.date.iter().map(|date| ("generationDateAndTime", date as &dyn Display)));
        attributes.push(("variableNamingConvention", &convention));
        xml.open("fmiModelDescription", &attributes);
        self.co_simulation(&mut xml);
        self.units(&mut xml);
        self.types(&mut xml);
        xml.open("LogCategories", &[]);
        for (name, help) in [("logStatusError", "what was not done"), ("logStatusWarning", "what to look at")]
        {
            xml.leaf("Category", &[("name", &name), ("description", &help)]);
        }
        xml.leaf("Category", &[("name", &"logAll"), ("description", &"all of it")]);
        xml.close("LogCategories");
        xml.leaf(
            "DefaultExperiment",
            &[("startTime", &0), ("stopTime", &number(a.stop_s)), ("stepSize", &number(a.step_s))],
        );
        self.model_variables(&mut xml)?;
        self.structure(&mut xml);
        xml.close("fmiModelDescription");
        Ok(xml.finish())
    }

    fn co_simulation(&self, xml: &mut Xml) {
        let can = self.subsystem.capabilities();
        let state = can.has(Capabilities::STATE);
        let bytes = state && can.has(Capabilities::SERIALIZE);
        let names = if self.two() {
            ["canGetAndSetFMUstate", "canSerializeFMUstate"]
        } else {
            ["canGetAndSetFMUState", "canSerializeFMUState"]
        };
        let fixed = self.about.fixed_step_s.map(number);
        let mut attributes: Vec<(&str, &dyn Display)> = vec![
            ("modelIdentifier", &self.about.identifier),
            ("canHandleVariableCommunicationStepSize", &true),
            ("canBeInstantiatedOnlyOncePerProcess", &false),
            (names[0], &state),
            (names[1], &bytes),
        ];
        if self.two() {
            attributes.push(("canNotUseMemoryManagementFunctions", &true));
            attributes.push(("providesDirectionalDerivative", &false));
        } else {
            attributes.push(("providesDirectionalDerivatives", &false));
            if let Some(fixed) = &fixed {
                attributes.push(("fixedInternalStepSize", fixed));
            }
        }
        xml.leaf("CoSimulation", &attributes);
    }

    /// Units in use whose name we can read, in the order of their first use.
    fn units_in_use(&self) -> Vec<(&str, Unit)> {
        let mut all: Vec<(&str, Unit)> = Vec::new();
        for v in self.variables {
            if let Some(unit) = unit_of(v).filter(|_| all.iter().all(|(name, _)| *name != v.unit)) {
                all.push((&v.unit, unit));
            }
        }
        all
    }

    fn units(&self, xml: &mut Xml) {
        let all = self.units_in_use();
        if all.is_empty() {
            return;
        }
        xml.open("UnitDefinitions", &[]);
        for (name, unit) in all {
            xml.open("Unit", &[("name", &name)]);
            let symbols = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
            let (factor, offset) = (number(unit.factor), number(unit.offset));
            let mut base: Vec<(&str, &dyn Display)> = Vec::new();
            for (symbol, exponent) in symbols.iter().zip(&unit.exponents).filter(|(_, e)| **e != 0) {
                base.push((symbol, exponent));
            }
            if unit.factor != 1.0 {
                base.push(("factor", &factor));
            }
            if unit.offset != 0.0 {
                base.push(("offset", &offset));
            }
            xml.leaf("BaseUnit", &base);
            xml.close("Unit");
        }
        xml.close("UnitDefinitions");
    }

    /// Lists of names of enumerations, each with a name of its own.
    fn enumerations(&self) -> Vec<(String, &[String])> {
        let mut all: Vec<(String, &[String])> = Vec::new();
        for v in self.variables.iter().filter(|v| v.value_type == ValueType::Enumeration) {
            if all.iter().any(|(_, names)| *names == v.enumeration.as_slice()) {
                continue;
            }
            let last = v.name.rsplit('.').next().unwrap_or(&v.name);
            let mut name = format!("{}_choice", identifier(last));
            while all.iter().any(|(n, _)| *n == name) {
                name.push('_');
            }
            all.push((name, &v.enumeration));
        }
        all
    }

    fn types(&self, xml: &mut Xml) {
        let all = self.enumerations();
        if all.is_empty() {
            return;
        }
        xml.open("TypeDefinitions", &[]);
        for (name, items) in all {
            let outer = if self.two() { "SimpleType" } else { "EnumerationType" };
            xml.open(outer, &[("name", &name)]);
            if self.two() {
                xml.open("Enumeration", &[]);
            }
            for (value, item) in items.iter().enumerate() {
                xml.leaf("Item", &[("name", item), ("value", &value)]);
            }
            if self.two() {
                xml.close("Enumeration");
            }
            xml.close(outer);
        }
        xml.close("TypeDefinitions");
    }

    fn model_variables(&self, xml: &mut Xml) -> Result {
        xml.open("ModelVariables", &[]);
        if !self.two() {
            let taken = self.layout.entries.iter().any(|e| e.name == "time");
            xml.leaf(
                "Float64",
                &[
                    ("name", &if taken { "simulated_time" } else { "time" }),
                    ("valueReference", &0),
                    ("causality", &"independent"),
                    ("variability", &"continuous"),
                    ("description", &"simulated time, s"),
                ],
            );
        }
        for (k, entry) in self.layout.entries.iter().enumerate() {
            self.variable(xml, k + 1, entry)?;
        }
        xml.close("ModelVariables");
        Ok(())
    }

    fn variable(&self, xml: &mut Xml, reference: usize, entry: &Entry) -> Result {
        let v = &self.variables[entry.variable];
        let causality = causality(v);
        let variability = variability(v);
        let mut common: Vec<(&str, &dyn Display)> = vec![
            ("name", &entry.name),
            ("valueReference", &reference),
            ("causality", &causality),
            ("variability", &variability),
        ];
        if settable_at_start(v) {
            common.push(("initial", &"exact"));
        }
        if !v.help.is_empty() {
            common.push(("description", &v.help));
        }
        let start = self.start(entry, v)?;
        let kinds = self.enumerations();
        let kind = kinds.iter().find(|(_, names)| *names == v.enumeration.as_slice());
        let (min, max) = (number(v.min), number(v.max));
        let mut typed: Vec<(&str, &dyn Display)> = Vec::new();
        if let (ValueType::Enumeration, Some((name, _))) = (v.value_type, kind) {
            typed.push(("declaredType", name));
        }
        let float = matches!(v.value_type, ValueType::F64 | ValueType::F32);
        if float && unit_of(v).is_some() {
            typed.push(("unit", &v.unit));
        }
        let bounded = !matches!(
            v.value_type,
            ValueType::Bool | ValueType::String | ValueType::Binary | ValueType::Enumeration
        );
        if bounded && v.min.is_finite() {
            typed.push(("min", &min));
        }
        if bounded && v.max.is_finite() {
            typed.push(("max", &max));
        }
        if self.two() {
            typed.extend(start.iter().map(|s| ("start", s as &dyn Display)));
            xml.open("ScalarVariable", &common);
            xml.leaf(type_name_2(v.value_type), &typed);
            xml.close("ScalarVariable");
        } else {
            let texts = matches!(v.value_type, ValueType::String | ValueType::Binary);
            if let Some(start) = start.as_ref().filter(|_| !texts) {
                typed.push(("start", start));
            }
            common.extend(typed);
            let dims: &[u32] = if entry.element.is_none() { &v.dims } else { &[] };
            let text = start.as_deref().filter(|_| texts);
            element_3(xml, type_name_3(v.value_type), &common, dims, text);
        }
        Ok(())
    }

    /// Start values of variables that can be set, in the form of the standard.
    fn start(&self, entry: &Entry, v: &Variable) -> Result<Option<String>> {
        if !matches!(causality(v), "parameter" | "input") && !settable_at_start(v) {
            return Ok(None);
        }
        let s = self.subsystem;
        let texts = match v.value_type {
            ValueType::F64 => list::<f64>(s, v, |x| number(*x))?,
            ValueType::F32 => list::<f32>(s, v, |x| format!("{x:?}"))?,
            ValueType::I8 => list::<i8>(s, v, i8::to_string)?,
            ValueType::I16 => list::<i16>(s, v, i16::to_string)?,
            ValueType::I32 => list::<i32>(s, v, i32::to_string)?,
            ValueType::U8 => list::<u8>(s, v, u8::to_string)?,
            ValueType::U16 => list::<u16>(s, v, u16::to_string)?,
            ValueType::U32 => list::<u32>(s, v, u32::to_string)?,
            ValueType::U64 => list::<u64>(s, v, u64::to_string)?,
            ValueType::I64 | ValueType::Enumeration => list::<i64>(s, v, i64::to_string)?,
            ValueType::Bool => list::<bool>(s, v, bool::to_string)?,
            ValueType::String => list::<String>(s, v, String::clone)?,
            ValueType::Binary => list::<Vec<u8>>(s, v, |x| x.iter().map(|b| format!("{b:02x}")).collect())?,
            ValueType::Clock => return Ok(None),
        };
        Ok(Some(match entry.element {
            Some(element) => texts.get(element).cloned().unwrap_or_default(),
            None => texts.join(" "),
        }))
    }

    fn structure(&self, xml: &mut Xml) {
        let feeds = self.subsystem.capabilities().has(Capabilities::FEEDTHROUGH);
        let output = |e: &&Entry| self.variables[e.variable].causality == Causality::Output;
        let outputs: Vec<usize> =
            (self.layout.entries.iter().enumerate()).filter(|(_, e)| output(e)).map(|(k, _)| k + 1).collect();
        xml.open("ModelStructure", &[]);
        let none: (&str, &dyn Display) = ("dependencies", &"");
        let kinds: (&str, &dyn Display) = ("dependenciesKind", &"");
        if self.two() && !outputs.is_empty() {
            xml.open("Outputs", &[]);
        }
        for k in &outputs {
            let name = if self.two() { "Unknown" } else { "Output" };
            let mut attributes: Vec<(&str, &dyn Display)> =
                vec![(if self.two() { "index" } else { "valueReference" }, k)];
            if !feeds {
                attributes.extend([none, kinds]);
            }
            xml.leaf(name, &attributes);
        }
        if self.two() && !outputs.is_empty() {
            xml.close("Outputs");
        }
        let unknown = |k: &&usize| !settable_at_start(&self.variables[self.layout.entries[**k - 1].variable]);
        let unknowns: Vec<usize> = outputs.iter().filter(unknown).copied().collect();
        let list = self.two() && !unknowns.is_empty();
        if list {
            xml.open("InitialUnknowns", &[]);
        }
        for k in &unknowns {
            match self.two() {
                true => xml.leaf("Unknown", &[("index", k)]),
                false => xml.leaf("InitialUnknown", &[("valueReference", k)]),
            }
        }
        if list {
            xml.close("InitialUnknowns");
        }
        xml.close("ModelStructure");
    }

    /// Whether all names are of the form `a.b[1,2]`.
    fn structured(&self) -> bool {
        self.layout.entries.iter().all(|e| {
            let name = e.name.split_once('[').map_or(e.name.as_str(), |(head, _)| head);
            name.split('.').all(|part| !part.is_empty() && identifier(part) == part)
        })
    }
}

fn list<T: FmiType>(s: &dyn Subsystem, v: &Variable, show: impl Fn(&T) -> String) -> Result<Vec<String>> {
    let mut out = vec![T::default(); v.len()];
    T::read(s, v, &mut out)?;
    Ok(out.iter().map(show).collect())
}

fn number(x: f64) -> String {
    format!("{x:?}")
}

fn unit_of(v: &Variable) -> Option<Unit> {
    if v.unit.is_empty() { None } else { Unit::parse(&v.unit).ok() }
}

fn causality(v: &Variable) -> &'static str {
    match (v.causality, v.effect) {
        (Causality::Parameter, Effect::ReadOnly) | (Causality::Local, _) => "local",
        (Causality::Parameter, _) => "parameter",
        (Causality::Input, _) => "input",
        (Causality::Output, _) => "output",
    }
}

/// Whether an output is a start value, too: `initial` = exact, and known where the initialisation begins.
pub(super) fn settable_at_start(v: &Variable) -> bool {
    matches!(v.causality, Causality::Output | Causality::Local) && v.effect == Effect::NeedsReset
}

fn variability(v: &Variable) -> &'static str {
    let float = matches!(v.value_type, ValueType::F64 | ValueType::F32);
    match (causality(v), v.effect) {
        ("parameter", Effect::Live) => "tunable",
        ("parameter", _) => "fixed",
        _ if float => "continuous",
        _ => "discrete",
    }
}

fn type_name_2(value_type: ValueType) -> &'static str {
    match value_type {
        ValueType::F64 | ValueType::F32 => "Real",
        ValueType::Bool => "Boolean",
        ValueType::String => "String",
        ValueType::Enumeration => "Enumeration",
        _ => "Integer",
    }
}

fn type_name_3(value_type: ValueType) -> &'static str {
    match value_type {
        ValueType::F64 => "Float64",
        ValueType::F32 => "Float32",
        ValueType::I8 => "Int8",
        ValueType::I16 => "Int16",
        ValueType::I32 => "Int32",
        ValueType::I64 => "Int64",
        ValueType::U8 => "UInt8",
        ValueType::U16 => "UInt16",
        ValueType::U32 => "UInt32",
        ValueType::U64 => "UInt64",
        ValueType::Bool => "Boolean",
        ValueType::String => "String",
        ValueType::Binary | ValueType::Clock => "Binary",
        ValueType::Enumeration => "Enumeration",
    }
}

/// A variable of FMI 3.0 with the sizes of an array and the start value of a text below it.
fn element_3(xml: &mut Xml, name: &str, common: &[(&str, &dyn Display)], dims: &[u32], text: Option<&str>) {
    if dims.is_empty() && text.is_none() {
        return xml.leaf(name, common);
    }
    xml.open(name, common);
    dims.iter().for_each(|d| xml.leaf("Dimension", &[("start", d)]));
    text.iter().for_each(|t| xml.leaf("Start", &[("value", t)]));
    xml.close(name);
}
