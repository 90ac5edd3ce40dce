//! Variables and actions by their full names.

use crate::errors::{Refusal, Refused, unknown};
use crate::run::Run;
use pyo3::prelude::*;
use serde_json::Value;
use terraglue::Testbed;
use terraglue::diagnostics::closest;
use terraglue::scenario::did_you_mean;
use terraglue::signals::{VariableRef, pattern};
use terraglue::subsystem::Variable;

/// Finds a variable.
pub fn find(run: &Run, name: &str) -> Refused<VariableRef> {
    let directory = &run.testbed.signals().directory;
    directory.find(name).ok_or_else(|| {
        let hint = directory.hint(name).map(|hint| format!("; {hint}")).unwrap_or_default();
        Refusal::Unknown(format!("there is no variable `{name}`{hint}"))
    })
}

/// Finds several.
pub fn find_all(run: &Run, names: &[String]) -> Refused<Vec<VariableRef>> {
    names.iter().map(|name| find(run, name)).collect()
}

/// Description of a variable.
pub fn describe<'a>(run: &'a Run, name: &str) -> Refused<&'a Variable> {
    Ok(find(run, name)?.describe(run.testbed.instances()))
}

/// Committed values as numbers; NaN where a variable is none.
pub fn values(testbed: &Testbed, variables: &[VariableRef], out: &mut [f64]) {
    for (out, variable) in out.iter_mut().zip(variables) {
        *out = variable.number(testbed.instances()).unwrap_or(f64::NAN);
    }
}

/// Why some of the numbers could not be set, if so; NaN is none.
pub fn object(run: &Run, names: &[String], values: &[f64]) -> Refused {
    for (name, value) in names.iter().zip(values).filter(|(_, value)| !value.is_nan()) {
        if value.is_infinite() {
            return Err(Refusal::Input(format!(
                "`{name}` = {value}: a finite number is wanted, or NaN to leave it as it is"
            )));
        }
        if let Some(why) = find(run, name)?.objection(run.testbed.instances(), &Value::from(*value)) {
            return Err(Refusal::Input(format!("cannot set `{name}` = {value}: {why}")));
        }
    }
    Ok(())
}

/// Sets variables to numbers, all of them or none; NaN leaves one as it is.
pub fn write(run: &mut Run, names: &[String], values: &[f64]) -> Refused {
    if names.len() != values.len() {
        return Err(Refusal::Input(format!("write: {} numbers are wanted, one for each name", names.len())));
    }
    find_all(run, names)?;
    object(run, names, values)?;
    let given = names.iter().zip(values).filter(|(_, value)| !value.is_nan());
    given.into_iter().try_for_each(|(name, value)| set(run, name, &Value::from(*value)))
}

/// Sets a variable.
pub fn set(run: &mut Run, name: &str, value: &Value) -> Refused {
    find(run, name)?;
    run.testbed.set(name, value).map_err(|error| match error {
        terraglue::Error::Simulation { message, .. } => Refusal::Input(message),
        other => Refusal::Failed(other),
    })
}

/// Full names of all actions with their help.
pub fn actions(testbed: &Testbed) -> Vec<(String, String)> {
    let of = |instance: &terraglue::host::Instance| {
        let named =
            instance.actions().iter().map(|a| (format!("{}.{}", instance.name(), a.name), a.help.clone()));
        named.collect::<Vec<_>>()
    };
    testbed.instances().iter().flat_map(of).collect()
}

/// Does an action.
pub fn act(run: &mut Run, action: &str, arguments: &str) -> Refused {
    let known = actions(&run.testbed);
    if !known.iter().any(|(name, _)| name == action) {
        let hint = did_you_mean(action, known.iter().map(|(name, _)| name.as_str()));
        let hint = hint.unwrap_or_else(|| "`actions` has all of them".to_owned());
        return Err(Refusal::Unknown(format!("there is no action `{action}`; {hint}")));
    }
    Ok(run.testbed.act(action, arguments)?)
}

/// The names that match, pattern by pattern; each `*` matches within one dotted part, as in connections of scenarios.
#[pyfunction]
pub fn matching(py: Python<'_>, names: Vec<String>, patterns: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    let patterns = match patterns.extract::<String>() {
        Ok(one) => vec![one],
        Err(_) => patterns.extract::<Vec<String>>()?,
    };
    let mut found = Vec::new();
    for pattern in patterns {
        let before = found.len();
        found.extend(names.iter().filter(|name| pattern::matches(&pattern, name)).cloned());
        if found.len() == before {
            let near = closest(&pattern, names.iter().map(String::as_str));
            let hint = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
            return Err(unknown(py, format!("no variable matches `{pattern}`{hint}")));
        }
    }
    Ok(found)
}
