//! Defects of aliases of FMI 2: variables that share a number in calls are one value (FMI 2.0.4 §2.2.7).

use super::model::{Causality, Defect, DefectKind, ModelDescription, Start, Variability, Variable, Version};
use super::printable;
use std::collections::BTreeMap;
use terraglue_subsystem::ValueType;

/// The first defect of each set of aliases, in the order of the variables.
pub fn defects(d: &ModelDescription) -> Vec<Defect> {
    if d.version != Version::V2 {
        return Vec::new();
    }
    let mut sets: BTreeMap<(u32, u32), Vec<&Variable>> = BTreeMap::new();
    for v in &d.variables {
        sets.entry((v.reference, base_type(v.value_type) as u32)).or_default().push(v);
    }
    let mut all: Vec<Defect> = sets.values().filter_map(|set| of_set(set)).collect();
    all.sort_by_key(|defect| defect.line);
    all
}

/// Enumerations are read and set as integers.
fn base_type(value_type: ValueType) -> ValueType {
    if value_type == ValueType::Enumeration { ValueType::I32 } else { value_type }
}

fn of_set(set: &[&Variable]) -> Option<Defect> {
    let first = set[0];
    let pair = set[1..].iter().find_map(|v| Some((*v, first, with_the_first(v, first)?)));
    let (v, other, message) =
        pair.or_else(|| two_of(set, settable, "both can be set")).or_else(|| starts(set))?;
    let message = format!(
        "`{}` and `{}` have the valueReference {}, so that they are one value, and {message}",
        printable(&other.name),
        printable(&v.name),
        v.reference
    );
    Some(Defect { kind: DefectKind::Alias, line: Some(v.line), message })
}

fn with_the_first(v: &Variable, first: &Variable) -> Option<&'static str> {
    let constant = [v, first].map(|v| v.variability == Variability::Constant);
    if constant[0] != constant[1] {
        return Some("one of them alone is constant");
    }
    (v.unit != first.unit).then_some("their units differ")
}

fn settable(v: &Variable) -> bool {
    matches!(v.causality, Causality::Input | Causality::Parameter | Causality::Independent)
}

/// Two start values; those of constants may be there twice, and are the same then.
fn starts<'a>(set: &[&'a Variable]) -> Option<(&'a Variable, &'a Variable, &'static str)> {
    let with: Vec<&Variable> = set.iter().copied().filter(|v| v.start != Start::None).collect();
    let other = with.iter().copied().find(|v| v.start != with[0].start);
    match other {
        Some(other) => Some((other, with[0], "their start values differ")),
        None if with.first().is_some_and(|v| v.variability == Variability::Constant) => None,
        None => two_of(&with, |_| true, "both have a start value, where one may"),
    }
}

fn two_of<'a>(
    set: &[&'a Variable],
    rule: fn(&Variable) -> bool,
    message: &'static str,
) -> Option<(&'a Variable, &'a Variable, &'static str)> {
    let mut found = set.iter().copied().filter(|v| rule(v));
    let first = found.next()?;
    Some((found.next()?, first, message))
}
