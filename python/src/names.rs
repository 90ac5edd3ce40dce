//! Variables by their full names.

use crate::errors;
use pyo3::prelude::*;
use terraglue::Testbed;
use terraglue::signals::VariableRef;
use terraglue::subsystem::Variable;

/// Finds a variable.
pub fn find(py: Python<'_>, testbed: &Testbed, name: &str) -> PyResult<VariableRef> {
    let directory = &testbed.signals().directory;
    directory.find(name).ok_or_else(|| {
        let hint = directory.hint(name).map(|hint| format!("; {hint}")).unwrap_or_default();
        errors::unknown(py, format!("there is no variable `{name}`{hint}"))
    })
}

/// Finds several.
pub fn find_all(py: Python<'_>, testbed: &Testbed, names: &[String]) -> PyResult<Vec<VariableRef>> {
    names.iter().map(|name| find(py, testbed, name)).collect()
}

/// Description of a variable.
pub fn describe<'a>(py: Python<'_>, testbed: &'a Testbed, name: &str) -> PyResult<&'a Variable> {
    Ok(find(py, testbed, name)?.describe(testbed.instances()))
}

/// Committed values as numbers; NaN where a variable is none.
pub fn values(testbed: &Testbed, variables: &[VariableRef], out: &mut [f64]) {
    for (out, variable) in out.iter_mut().zip(variables) {
        *out = variable.number(testbed.instances()).unwrap_or(f64::NAN);
    }
}
