//! The law that a scenario names below a soil, `[soil.law] plugin = "my-law"`: found, given its numbers, and handed to the
//! soil through the services of its host.

use super::isolation::{self, What};
use super::{HostServices, LoadedModule, SearchPath};
use std::path::Path;
use std::sync::Arc;
use terraglue_subsystem::{
    Config, Error, Host, Kind, LogLevel, NodeLaw, Parameter, ParameterType, Result, Schema, Terrain,
};

/// The parameter of a soil that names a law.
pub const KEY: &str = "law.plugin";
/// Interpreter of a law in Python; the host puts the key `python` of the soil's table there.
pub const INTERPRETER: &str = "law.python";
/// Key of the numbers of a law in a scenario.
const NUMBERS: &str = "law.parameters";

/// The file of the law that a value of [`KEY`] names; as for modules, see `Library::find`.
///
/// # Errors
/// Not found: every place tried.
pub fn locate(
    name: &str,
    search: &SearchPath,
    folder: &Path,
) -> std::result::Result<std::path::PathBuf, super::LoadError> {
    if super::search::is_path(name) {
        return Ok(super::search::below(folder, name));
    }
    search.locate(name).ok_or_else(|| super::LoadError::Unknown {
        name: name.into(),
        file: super::search::file_name(name),
        looked: search.folders().to_vec(),
        nearest: super::search::nearest(name, search.all().into_iter().map(|(n, _)| n)),
    })
}

/// The law that the parameters of a soil name by its file, ready to be called; `None`: they name none, or the module does
/// not take one.
///
/// # Errors
/// The file is no law, or its numbers are wrong.
pub(super) fn of_config(
    schema: &Schema,
    config: &Config,
    host: &dyn Host,
    services: &HostServices,
) -> Result<Option<Arc<dyn NodeLaw>>> {
    let takes = schema.parameters.iter().any(|p| p.name == KEY);
    let Some(path) = config.get(KEY).and_then(|v| v.as_str()).filter(|_| takes) else { return Ok(None) };
    let refused = |e: &dyn std::fmt::Display| Error::Refused(format!("[TG12] `{KEY}`: {e}"));
    let folder = Path::new(host.folder());
    let path = locate(path, &SearchPath::standard(&[], folder), folder).map_err(|e| refused(&e))?;
    let law = LoadedModule::load(&path).map_err(|e| refused(&e))?;
    let named = config.get(INTERPRETER).and_then(|v| v.as_str());
    let law = law.run_by(super::interpreter(named, folder));
    open(&law, config, host.name(), services).map(Some).map_err(|e| refused(&e))
}

/// A law with the numbers that the parameters of a soil give it; one in Python in a process of its own.
///
/// # Errors
/// The module is no law, a number is missing, unknown or out of range, the process does not start.
pub fn open(
    law: &LoadedModule,
    config: &Config,
    instance_name: &str,
    services: &HostServices,
) -> std::result::Result<Arc<dyn NodeLaw>, String> {
    let schema = law.schema();
    is_law(schema)?;
    let numbers = numbers(schema, config)?;
    with_numbers(law, numbers, instance_name, services)
}

fn is_law(schema: &Schema) -> std::result::Result<(), String> {
    if schema.kind != Kind::Law {
        return Err(format!(
            "`{}` is no law but a {}",
            schema.name,
            format!("{:?}", schema.kind).to_lowercase()
        ));
    }
    Ok(())
}

fn with_numbers(
    law: &LoadedModule,
    numbers: Vec<f64>,
    instance_name: &str,
    services: &HostServices,
) -> std::result::Result<Arc<dyn NodeLaw>, String> {
    let schema = law.schema();
    if let Some((python, path)) = law.python() {
        let what = What::Law {
            path: std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
            numbers: by_name(schema, &numbers),
            python: python.to_owned(),
        };
        let host = services.for_instance(instance_name);
        return isolation::start_law(&schema.name, what, &host, services).map_err(|e| e.to_string());
    }
    let foreign = law.foreign().ok_or("a law is a library of its own")?;
    foreign.law(&schema.name, numbers).map_err(|e| e.to_string())
}

fn by_name(schema: &Schema, numbers: &[f64]) -> serde_json::Map<String, serde_json::Value> {
    schema.parameters.iter().zip(numbers).map(|(p, x)| (p.name.clone(), (*x).into())).collect()
}

/// A law whose numbers are tried out, one set after the other.
pub struct LawTrial<'a> {
    module: &'a LoadedModule,
    services: &'a HostServices,
    law: Arc<dyn NodeLaw>,
}

impl<'a> LawTrial<'a> {
    /// A law with these numbers to begin with, in the order of its schema.
    ///
    /// # Errors
    /// The module is no law, or its process does not start.
    pub fn open(
        module: &'a LoadedModule,
        numbers: &[f64],
        services: &'a HostServices,
    ) -> std::result::Result<Self, String> {
        is_law(module.schema())?;
        let law = with_numbers(module, numbers.to_vec(), "law", services)?;
        Ok(Self { module, services, law })
    }

    /// The law with some of the numbers.
    pub fn law(&self) -> &dyn NodeLaw {
        self.law.as_ref()
    }

    /// The law with other numbers; one in Python has the numbers of the last call.
    ///
    /// # Errors
    /// Its process was lost.
    pub fn with(&self, numbers: &[f64]) -> std::result::Result<Arc<dyn NodeLaw>, String> {
        let Some(isolated) = self.law.as_any().downcast_ref::<isolation::IsolatedLaw>() else {
            return with_numbers(self.module, numbers.to_vec(), "law", self.services);
        };
        isolated.renumber(by_name(self.module.schema(), numbers)).map_err(|e| e.to_string())?;
        Ok(self.law.clone())
    }
}

/// The numbers of a law, in the order of its schema, as the parameters of a soil give them.
///
/// # Errors
/// One is missing, unknown or out of range.
pub fn numbers(schema: &Schema, config: &Config) -> std::result::Result<Vec<f64>, String> {
    let own = config.get(NUMBERS).and_then(|v| v.as_object());
    for name in own.into_iter().flat_map(|o| o.keys()) {
        if !schema.parameters.iter().any(|p| p.name == *name) {
            let names: Vec<&str> = schema.parameters.iter().map(|p| p.name.as_str()).collect();
            return Err(format!(
                "`{}` has no parameter `{name}`; it takes {}",
                schema.name,
                names.join(", ")
            ));
        }
    }
    let number = |p: &Parameter| number(schema, p, config, own.and_then(|o| o.get(&p.name)));
    schema.parameters.iter().map(number).collect()
}

/// A number of a law: its own, else the soil's of that name, else its default.
fn number(
    schema: &Schema,
    p: &Parameter,
    config: &Config,
    own: Option<&serde_json::Value>,
) -> std::result::Result<f64, String> {
    if p.parameter_type != ParameterType::Number {
        return Err(format!(
            "the parameter `{}` of `{}` is no number; a law takes numbers only",
            p.name, schema.name
        ));
    }
    let soils = config.get(&p.name).filter(|v| v.is_number());
    let Some(value) = own.or(soils).or(Some(&p.default).filter(|d| !d.is_null())) else {
        return Err(format!(
            "`{}` needs `{}` ({}): give it in `[….law.parameters]`",
            schema.name, p.name, p.help
        ));
    };
    terraglue_diagnostics::check_value(p, None, value)
        .map_err(|c| c.help.map_or_else(|| c.message.clone(), |help| format!("{}; {help}", c.message)))?;
    value.as_f64().ok_or_else(|| format!("`{}` = {value} is no number", p.name))
}

/// The host of a soil with a law.
pub(super) struct LawHost {
    pub(super) host: Arc<dyn Host>,
    pub(super) law: Arc<dyn NodeLaw>,
}

impl Host for LawHost {
    fn name(&self) -> &str {
        self.host.name()
    }

    fn log(&self, level: LogLevel, text: &str) {
        self.host.log(level, text);
    }

    fn parallel_for(&self, n: usize, job: &(dyn Fn(usize) + Sync)) {
        self.host.parallel_for(n, job);
    }

    fn cancelled(&self) -> bool {
        self.host.cancelled()
    }

    fn seed(&self) -> u64 {
        self.host.seed()
    }

    fn folder(&self) -> &str {
        self.host.folder()
    }

    fn slots(&self) -> u32 {
        self.host.slots()
    }

    fn max_nodes(&self) -> u32 {
        self.host.max_nodes()
    }

    fn gravity(&self) -> [f64; 3] {
        self.host.gravity()
    }

    fn terrain(&self) -> Option<&dyn Terrain> {
        self.host.terrain()
    }

    fn law(&self) -> Option<Arc<dyn NodeLaw>> {
        Some(self.law.clone())
    }
}
