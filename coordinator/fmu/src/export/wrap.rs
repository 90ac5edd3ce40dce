//! A single module as a small scenario, so that it can be exported like any other.

use std::path::Path;
use terraglue_host::SearchPath;
use terraglue_subsystem::Kind;

/// Text that every small scenario contains; `--set` changes it.
const COMMON: &str =
    "[time]\nstep_s = 0.001\nduration_s = 10.0\n\n[world]\ngravity_m_s2 = [0.0, 0.0, -9.81]\n";

/// Ground, and feet that the master moves.
const GROUND: &str = "\n[terrain]\nkind = \"flat\"\nsize_m = [4.0, 4.0]\nspacing_m = 0.01\n\n[gluing]\nstrategy = \
                      \"iterative\"\n\n[foot]\nmodule = \"feet\"\n";

/// Text of a scenario around a module, and the name of its subsystem in it.
///
/// # Errors
/// The module is not found or cannot be loaded.
pub fn wrap(module: &str, search: &SearchPath) -> Result<(String, &'static str), String> {
    let found = crate::library().find(module, search, Path::new("."));
    let found = found.map_err(|e| match e.nearest() {
        Some(near) => format!("{e}; did you mean `{near}`?"),
        None => e.to_string(),
    })?;
    let (name, ground) = match found.schema().kind {
        Kind::Soil => ("soil", GROUND),
        Kind::Robot => ("robot", ""),
        Kind::Controller | Kind::Law | Kind::Sensor => ("unit", ""),
    };
    let quoted = serde_json::Value::from(module).to_string();
    Ok((format!("{COMMON}{ground}\n[{name}]\nmodule = {quoted}\n"), name))
}
