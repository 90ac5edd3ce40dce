//! Defects of states: marks that only continuous or clocked states may have, and nominal values of nothing.

use super::element::{Element, LineCounter, number};
use super::model::{Causality, Defect, DefectKind, ModelDescription, Variability, Variable, Version};
use super::{printable, types};
use std::collections::{BTreeMap, BTreeSet};
use terraglue_subsystem::ValueType;

/// All of them, in the order of the variables.
pub fn defects(root: &Element, d: &ModelDescription) -> Vec<Defect> {
    let Some(list) = root.child("ModelVariables") else { return Vec::new() };
    let own: BTreeMap<&str, &Variable> = d.variables.iter().map(|v| (v.name.as_str(), v)).collect();
    let (continuous, mut previous) = (continuous_states(d), BTreeSet::new());
    let mut lines = LineCounter::of(root);
    let mut all = Vec::new();
    for element in list.children() {
        let Some(v) = own.get(element.text("name")) else { continue };
        let Some(inner) = types::inner(&element, d.version) else { continue };
        let found = [
            reinit(&inner, v, &continuous).map(|message| (DefectKind::Role, message)),
            nominal(&inner).map(|message| (DefectKind::Attribute, message)),
            clocked_state(&inner, v, d, &mut previous).map(|message| (DefectKind::ClockReference, message)),
        ];
        for (kind, message) in found.into_iter().flatten() {
            let message = format!("`{}` {message}", printable(&v.name));
            all.push(Defect { kind, line: Some(lines.line(&element)), message });
        }
    }
    all
}

/// Numbers in calls of the variables that others are derivatives of.
fn continuous_states(d: &ModelDescription) -> BTreeSet<u32> {
    let state = |of: u32| match d.version {
        Version::V2 => d.variables.get((of as usize).checked_sub(1)?).map(|v| v.reference),
        Version::V3 => Some(of),
    };
    d.variables.iter().filter_map(|v| state(v.derivative_of?)).collect()
}

/// A state alone can start again at an event (FMI 2.0.4 §2.2.7, FMI 3.0.2 §2.4.7.4).
fn reinit(inner: &Element, v: &Variable, continuous: &BTreeSet<u32>) -> Option<String> {
    let marked = inner.attribute("reinit").is_some() && !continuous.contains(&v.reference);
    marked.then(|| "has `reinit`, and no variable is its derivative: it is no continuous state".to_owned())
}

/// Tolerances are made with the nominal value (FMI 2.0.4 §2.2.7, FMI 3.0.2 §2.4.5).
fn nominal(inner: &Element) -> Option<String> {
    let text = inner.attribute("nominal")?;
    let useless = number(text).is_none_or(|x| x == 0.0 || !x.is_finite());
    useless.then(|| format!("has nominal = \"{}\", with which no tolerance can be made", printable(text)))
}

/// What a clocked state is, and what the variable that holds its previous value is (FMI 3.0.2 §2.4.7.4).
fn clocked_state(
    inner: &Element,
    v: &Variable,
    d: &ModelDescription,
    previous: &mut BTreeSet<u32>,
) -> Option<String> {
    let text = inner.attribute("previous")?;
    let number = text.trim().parse::<u32>().ok();
    let of = d.variables.iter().find(|other| Some(other.reference) == number);
    if v.clocks.is_empty() {
        return Some("has `previous` and belongs to no clock".into());
    }
    if v.variability != Variability::Discrete || v.value_type == ValueType::Clock {
        return Some("has `previous` and is not discrete".into());
    }
    let Some(of) = of else {
        let text = printable(text);
        return Some(format!("has its previous value in the valueReference {text}, which does not exist"));
    };
    let name = printable(&of.name);
    if of.reference == v.reference {
        return Some("is its own previous value".into());
    }
    if of.value_type != v.value_type
        || of.variability != Variability::Discrete
        || of.causality == Causality::Input
    {
        return Some(format!(
            "has its previous value in `{name}`, which must be discrete, of the same type, and no input"
        ));
    }
    (!previous.insert(of.reference))
        .then(|| format!("has its previous value in `{name}`, as another variable has"))
}
