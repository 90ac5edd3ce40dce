//! Defects of attributes that a run does not need, and other tools may: display units, kinds of dependencies, the default experiment.

use super::element::{Element, LineCounter};
use super::model::{Defect, DefectKind, Experiment, Version};
use super::{printable, types};
use std::collections::BTreeSet;

/// Kinds of dependencies in both standards (FMI 2.0.4 §2.2.8, FMI 3.0.2 §2.4.8).
const KINDS: [&str; 5] = ["dependent", "constant", "fixed", "tunable", "discrete"];

/// All of them.
pub fn defects(root: &Element, version: Version, experiment: &Experiment) -> Vec<Defect> {
    let mut all = display_units(root, version);
    all.extend(dependency_kinds(root, version));
    all.extend(of_experiment(root, experiment));
    all.extend(counts(root));
    all.extend(order(root, version));
    all.extend(twice(root));
    if version == Version::V2 {
        all.extend(parameters_2(root));
    }
    all
}

/// Elements of the description in their order (schemas of FMI 2.0.4 and 3.0.2).
const ORDER_2: &[&str] = &[
    "CoSimulation",
    "UnitDefinitions",
    "TypeDefinitions",
    "LogCategories",
    "DefaultExperiment",
    "VendorAnnotations",
    "ModelVariables",
    "ModelStructure",
];
const ORDER_3: &[&str] = &[
    "ModelExchange",
    "CoSimulation",
    "ScheduledExecution",
    "UnitDefinitions",
    "TypeDefinitions",
    "LogCategories",
    "DefaultExperiment",
    "ModelVariables",
    "ModelStructure",
    "Annotations",
];

/// The first element that the standard does not know, or that stands behind one which it comes before.
fn order(root: &Element, version: Version) -> Option<Defect> {
    let order = if version == Version::V2 { ORDER_2 } else { ORDER_3 };
    let place = |e: &Element| {
        // of FMI 2, both interfaces come first, in any order
        let name =
            if version == Version::V2 && e.name() == "ModelExchange" { "CoSimulation" } else { e.name() };
        order.iter().position(|known| *known == name)
    };
    let mut last: Option<(usize, &str)> = None;
    for element in root.children() {
        let (name, at) = (element.name(), place(&element));
        let message = match (at, last) {
            (None, _) => format!("<{}> is no element of the standard", printable(name)),
            (Some(at), Some((before, other))) if at < before => {
                format!("<{name}> stands behind <{other}>, and comes before it in the standard")
            }
            (Some(at), _) => {
                last = Some((at, name));
                continue;
            }
        };
        return Some(Defect { kind: DefectKind::Attribute, line: Some(element.line()), message });
    }
    None
}

/// What may be there once and is there again: the first of them counts.
fn twice(root: &Element) -> Vec<Defect> {
    let again = |kind: DefectKind, element: &Element, message: String| Defect {
        kind,
        line: Some(element.line()),
        message,
    };
    let (mut all, mut seen) = (Vec::new(), BTreeSet::new());
    for element in root.children() {
        if !seen.insert(element.name()) {
            let message = format!("<{}> is there for the second time", printable(element.name()));
            all.push(again(DefectKind::Attribute, &element, message));
        }
    }
    let (units, mut names) = (root.child("UnitDefinitions"), BTreeSet::new());
    for unit in units.into_iter().flat_map(|list| list.children().collect::<Vec<_>>()) {
        let name = unit.text("name");
        if !names.insert(name) {
            let message = format!("the unit `{}` is defined for the second time", printable(name));
            all.push(again(DefectKind::Unit, &unit, message));
        }
        if unit.children().filter(|e| e.name() == "BaseUnit").count() > 1 {
            let message = format!("the unit `{}` has a second <BaseUnit>", printable(name));
            all.push(again(DefectKind::Unit, &unit, message));
        }
    }
    all
}

/// Counts and lengths that are negative, or no numbers.
fn counts(root: &Element) -> Vec<Defect> {
    let below = |name: &str| root.child(name);
    let places = [
        (Some(*root), "numberOfEventIndicators"),
        (below("CoSimulation"), "maxOutputDerivativeOrder"),
        (below("CoSimulation"), "fixedInternalStepSize"),
    ];
    let defect = |(element, name): (Option<Element>, &str)| {
        let element = element?;
        let text = element.attribute(name)?;
        let wrong = text.trim().parse().map_or(true, |x: f64| !(x >= 0.0 && x.is_finite()));
        let message = format!("{name} = \"{}\" is no number of at least 0", printable(text));
        wrong.then(|| Defect { kind: DefectKind::Attribute, line: Some(element.line()), message })
    };
    places.into_iter().filter_map(defect).collect()
}

/// Parameters of FMI 2 without a variability: the default is continuous, which no parameter can be (FMI 2.0.4 §2.2.7).
fn parameters_2(root: &Element) -> Vec<Defect> {
    let Some(list) = root.child("ModelVariables") else { return Vec::new() };
    let mut lines = LineCounter::of(root);
    let parameter = |e: &Element| matches!(e.text("causality"), "parameter" | "calculatedParameter");
    let silent = list.children().filter(|e| parameter(e) && e.attribute("variability").is_none());
    let defect = |e: Element| Defect {
        kind: DefectKind::Role,
        line: Some(lines.line(&e)),
        message: format!(
            "`{}` is a parameter without variability, which is continuous then; it is taken as fixed",
            printable(e.text("name"))
        ),
    };
    silent.map(defect).collect()
}

/// Display units that the unit does not define.
fn display_units(root: &Element, version: Version) -> Vec<Defect> {
    let known = units(root);
    let of_unit = |unit: &str, shown: &str| unit == shown || known.contains(&(unit, shown));
    let mut lines = LineCounter::of(root);
    let mut all = Vec::new();
    for list in root.children().filter(|e| ["TypeDefinitions", "ModelVariables"].contains(&e.name())) {
        for element in list.children() {
            let Some(inner) = types::inner(&element, version) else { continue };
            let Some(shown) = inner.attribute("displayUnit") else { continue };
            let is_known = match inner.attribute("unit") {
                Some(unit) => of_unit(unit, shown),
                // the unit is that of the declared type
                None => known.iter().any(|(unit, name)| *name == shown || *unit == shown),
            };
            if !is_known {
                let name = printable(element.attribute("name").unwrap_or("?"));
                let shown = printable(shown);
                let message =
                    format!("`{name}` has the display unit `{shown}`, which its unit does not define");
                all.push(Defect { kind: DefectKind::DisplayUnit, line: Some(lines.line(&element)), message });
            }
        }
    }
    all
}

/// Units with each of their display units; a unit without any stands with itself.
fn units<'a>(root: &Element<'a>) -> BTreeSet<(&'a str, &'a str)> {
    let mut all = BTreeSet::new();
    let Some(list) = root.child("UnitDefinitions") else { return all };
    for unit in list.children() {
        let Some(name) = unit.attribute("name") else { continue };
        all.insert((name, name));
        let shown = unit.children().filter(|e| e.name() == "DisplayUnit");
        all.extend(shown.filter_map(|e| Some((name, e.attribute("name")?))));
    }
    all
}

/// Kinds of dependencies that are unknown, or not as many as dependencies.
fn dependency_kinds(root: &Element, version: Version) -> Vec<Defect> {
    let Some(structure) = root.child("ModelStructure") else { return Vec::new() };
    let unknowns: Vec<Element> = match version {
        Version::V2 => structure.children().flat_map(|list| list.children().collect::<Vec<_>>()).collect(),
        Version::V3 => structure.children().collect(),
    };
    let mut lines = LineCounter::of(root);
    let defect = |unknown: &Element| {
        let message = wrong_kinds(unknown.attribute("dependencies"), unknown.attribute("dependenciesKind")?)?;
        let message = format!("`dependenciesKind` {message}");
        Some(Defect { kind: DefectKind::DependencyKind, line: Some(lines.line(unknown)), message })
    };
    unknowns.iter().filter_map(defect).collect()
}

/// Why kinds do not belong to dependencies.
fn wrong_kinds(dependencies: Option<&str>, kinds: &str) -> Option<String> {
    if let Some(wrong) = kinds.split_whitespace().find(|k| !KINDS.contains(k)) {
        return Some(format!("has `{}`, which is none of {}", printable(wrong), KINDS.join(", ")));
    }
    let Some(dependencies) = dependencies else { return Some("stands without `dependencies`".into()) };
    let [given, count] = [kinds, dependencies].map(|text| text.split_whitespace().count());
    (given != count).then(|| format!("has {given} kinds for {count} dependencies"))
}

/// A default experiment that cannot be made.
fn of_experiment(root: &Element, experiment: &Experiment) -> Vec<Defect> {
    let Some(element) = root.child("DefaultExperiment") else { return Vec::new() };
    let start = experiment.start.unwrap_or(0.0);
    let ends = experiment.stop.filter(|stop| *stop <= start);
    let ends = ends.map(|stop| format!("ends at {stop} s and begins at {start} s"));
    let not_above = [("tolerance", experiment.tolerance), ("stepSize", experiment.step)];
    let not_above = not_above.iter().filter_map(|(name, value)| {
        let value = value.filter(|value| !(*value > 0.0))?;
        Some(format!("has {name} = {value}, which is not above 0"))
    });
    let defect = |message: String| Defect {
        kind: DefectKind::Experiment,
        line: Some(element.line()),
        message: format!("the default experiment {message}"),
    };
    ends.into_iter().chain(not_above).map(defect).collect()
}
