//! FMI variables as variables of a scenario: array elements get names of their own, `foot.position[2,1]`.

use std::collections::BTreeMap;
use terraglue_fmi::description::{self as fmi, ModelDescription, Variability};
use terraglue_scenario::did_you_mean;
use terraglue_subsystem::{Effect, FeedThrough, ValueType, Variable};

/// Where the value of a variable of the scenario lies in the FMU.
#[derive(Clone, Copy, Debug)]
pub struct ValueLocation {
    /// Position in the description.
    pub variable: u32,
    /// Element, row by row.
    pub element: u32,
    /// Elements of the whole variable.
    pub count: u32,
    /// Number in calls.
    pub reference: u32,
    /// Whether it may be set after the initialisation.
    pub live: bool,
    /// Whether it gives arrays their sizes, and is set in configuration mode only.
    pub structural: bool,
    /// Whether it is a clock.
    pub clock: bool,
    /// Whether it is an input that waits for a tick of its clocks.
    pub clocked: bool,
}

/// All variables that a scenario can see, and where they lie; clocks that others make tick are among them in event mode,
/// as truth values.
pub fn variables(description: &ModelDescription, event_mode: bool) -> (Vec<Variable>, Vec<ValueLocation>) {
    let (mut all, mut places) = (Vec::new(), Vec::new());
    for (k, v) in description.variables.iter().enumerate() {
        let clock = v.value_type == ValueType::Clock;
        let seen = (!clock || event_mode && v.triggered) && v.causality != fmi::Causality::Independent;
        if !seen {
            continue;
        }
        for element in 0..v.len() {
            let effect = effect(v);
            let id = all.len() as u32;
            all.push(Variable {
                id,
                name: element_name(v, element),
                value_type: if clock { ValueType::Bool } else { v.value_type },
                causality: v.causality.role(),
                effect,
                unit: description.unit_of(v),
                help: v.description.clone(),
                min: v.min,
                max: v.max,
                dims: Vec::new(),
                enumeration: v.items.iter().map(|(name, _)| name.clone()).collect(),
            });
            let live = effect == Effect::Live;
            let structural = v.causality == fmi::Causality::StructuralParameter;
            let (variable, element, count) = (k as u32, element as u32, v.len() as u32);
            let reference = v.reference;
            let clocked = event_mode && v.causality == fmi::Causality::Input && !v.clocks.is_empty();
            places.push(ValueLocation {
                variable,
                element,
                count,
                reference,
                live,
                structural,
                clock,
                clocked,
            });
        }
    }
    (all, places)
}

/// Outputs that follow inputs at once, by the model structure.
pub fn feed_through(description: &ModelDescription, places: &[ValueLocation]) -> Vec<FeedThrough> {
    let mut ids: Vec<Option<[u32; 2]>> = vec![None; description.variables.len()];
    for (id, place) in places.iter().enumerate().filter(|(_, p)| p.element == 0) {
        ids[place.variable as usize] = Some([id as u32, id as u32 + place.count]);
    }
    let is_input = |k: usize| description.variables[k].causality == fmi::Causality::Input;
    if !(0..ids.len()).any(is_input) {
        return Vec::new();
    }
    // aliases share the number of their variable, in FMI 2 among those of a type
    let key = |v: &fmi::Variable| (v.value_type as u32, v.reference);
    let mut names: BTreeMap<_, Vec<[u32; 2]>> = BTreeMap::new();
    for (v, ids) in description.variables.iter().zip(&ids) {
        names.entry(key(v)).or_default().extend(ids);
    }
    let same = |k: usize| names.get(&key(&description.variables[k])).into_iter().flatten().copied();
    let mut all = Vec::new();
    for unknown in &description.outputs {
        let mut inputs = match &unknown.dependencies {
            None => vec![FeedThrough::ALL],
            Some(on) => on.iter().filter(|k| is_input(**k)).flat_map(|k| same(*k)).collect(),
        };
        inputs.sort_unstable();
        inputs.dedup();
        all.extend(same(unknown.variable).map(|outputs| FeedThrough { outputs, inputs: inputs.clone() }));
    }
    all
}

/// `name`, or `name[i,j]` from 1 for an element of an array.
pub fn element_name(v: &fmi::Variable, element: usize) -> String {
    terraglue_subsystem::element_name(&v.name, &v.sizes, element)
}

/// When a variable can be set.
pub(super) fn effect(v: &fmi::Variable) -> Effect {
    match (v.causality, v.variability) {
        (fmi::Causality::Input, _) | (fmi::Causality::Parameter, Variability::Tunable) => Effect::Live,
        (fmi::Causality::Parameter | fmi::Causality::StructuralParameter, _) => Effect::NeedsReset,
        _ if v.initial == Some(fmi::Initial::Exact) && v.variability != Variability::Constant => {
            Effect::NeedsReset
        }
        _ => Effect::ReadOnly,
    }
}

/// A variable by its name.
///
/// # Errors
/// The name, with the one that looks most like it.
pub(super) fn find<'a>(
    description: &'a ModelDescription,
    name: &str,
) -> terraglue_fmi::Result<&'a fmi::Variable> {
    let all = &description.variables;
    all.iter().find(|v| v.name == name).ok_or_else(|| {
        let hint = did_you_mean(name, all.iter().map(|v| v.name.as_str()));
        terraglue_fmi::Error::WrongInput(format!(
            "there is no variable `{name}`{}",
            hint.map(|h| format!("; {h}")).unwrap_or_default()
        ))
    })
}
