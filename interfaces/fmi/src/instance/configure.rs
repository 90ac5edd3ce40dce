//! Structural parameters: set in configuration mode, before the initialisation; they give arrays their sizes (FMI 3.0, 2.3.5).

use super::functions::Api;
use super::{FmuInstance, InstancePhase};
use crate::description::{Causality, Dimension, ModelDescription, Variable};
use crate::error::{Error, Result};
use std::sync::Arc;
use terraglue_subsystem::ValueType;

impl FmuInstance {
    /// Sets structural parameters, by name; [`FmuInstance::description`] has the new sizes of arrays afterwards.
    ///
    /// # Errors
    /// A name that is no structural parameter, a value out of range, an array that would be too large – before anything is
    /// called –, and errors of the FMU, each with the name of the parameter.
    pub fn configure(&mut self, values: &[(&str, i128)]) -> Result {
        if values.is_empty() {
            return Ok(());
        }
        if self.phase != InstancePhase::Instantiated {
            let text = "structural parameters can only be set before the initialisation";
            return Err(Error::Refused(text.into()));
        }
        let found =
            values.iter().map(|(name, value)| Ok((structural(&self.description, name, *value)?, *value)));
        let found = found.collect::<Result<Vec<(Variable, i128)>>>()?;
        let sizes = |(v, value): &(Variable, i128)| Some((v.reference, u64::try_from(*value).ok()?));
        let sizes: Vec<(u32, u64)> = found.iter().filter_map(sizes).collect();
        let names: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        let resized =
            self.description.resized(&sizes).map_err(|e| refused(&names.join(", "), &format!("then {e}")))?;
        let Api::Three(three) = self.foreign.api else {
            return Err(Error::WrongInput("FMI 2.0 has no structural parameters".into()));
        };
        let all = names.join(", ");
        self.foreign
            .call("fmi3EnterConfigurationMode", three.enter_configuration, |f, c| unsafe { f(c) })
            .map_err(|e| named(e, &all))?;
        for ((v, value), name) in found.iter().zip(&names) {
            self.foreign.set_whole(v, *value).map_err(|e| named(e, name))?;
        }
        self.foreign
            .call("fmi3ExitConfigurationMode", three.exit_configuration, |f, c| unsafe { f(c) })
            .map_err(|e| named(e, &all))?;
        self.description = Arc::new(resized);
        Ok(())
    }
}

/// A structural parameter that may have this value.
fn structural(description: &ModelDescription, name: &str, value: i128) -> Result<Variable> {
    let found = description.position(name).map(|k| &description.variables[k]);
    let found = found.filter(|v| v.causality == Causality::StructuralParameter);
    let Some(v) = found else {
        return Err(Error::WrongInput(format!("`{name}` is no structural parameter")));
    };
    let (low, high) = range(v.value_type).ok_or_else(|| {
        Error::WrongInput(format!(
            "`{name}` is a structural parameter of type {:?}; whole numbers are set",
            v.value_type
        ))
    })?;
    let size = Dimension::Parameter(v.reference);
    let sizes = description.variables.iter().any(|a| a.dimensions.contains(&size));
    let low = if sizes { low.max(0) } else { low };
    let inside = (low..=high).contains(&value) && value as f64 >= v.min && value as f64 <= v.max;
    match inside {
        true => Ok(v.clone()),
        false => {
            let (low, high) = ((low as f64).max(v.min), (high as f64).min(v.max));
            Err(refused(&format!("{name} = {value}"), &format!("it goes from {low} to {high}")))
        }
    }
}

fn range(value_type: ValueType) -> Option<(i128, i128)> {
    Some(match value_type {
        ValueType::I8 => (i8::MIN.into(), i8::MAX.into()),
        ValueType::I16 => (i16::MIN.into(), i16::MAX.into()),
        ValueType::I32 => (i32::MIN.into(), i32::MAX.into()),
        ValueType::I64 | ValueType::Enumeration => (i64::MIN.into(), i64::MAX.into()),
        ValueType::U8 => (0, u8::MAX.into()),
        ValueType::U16 => (0, u16::MAX.into()),
        ValueType::U32 => (0, u32::MAX.into()),
        ValueType::U64 => (0, u64::MAX.into()),
        _ => return None,
    })
}

fn refused(what: &str, why: &str) -> Error {
    Error::WrongInput(format!("the structural parameters cannot be {what}: {why}"))
}

/// The error of a call with the parameter that was being set.
fn named(error: Error, what: &str) -> Error {
    match error {
        Error::Call { function, outcome, log, fatal } => {
            let outcome = format!("{outcome} when the structural parameters were to be {what}");
            Error::Call { function, outcome, log, fatal }
        }
        Error::WrongInput(why) => refused(what, &why),
        other => Error::Refused(format!("the structural parameters cannot be {what}: {other}")),
    }
}
