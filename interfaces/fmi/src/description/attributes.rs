//! Attributes that the standards do not know (FMI 2.0.4 §2.2, FMI 3.0.2 §2.4): a misspelt one would be passed over in silence.

use super::element::{Element, LineCounter};
use super::model::{Defect, DefectKind, Version};
use super::printable;
use std::collections::{BTreeMap, BTreeSet};

/// Elements, and their attributes.
type Table = &'static [(&'static [&'static str], &'static [&'static str])];

/// Both versions.
const COMMON: Table = &[
    (&["Annotations", "LogCategories", "ModelStructure", "ModelVariables"], &[]),
    (&["TypeDefinitions", "UnitDefinitions"], &[]),
    (&["Category"], &["description", "name"]),
    (&["DefaultExperiment"], &["startTime", "stepSize", "stopTime", "tolerance"]),
    (&["Unit"], &["name"]),
    (&["BaseUnit"], &["A", "K", "cd", "factor", "kg", "m", "mol", "offset", "rad", "s"]),
    (&["Item"], &["description", "name", "value"]),
    (
        &["fmiModelDescription"],
        &["author", "copyright", "description", "fmiVersion", "generationDateAndTime"],
    ),
    (
        &["fmiModelDescription"],
        &["generationTool", "license", "modelName", "variableNamingConvention", "version"],
    ),
    (&INTERFACES, &["canBeInstantiatedOnlyOncePerProcess", "modelIdentifier", "needsExecutionTool"]),
    (&["CoSimulation"], &["canHandleVariableCommunicationStepSize", "maxOutputDerivativeOrder"]),
];

const INTERFACES: [&str; 3] = ["CoSimulation", "ModelExchange", "ScheduledExecution"];
const NUMBERS_2: [&str; 3] = ["Real", "Integer", "Enumeration"];

const TWO: Table = &[
    (&["Derivatives", "InitialUnknowns", "Outputs", "SourceFiles"], &[]),
    (&["fmiModelDescription"], &["guid", "numberOfEventIndicators"]),
    (&INTERFACES, &["canGetAndSetFMUstate", "canNotUseMemoryManagementFunctions", "canSerializeFMUstate"]),
    (&INTERFACES, &["providesDirectionalDerivative"]),
    (&["CoSimulation"], &["canInterpolateInputs", "canRunAsynchronuously"]),
    (&["ModelExchange"], &["completedIntegratorStepNotNeeded"]),
    (&["File"], &["name"]),
    (&["DisplayUnit"], &["factor", "name", "offset"]),
    (&["SimpleType"], &["description", "name"]),
    (&["ScalarVariable"], &["canHandleMultipleSetPerTimeInstant", "causality", "description", "initial"]),
    (&["ScalarVariable"], &["name", "valueReference", "variability"]),
    (&["Boolean", "Enumeration", "Integer", "Real", "String"], &["declaredType", "start"]),
    (&NUMBERS_2, &["max", "min", "quantity"]),
    (&["Real"], &["derivative", "displayUnit", "nominal", "reinit", "relativeQuantity", "unbounded", "unit"]),
    (&["Unknown"], &["dependencies", "dependenciesKind", "index"]),
];

const FLOATS: [&str; 4] = ["Float32", "Float64", "Float32Type", "Float64Type"];
const NUMBERS_3: [&str; 11] = [
    "Float32",
    "Float64",
    "Int8",
    "UInt8",
    "Int16",
    "UInt16",
    "Int32",
    "UInt32",
    "Int64",
    "UInt64",
    "Enumeration",
];
const NUMBER_TYPES_3: [&str; 11] = [
    "Float32Type",
    "Float64Type",
    "Int8Type",
    "UInt8Type",
    "Int16Type",
    "UInt16Type",
    "Int32Type",
    "UInt32Type",
    "Int64Type",
    "UInt64Type",
    "EnumerationType",
];
const OTHERS_3: [&str; 4] = ["Binary", "Boolean", "Clock", "String"];
const OTHER_TYPES_3: [&str; 4] = ["BinaryType", "BooleanType", "ClockType", "StringType"];
const VARIABLE_3: &[&str] = &[
    "canHandleMultipleSetPerTimeInstant",
    "causality",
    "clocks",
    "declaredType",
    "description",
    "name",
    "valueReference",
    "variability",
];
const CLOCK: &[&str] = &[
    "canBeDeactivated",
    "intervalCounter",
    "intervalDecimal",
    "intervalVariability",
    "priority",
    "resolution",
    "shiftCounter",
    "shiftDecimal",
    "supportsFraction",
];
const UNKNOWNS_3: [&str; 5] =
    ["ClockedState", "ContinuousStateDerivative", "EventIndicator", "InitialUnknown", "Output"];

const THREE: Table = &[
    (&["fmiModelDescription"], &["instantiationToken"]),
    (&INTERFACES, &["canGetAndSetFMUState", "canSerializeFMUState", "providesAdjointDerivatives"]),
    (&INTERFACES, &["providesDirectionalDerivatives", "providesPerElementDependencies"]),
    (&["CoSimulation"], &["canReturnEarlyAfterIntermediateUpdate", "fixedInternalStepSize", "hasEventMode"]),
    (&["CoSimulation"], &["mightReturnEarlyFromDoStep", "providesIntermediateUpdate"]),
    (&["CoSimulation"], &["recommendedIntermediateInputSmoothness"]),
    (&["CoSimulation", "ModelExchange"], &["providesEvaluateDiscreteStates"]),
    (&["ModelExchange"], &["needsCompletedIntegratorStep"]),
    (&["DisplayUnit"], &["factor", "inverse", "name", "offset"]),
    (&["Alias"], &["description", "displayUnit", "name"]),
    (&["Dimension"], &["start", "valueReference"]),
    (&["Start"], &["value"]),
    (&NUMBERS_3, VARIABLE_3),
    (&OTHERS_3, VARIABLE_3),
    (&NUMBERS_3, &["initial", "intermediateUpdate", "max", "min", "previous", "quantity", "start"]),
    (&NUMBER_TYPES_3, &["description", "max", "min", "name", "quantity"]),
    (&OTHER_TYPES_3, &["description", "name"]),
    (&FLOATS, &["displayUnit", "nominal", "relativeQuantity", "unbounded", "unit"]),
    (&["Float32", "Float64"], &["derivative", "reinit"]),
    (&["Binary", "Boolean", "String"], &["initial", "intermediateUpdate", "previous"]),
    (&["Boolean"], &["start"]),
    (&["Binary", "BinaryType"], &["maxSize", "mimeType"]),
    (&["Clock", "ClockType"], CLOCK),
    (&UNKNOWNS_3, &["dependencies", "dependenciesKind", "valueReference"]),
];

/// One defect for each unknown attribute. Elements that the standards do not know, and annotations, are not looked into.
pub fn defects(root: &Element, version: Version) -> Vec<Defect> {
    let known = known(version);
    let mut lines = LineCounter::of(root);
    let mut all = Vec::new();
    let mut below = vec![*root];
    while let Some(element) = below.pop() {
        let Some(attributes) = known.get(element.name()) else { continue };
        let unknown = element.node.attributes().filter(|a| a.namespace().is_none());
        let unknown = unknown.filter(|a| !attributes.contains(a.name()));
        all.extend(unknown.map(|a| {
            let (owner, name) = (element.name(), printable(a.name()));
            let message = format!("<{owner}> has the attribute `{name}`, which is not one of the standard");
            Defect { kind: DefectKind::Attribute, line: Some(lines.line(&element)), message }
        }));
        if element.name() != "Annotations" {
            let first = below.len();
            below.extend(element.children());
            below[first..].reverse();
        }
    }
    all
}

/// The attributes of each element that a version knows.
fn known(version: Version) -> BTreeMap<&'static str, BTreeSet<&'static str>> {
    let own = if version == Version::V2 { TWO } else { THREE };
    let mut all: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for (elements, attributes) in COMMON.iter().chain(own) {
        elements.iter().for_each(|element| all.entry(*element).or_default().extend(*attributes));
    }
    all
}
