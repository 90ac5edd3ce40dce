//! Faults of attributes that a run does not need, and other tools may: display units, kinds of dependencies, the default experiment.

use super::element::Element;
use super::model::{Experiment, Version};
use super::printable;

/// Kinds of dependencies in both standards (FMI 2.0.4 §2.2.8, FMI 3.0.2 §2.4.8).
const KINDS: [&str; 5] = ["dependent", "constant", "fixed", "tunable", "discrete"];

/// One warning for each kind of fault: the first of them, and how many more there are.
pub fn problems(root: &Element, version: Version, experiment: &Experiment) -> Vec<String> {
    let all = [display_units(root, version), kinds(root, version), of_experiment(root, experiment)];
    let warning = |faults: &Vec<String>| match faults.as_slice() {
        [] => None,
        [one] => Some(one.clone()),
        [first, more @ ..] => Some(format!("{first}; {} more like it", more.len())),
    };
    all.iter().filter_map(warning).collect()
}

/// Display units that the unit does not define.
fn display_units(root: &Element, version: Version) -> Vec<String> {
    let units: Vec<Element> =
        root.child("UnitDefinitions").iter().flat_map(|l| l.children().collect::<Vec<_>>()).collect();
    let defines = |unit: &Element, name: &str| {
        unit.children().any(|e| e.name() == "DisplayUnit" && e.attribute("name") == Some(name))
    };
    let mut all = Vec::new();
    for list in ["TypeDefinitions", "ModelVariables"] {
        let elements = root.child(list).into_iter().flat_map(|l| l.children().collect::<Vec<_>>());
        for element in elements {
            // FMI 2.0 wraps the type, FMI 3.0 is the type
            let inner = if version == Version::V2 { element.children().next() } else { Some(element) };
            let Some(inner) = inner else { continue };
            let Some(shown) = inner.attribute("displayUnit") else { continue };
            let own = inner.attribute("unit");
            let known = |unit: &Element| {
                let name = unit.attribute("name");
                (own.is_none() || name == own) && (defines(unit, shown) || name == Some(shown))
            };
            if !units.iter().any(known) {
                let name = printable(element.attribute("name").unwrap_or("?"));
                all.push(format!(
                    "line {}: `{name}` has the display unit `{}`, which its unit does not define",
                    element.line(),
                    printable(shown)
                ));
            }
        }
    }
    all
}

/// Kinds of dependencies that are unknown, or not as many as dependencies.
fn kinds(root: &Element, version: Version) -> Vec<String> {
    let Some(structure) = root.child("ModelStructure") else { return Vec::new() };
    let unknowns: Vec<Element> = match version {
        Version::V2 => structure.children().flat_map(|list| list.children().collect::<Vec<_>>()).collect(),
        Version::V3 => structure.children().collect(),
    };
    let mut all = Vec::new();
    for unknown in unknowns {
        let Some(kinds) = unknown.attribute("dependenciesKind") else { continue };
        let at = format!("line {}: `dependenciesKind`", unknown.line());
        let count = unknown.attribute("dependencies").map(|d| d.split_whitespace().count());
        let given = kinds.split_whitespace().count();
        match (count, kinds.split_whitespace().find(|k| !KINDS.contains(k))) {
            (_, Some(wrong)) => {
                all.push(format!("{at} has `{}`, which is none of {}", printable(wrong), KINDS.join(", ")))
            }
            (None, None) => all.push(format!("{at} stands without `dependencies`")),
            (Some(count), None) if count != given => {
                all.push(format!("{at} has {given} kinds for {count} dependencies"))
            }
            _ => {}
        }
    }
    all
}

/// A default experiment that cannot be made.
fn of_experiment(root: &Element, experiment: &Experiment) -> Vec<String> {
    let Some(element) = root.child("DefaultExperiment") else { return Vec::new() };
    let mut all = Vec::new();
    let start = experiment.start.unwrap_or(0.0);
    if let Some(stop) = experiment.stop.filter(|stop| *stop <= start) {
        all.push(format!(
            "line {}: the default experiment ends at {stop} s and begins at {start} s",
            element.line()
        ));
    }
    for (name, value) in [("tolerance", experiment.tolerance), ("stepSize", experiment.step)] {
        if let Some(value) = value.filter(|value| !(*value > 0.0)) {
            all.push(format!(
                "line {}: the default experiment has {name} = {value}, which is not above 0",
                element.line()
            ));
        }
    }
    all
}
