//! Checks the parameters of a subsystem against the schema of its module.

use super::model::SubsystemSpec;
use super::section::must_exist;
use super::source::Source;
use serde_json::{Map, Value};
use terraglue_diagnostics::InputError;
use terraglue_diagnostics::did_you_mean;
use terraglue_diagnostics::{Complaint, check_value};
use terraglue_subsystem::{Config, Kind, Parameter, ParameterType, Schema};

/// Modules that come with the program.
pub const SHIPPED_MODULES: &[&str] =
    &["rigid-body", "soil-cellular-automaton", "soil-bekker", "gait", "sensor"];

/// Checks names, types, ranges, choices and paths; takes from the offered soil row what the schema names; fills
/// in the defaults. Sub-tables named after a shipped module other than the chosen one are ignored.
///
/// # Errors
/// The first wrong parameter, at its place in the scenario.
pub fn check_parameters(
    schema: &Schema,
    spec: &SubsystemSpec,
    source: &Source,
) -> Result<Config, Box<InputError>> {
    check_parameters_among(schema, spec, source, SHIPPED_MODULES)
}

/// The same with the names of all modules that were found.
///
/// # Errors
/// The first wrong parameter, at its place in the scenario.
pub fn check_parameters_among(
    schema: &Schema,
    spec: &SubsystemSpec,
    source: &Source,
    modules: &[&str],
) -> Result<Config, Box<InputError>> {
    let check = Check { schema, spec, source, modules };
    let mut values = check.with_own_table();
    check.table("", &values)?;
    values.retain(|key, value| !check.is_of_another_module(key, value));
    check.take_offered(&mut values)?;
    check.required(&values)?;
    let config = Config::parse(&Value::Object(values).to_string());
    let config = config.map_err(|e| source.error_at_value(&[&spec.name], e.to_string(), None))?;
    Ok(config.with_defaults(schema))
}

/// Checks the table `[NAME.MODULE]` of a module that the scenario does not choose.
///
/// # Errors
/// The first wrong parameter, at its place in the scenario.
pub(super) fn check_own_table(
    schema: &Schema,
    spec: &SubsystemSpec,
    source: &Source,
) -> Result<(), Box<InputError>> {
    match spec.parameters.get(&schema.name) {
        Some(Value::Object(values)) => Check { schema, spec, source, modules: &[] }.table("", values),
        _ => Ok(()),
    }
}

struct Check<'a> {
    schema: &'a Schema,
    spec: &'a SubsystemSpec,
    source: &'a Source,
    modules: &'a [&'a str],
}

impl Check<'_> {
    /// The parameters; a module named by its path has its own sub-table under the name in its schema.
    fn with_own_table(&self) -> Map<String, Value> {
        let mut values = self.spec.parameters.clone();
        let name = self.schema.name.as_str();
        if self.parameter(name).is_none()
            && !self.is_prefix(name)
            && let Some(Value::Object(own)) = values.remove(name)
        {
            values.extend(own);
        }
        values
    }

    fn table(&self, prefix: &str, values: &Map<String, Value>) -> Result<(), Box<InputError>> {
        for (key, value) in values {
            let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
            if prefix.is_empty() && self.is_of_another_module(key, value) {
                continue;
            }
            match (self.parameter(&name), value) {
                (Some(parameter), _) => self.value(parameter, &name, value)?,
                (None, Value::Object(below)) if self.is_prefix(&name) => self.table(&name, below)?,
                (None, _) => return Err(self.unknown(&name)),
            }
        }
        Ok(())
    }

    fn value(&self, parameter: &Parameter, name: &str, value: &Value) -> Result<(), Box<InputError>> {
        // a name of one's own may be a bare number as well as a number with its unit in quotes
        let bare = parameter.name.ends_with(".*") && parameter.parameter_type == ParameterType::Text;
        if !(bare && value.is_number()) {
            check_value(parameter, None, value)
                .map_err(|c| self.complain_of_entry(parameter, name, value, c))?;
        }
        match (parameter.parameter_type, value.as_str()) {
            (ParameterType::Path, Some(text)) => {
                must_exist(self.source, text).map_err(|c| self.complain(name, c))
            }
            _ => Ok(()),
        }
    }

    /// The parameter of that dotted name; `a.*` admits any key below `a`.
    fn parameter(&self, name: &str) -> Option<&Parameter> {
        let wildcard = |p: &str| p.strip_suffix('*').is_some_and(|head| name.starts_with(head));
        let exact = self.schema.parameters.iter().find(|p| p.name == name);
        exact.or_else(|| self.schema.parameters.iter().find(|p| wildcard(&p.name)))
    }

    fn is_prefix(&self, name: &str) -> bool {
        let head = format!("{name}.");
        self.schema.parameters.iter().any(|p| p.name.starts_with(&head))
    }

    fn is_of_another_module(&self, key: &str, value: &Value) -> bool {
        let known = self.parameter(key).is_some() || self.is_prefix(key);
        value.is_object() && !known && self.modules.contains(&key)
    }

    fn unknown(&self, name: &str) -> Box<InputError> {
        let message = format!(
            "unknown key `{name}` in `[{}]`: module `{}` does not take it",
            self.spec.name, self.schema.name
        );
        let mut names: Vec<&str> = self.schema.parameters.iter().map(|p| p.name.as_str()).collect();
        let host = super::keys::subsystem_keys();
        names.extend(host.iter().map(|k| k.parameter.name.as_str()));
        self.source.error(&self.source.key_place(&self.path(name)), message, did_you_mean(name, names))
    }

    fn take_offered(&self, values: &mut Map<String, Value>) -> Result<(), Box<InputError>> {
        let takes_any = self.spec.offered.keys().any(|name| self.parameter(name).is_some());
        if !self.spec.offered.is_empty() && !takes_any && !matches!(self.schema.kind, Kind::Soil | Kind::Law)
        {
            let (module, subsystem) = (&self.schema.name, &self.spec.name);
            let message = format!(
                "`parameters` are those of a soil, and `{module}` is none: it takes no number of them"
            );
            let help = format!(
                "take `parameters` out, or name a soil as `module` of `[{subsystem}]`: `terraglue modules soil` lists them"
            );
            return Err(self.source.error_at_value(&[subsystem, "parameters"], message, Some(help)));
        }
        for (name, value) in &self.spec.offered {
            if let Some(parameter) = self.parameter(name).filter(|_| !values.contains_key(name)) {
                check_value(parameter, None, value).map_err(|c| self.complain("parameters", c))?;
                values.insert(name.clone(), value.clone());
            }
        }
        Ok(())
    }

    fn required(&self, values: &Map<String, Value>) -> Result<(), Box<InputError>> {
        for p in &self.schema.parameters {
            let silent = p.default.is_null() && !p.optional && !p.name.ends_with('*');
            if silent && find(values, &p.name).is_none() {
                let what = format!(
                    "`[{}]` lacks `{}`, which module `{}` needs",
                    self.spec.name, p.name, self.schema.name
                );
                let mut help =
                    format!("{}: {}; takes {}", p.name, p.help, terraglue_diagnostics::allowed(p, None));
                if self.spec.offered.is_empty() && super::soil_row::gives(&p.name) {
                    help += ". Or parameters = \"LETE_sand\": a soil that `terraglue soils` lists gives all its numbers";
                }
                return Err(self.source.error_at_value(&[&self.spec.name], what, Some(help)));
            }
        }
        Ok(())
    }

    fn complain(&self, name: &str, c: Complaint) -> Box<InputError> {
        self.source.error(&self.source.value_place(&self.path(name)), c.message, c.help)
    }

    /// The same at the entry that is wrong, where the value is a table: an edit may have added it to those of the file.
    fn complain_of_entry(
        &self,
        parameter: &Parameter,
        name: &str,
        value: &Value,
        c: Complaint,
    ) -> Box<InputError> {
        let is_wrong = |key: &String, value: &Value| {
            let alone = Value::Object([(key.clone(), value.clone())].into_iter().collect());
            check_value(parameter, None, &alone).is_err()
        };
        let entry = value.as_object().and_then(|all| all.iter().find(|(key, value)| is_wrong(key, value)));
        let mut path = self.path(name);
        path.extend(entry.map(|(key, _)| key.as_str()));
        self.source.error(&self.source.value_place(&path), c.message, c.help)
    }

    /// Where a parameter was written: in the module's own sub-table, or directly in the subsystem's.
    fn path<'b>(&'b self, name: &'b str) -> Vec<&'b str> {
        let below = |table: &[&'b str]| table.iter().copied().chain(name.split('.')).collect::<Vec<_>>();
        let subsystem = self.spec.name.as_str();
        let own = [&self.spec.module, &self.schema.name].map(|module| below(&[subsystem, module]));
        let found = own.into_iter().find(|path| self.source.has(path));
        found.unwrap_or_else(|| below(&[subsystem]))
    }
}

fn find<'a>(values: &'a Map<String, Value>, name: &str) -> Option<&'a Value> {
    let mut parts = name.split('.');
    let mut value = values.get(parts.next()?)?;
    for part in parts {
        value = value.get(part)?;
    }
    Some(value)
}
