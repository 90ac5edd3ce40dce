//! Variables of an instance, by the kind of their numbers.

use crate::finding::Verdict;
use terraglue_host::{Instance, Reply};
use terraglue_subsystem::{Causality, Effect, ValueType, Values, ValuesMut, Variable};

/// Variables that are doubles.
pub fn numbers(instance: &Instance) -> Vec<Variable> {
    let doubles =
        instance.subsystem().variables().iter().filter(|v| v.value_type == ValueType::F64 && !v.is_empty());
    doubles.cloned().collect()
}

/// Committed values of all doubles that can be read.
///
/// # Errors
/// The module failed.
pub fn outputs(instance: &Instance) -> Verdict<Vec<f64>> {
    let mut all = Vec::new();
    for v in numbers(instance) {
        let mut values = vec![0.0; v.len()];
        instance.get(&[v.id], ValuesMut::F64(&mut values))?;
        all.extend(values);
    }
    Ok(all)
}

/// Sets all inputs that are doubles to `value(number of the input)`, kept inside their ranges.
///
/// # Errors
/// The module failed or refused.
pub fn set_numbers(instance: &mut Instance, value: impl Fn(usize) -> f64) -> Verdict {
    let inputs = numbers(instance).into_iter();
    let inputs = inputs.filter(|v| v.causality == Causality::Input && v.effect == Effect::Live);
    for (k, v) in inputs.enumerate() {
        let x = value(k).clamp(v.min, v.max);
        let reply = instance.set(&[v.id], Values::F64(&vec![x; v.len()]))?;
        if let Reply::Refused(reason) = reply {
            return Err(crate::Stop::fail(
                "set",
                format!("the input `{}` = {x}, inside its range", v.name),
                format!("refused: {reason}"),
                "acceptance",
            ));
        }
    }
    Ok(())
}
