//! Discrete inputs and tunable parameters in event mode: a change of one is an event (FMI 3.0.2, 4.2.1, `fmi3EnterEventMode`; 2.4.7.4,
//! `tunable`). It begins with the first that changes, and ends when the next step begins.

use super::functions::Api;
use super::{FmuInstance, InstancePhase};
use crate::description::{Causality, ModelDescription, Variability};
use crate::error::Result;
use terraglue_subsystem::{ValueType, Values, ValuesMut};

/// Value references of those that belong to no clock, ascending.
pub(super) fn inputs(description: &ModelDescription) -> Vec<u32> {
    let discrete = description.variables.iter().filter(|v| {
        let sudden = matches!(
            (v.causality, v.variability),
            (Causality::Input, Variability::Discrete) | (Causality::Parameter, Variability::Tunable)
        );
        sudden && v.clocks.is_empty() && v.value_type != ValueType::Clock && !v.alias
    });
    let mut all: Vec<u32> = discrete.map(|v| v.reference).collect();
    all.sort_unstable();
    all
}

/// Before values are set: enters event mode where one changes a discrete input. Whether that is all, as those that keep
/// their values are not set between events, and the others are set here.
pub(super) fn before_set(instance: &FmuInstance, references: &[u32], values: Values) -> Result<bool> {
    let is_discrete = |reference: &u32| instance.discrete_inputs.binary_search(reference).is_ok();
    let stepping = instance.phase == InstancePhase::Stepping && !instance.clocks.told.changes.get();
    if !stepping || !references.iter().any(is_discrete) {
        return Ok(false);
    }
    macro_rules! unless_changed {
        ($values:expr, $kind:ident) => {{
            let mut now = vec![Default::default(); $values.len()];
            instance.foreign.get(references, ValuesMut::$kind(&mut now))?;
            // values of arrays lie one behind the other
            let scalars = now.len() == references.len();
            let counts = |k: usize| !scalars || is_discrete(&references[k]);
            if now.iter().zip($values).enumerate().any(|(k, (now, new))| now != new && counts(k)) {
                return begin_event(instance);
            }
            let others = (0..references.len()).filter(|k| scalars && !is_discrete(&references[*k]));
            for k in others {
                instance.foreign.set(&references[k..=k], Values::$kind(&$values[k..=k]))?;
            }
            Ok(scalars || references.iter().all(is_discrete))
        }};
    }
    match values {
        Values::F64(v) => unless_changed!(v, F64),
        Values::F32(v) => unless_changed!(v, F32),
        Values::I8(v) => unless_changed!(v, I8),
        Values::I16(v) => unless_changed!(v, I16),
        Values::I32(v) => unless_changed!(v, I32),
        Values::I64(v) => unless_changed!(v, I64),
        Values::U8(v) => unless_changed!(v, U8),
        Values::U16(v) => unless_changed!(v, U16),
        Values::U32(v) => unless_changed!(v, U32),
        Values::U64(v) => unless_changed!(v, U64),
        Values::Bool(v) => unless_changed!(v, Bool),
        Values::String(v) => unless_changed!(v, String),
        Values::Binary(v) => unless_changed!(v, Binary),
        Values::Enumeration(v) => unless_changed!(v, Enumeration),
    }
}

fn begin_event(instance: &FmuInstance) -> Result<bool> {
    let Api::Three(three) = instance.foreign.api else { return Ok(false) };
    instance.foreign.call("fmi3EnterEventMode", three.enter_event_mode, |f, c| unsafe { f(c) })?;
    instance.clocks.told.changes.set(true);
    Ok(false)
}
