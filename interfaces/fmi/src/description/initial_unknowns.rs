//! Whether what the model structure lists besides outputs is there, and whether the list of initial unknowns is that of the standards
//! (FMI 2.0.4 §2.2.8, FMI 3.0.2 §2.4.8): outputs and calculated parameters that are not exact at the start, and continuous states and
//! their derivatives likewise.

use super::element::Element;
use super::model::{
    Causality, Defect, DefectKind, Initial, ModelDescription, Variability, Variable, Version,
};
use super::printable;
use super::structure::Lookup;
use std::collections::BTreeSet;
use terraglue_subsystem::ValueType;

/// Names that one message lists at most.
const NAMED: usize = 5;

/// One defect for the variables that the list lacks, and one for those that do not belong to it.
pub fn defects(root: &Element, description: &ModelDescription) -> Vec<Defect> {
    let Some(structure) = root.child("ModelStructure") else { return Vec::new() };
    let listed: BTreeSet<usize> = description.initial_unknowns.iter().map(|u| u.variable).collect();
    let lookup = Lookup::of(description);
    let wanted = wanted(&structure, description, &lookup);
    let listed_too = listed_besides(&structure, description.version);
    let lost = listed_too.filter_map(|e| lost(&e, &lookup).or_else(|| of_nothing(&e, description, &lookup)));
    let lacks = message(description, wanted.difference(&listed), "is not listed", "are not listed");
    let extra =
        message(description, listed.difference(&wanted), "does not belong there", "do not belong there");
    let defect = |message| {
        let line = Some(structure.line());
        Defect { kind: DefectKind::InitialUnknowns, line, message }
    };
    lost.chain(lacks.into_iter().chain(extra).map(defect)).collect()
}

/// Elements of the structure that a run does not read: derivatives, clocked states, event indicators.
fn listed_besides<'a>(structure: &Element<'a>, version: Version) -> impl Iterator<Item = Element<'a>> {
    let list = structure.child("Derivatives").filter(|_| version == Version::V2);
    let three = ["ContinuousStateDerivative", "ClockedState", "EventIndicator"];
    let own = structure.children().filter(move |e| version == Version::V3 && three.contains(&e.name()));
    list.into_iter().flat_map(|list| list.children()).chain(own)
}

/// The defect of an element that names no variable.
fn lost(element: &Element, lookup: &Lookup) -> Option<Defect> {
    let (key, name) = (lookup.key(), element.name());
    let number = element.text(key);
    let found = number.trim().parse().ok().and_then(|number| lookup.find(number));
    found.is_none().then(|| Defect {
        kind: DefectKind::Structure,
        line: Some(element.line()),
        message: format!("<{name}> of ModelStructure: no variable has the {key} `{}`", printable(number)),
    })
}

/// The defect of a derivative of a state that does not name its state.
fn of_nothing(element: &Element, d: &ModelDescription, lookup: &Lookup) -> Option<Defect> {
    if !is_derivative(element) {
        return None;
    }
    let v = &d.variables[lookup.find(element.attribute(lookup.key())?.trim().parse().ok()?)?];
    let message = format!(
        "`{}` is listed as the derivative of a state in ModelStructure and has no attribute `derivative`",
        printable(&v.name)
    );
    v.derivative_of.is_none().then_some(Defect { kind: DefectKind::Derivative, line: Some(v.line), message })
}

fn is_derivative(element: &Element) -> bool {
    matches!(element.name(), "Unknown" | "ContinuousStateDerivative")
}

/// Positions of the variables that are to be listed.
fn wanted(structure: &Element, d: &ModelDescription, lookup: &Lookup) -> BTreeSet<usize> {
    let own = |v: &Variable| match v.causality {
        Causality::Output => v.value_type != ValueType::Clock && v.clocks.is_empty() && !is_exact(v),
        Causality::CalculatedParameter => true,
        _ => false,
    };
    let variables = d.variables.iter().enumerate().filter(|(_, v)| !v.alias);
    let mut all: BTreeSet<usize> = variables.filter(|(_, v)| own(v)).map(|(k, _)| k).collect();
    let derivatives = derivatives(structure, d.version, lookup);
    let states = derivatives.iter().filter_map(|k| lookup.find(d.variables[*k].derivative_of?));
    let unknown: Vec<usize> =
        states.chain(derivatives.iter().copied()).filter(|k| !is_exact(&d.variables[*k])).collect();
    all.extend(unknown);
    all
}

/// Positions of the derivatives that the structure lists.
fn derivatives(structure: &Element, version: Version, lookup: &Lookup) -> Vec<usize> {
    let position = |e: Element| lookup.find(e.attribute(lookup.key())?.trim().parse().ok()?);
    listed_besides(structure, version).filter(is_derivative).filter_map(position).collect()
}

/// Whether the start value is exact, by the table of defaults where `initial` is not given.
fn is_exact(v: &Variable) -> bool {
    v.initial.map_or(v.variability == Variability::Constant, |initial| initial == Initial::Exact)
}

fn message<'a>(
    d: &ModelDescription,
    positions: impl Iterator<Item = &'a usize> + Clone,
    one: &str,
    many: &str,
) -> Option<String> {
    let name = |k: &usize| format!("`{}`", printable(&d.variables[*k].name));
    let count = positions.clone().count();
    let names: Vec<String> = positions.take(NAMED).map(name).collect();
    let more = if count > NAMED { format!(" and {} more", count - NAMED) } else { String::new() };
    let verb = if count == 1 { one } else { many };
    (count > 0).then(|| format!("the initial unknowns of ModelStructure: {}{more} {verb}", names.join(", ")))
}
