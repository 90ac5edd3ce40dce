//! The test context: module, parameters, folders and seed of a test.

use super::check_file::CheckFile;
use super::finding::{Stop, Verdict};
use super::fixture::Flat;
use super::scope::{Area, Level};
use serde_json::{Map, Value};
use std::path::PathBuf;
use std::sync::Arc;
use terraglue_host::{HostServices, Instance, LoadError, LoadedModule, SearchPath, law};
use terraglue_scenario::{check_value, did_you_mean};
use terraglue_subsystem::{Config, Kind, Mount, Parameter, ParameterType, Schema};
use terraglue_terrain::SplitMix64;

/// The body that a sensor sits on, of the world that it is shown.
pub const MOUNTED: &str = "others.body";

/// Numbers of a loose lunar soil (Apollo, nominal), for parameters without a default that carry these names.
const SOIL: [(&str, f64); 8] = [
    ("n", 1.0),
    ("k_c", 1400.0),
    ("k_phi", 820e3),
    ("c_pa", 170.0),
    ("phi_rad", 0.6109),
    ("K_m", 0.018),
    ("density_kg_m3", 1500.0),
    ("cohesion_pa", 170.0),
];

/// The soil in which a law is stepped.
const SOIL_OF_LAWS: &str = "soil-bekker";

/// The module under test, its parameters, and how hard to try.
pub struct TestContext {
    /// The file.
    pub path: PathBuf,
    /// How hard to try.
    pub level: Level,
    /// Seed of everything random.
    pub seed: u64,
    /// Parameters given by the user, by dotted name.
    pub sets: Vec<(String, Value)>,
    /// Folder of relative paths in parameters.
    pub folder: PathBuf,
    /// The program that can repeat a run in another process.
    pub program: Option<PathBuf>,
}

impl TestContext {
    /// For a module file; the file beside it gives parameters, `sets` (as `--set`) come after them.
    ///
    /// # Errors
    /// The file beside the module is wrong.
    pub fn new(path: PathBuf, level: Level, seed: u64, sets: &[(String, String)]) -> Result<Self, String> {
        let beside = CheckFile::beside(&path)?;
        let typed = |text: &String| serde_json::from_str(text).unwrap_or_else(|_| Value::from(text.as_str()));
        let mut all = beside.parameters;
        all.extend(sets.iter().map(|(key, text)| (key.clone(), typed(text))));
        let folder = beside.folder.unwrap_or_else(|| ".".into());
        Ok(Self { path, level, seed, sets: all, folder, program: None })
    }

    /// Randomness of one test: of its name and of the seed.
    pub fn random(&self, test: &str) -> SplitMix64 {
        SplitMix64::new(terraglue_host::instance_seed(self.seed, test))
    }

    /// Few, some or many; of a module in Python, whose every call crosses to its process, a quarter.
    pub fn count(&self, quick: usize) -> usize {
        let all = quick * [1, 2, 20][self.level as usize];
        if terraglue_host::is_python(&self.path) { all.div_ceil(4) } else { all }
    }

    /// The module itself.
    ///
    /// # Errors
    /// A finding: it cannot be loaded.
    pub fn own_module(&self) -> Verdict<LoadedModule> {
        LoadedModule::load(&self.path).map_err(|e| not_usable("loading", &e))
    }

    /// The module that is stepped: itself, or the soil around a law.
    ///
    /// # Errors
    /// A finding: it cannot be loaded; a skip: a law, and no soil is at hand.
    pub fn module(&self) -> Verdict<LoadedModule> {
        let own = self.own_module()?;
        if own.schema().kind != Kind::Law {
            return Ok(own);
        }
        let search = SearchPath::standard(&[], &self.folder);
        let Some(path) = search.locate(SOIL_OF_LAWS) else {
            return Err(Stop::Skip(format!(
                "the soil `{SOIL_OF_LAWS}` is not beside the program: the law was not stepped"
            )));
        };
        LoadedModule::load(&path).map_err(|e| not_usable("loading", &e))
    }

    /// Services as the coordinator gives them: earth's gravity, level ground of a metre, eight slots.
    pub fn services(&self) -> HostServices {
        self.services_on(Flat::LEVEL)
    }

    /// The same on other ground.
    pub fn services_on(&self, ground: Flat) -> HostServices {
        let mut services = HostServices::new(self.seed, &self.folder);
        services.gravity = [0.0, 0.0, -9.81];
        services.terrain = Some(Arc::new(ground));
        services.log = Some(Arc::new(|_, _, _| {}));
        services
    }

    /// Parameters: those given, those of a usual soil, a body to sit on, else the middle of the range.
    pub fn config(&self, schema: &Schema) -> Config {
        let mut map = Map::new();
        for p in schema.parameters.iter().filter(|p| p.default.is_null() && !p.name.ends_with('*')) {
            let soil = SOIL.iter().find(|(name, _)| *name == p.name).map(|(_, x)| Value::from(*x));
            let usual = || if p.name == Mount::KEY { Some(Value::from(MOUNTED)) } else { middle(p) };
            let value = soil.or_else(|| (!p.optional).then(usual).flatten());
            if let Some(value) = value {
                insert(&mut map, &p.name, value);
            }
        }
        let takes_law = schema.parameters.iter().any(|p| p.name == law::KEY);
        if takes_law && self.kind() == Some(Kind::Law) {
            let path = std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone());
            insert(&mut map, law::KEY, path.to_string_lossy().into());
        }
        for (name, value) in &self.sets {
            insert(&mut map, name, value.clone());
        }
        Config::parse(&Value::Object(map).to_string()).unwrap_or_default()
    }

    /// An instance as the coordinator would make it.
    ///
    /// # Errors
    /// A finding: it cannot be made.
    pub fn instance(&self) -> Verdict<Instance> {
        self.instance_on(&self.module()?, Flat::LEVEL)
    }

    /// The same of a module that is loaded already, on other ground.
    ///
    /// # Errors
    /// As [`TestContext::instance`].
    pub fn instance_on(&self, module: &LoadedModule, ground: Flat) -> Verdict<Instance> {
        let config = self.config(module.schema());
        let made = module.instantiate("checked", config, &self.services_on(ground));
        made.map_err(|e| not_usable("instantiate", &e))
    }

    /// The same with other values for those of the named parameters that the module has.
    ///
    /// # Errors
    /// As [`TestContext::instance`].
    pub fn instance_with(
        &self,
        module: &LoadedModule,
        ground: Flat,
        values: &[(&str, f64)],
    ) -> Verdict<Instance> {
        let has = |name: &str| module.schema().parameters.iter().any(|p| p.name == name);
        let mut context = Self {
            sets: self.sets.clone(),
            path: self.path.clone(),
            folder: self.folder.clone(),
            program: None,
            ..*self
        };
        context.sets.extend(
            values.iter().filter(|(name, _)| has(name)).map(|(name, x)| ((*name).to_owned(), (*x).into())),
        );
        context.instance_on(module, ground)
    }

    /// Problem of the given parameters (`--set`, or the file beside the module); None: there is none, or the module cannot
    /// be loaded. A law takes its own numbers and those of the soil around it.
    pub fn wrong_set(&self) -> Option<String> {
        if self.sets.is_empty() {
            return None;
        }
        let own = self.own_module().ok()?;
        let stepped = self.module().ok()?;
        let law = own.schema().kind == Kind::Law;
        self.sets.iter().find_map(|(key, value)| {
            let number = key.strip_prefix("law.parameters.").unwrap_or(key);
            match law && own.schema().parameters.iter().any(|p| p.name == number) {
                true => wrong_value(own.schema(), number, value),
                false => wrong_value(stepped.schema(), key, value),
            }
        })
    }

    /// Whether the module needs a path that nobody gave; then hardly anything can be tried.
    pub fn missing_path(&self, schema: &Schema) -> Option<String> {
        let given = |name: &str| self.sets.iter().any(|(key, _)| key == name);
        let needed = |p: &&Parameter| {
            p.parameter_type == ParameterType::Path && p.default.is_null() && !p.optional && !given(&p.name)
        };
        schema.parameters.iter().find(needed).map(|p| p.name.clone())
    }

    /// Skips a test that a module in Python cannot be put to, with what that costs.
    ///
    /// # Errors
    /// The skip.
    pub fn needs_a_library(&self, cost: &str) -> Verdict {
        if terraglue_host::is_python(&self.path) {
            return Err(Stop::Skip(format!("a module in Python runs in a process of its own: {cost}")));
        }
        Ok(())
    }

    /// Kind of the module, from its description of itself; None: it cannot be loaded.
    pub fn kind(&self) -> Option<Kind> {
        LoadedModule::load(&self.path).ok().map(|m| m.schema().kind)
    }
}

impl Area {
    /// All, in the order in which they are shown.
    pub const ALL: [Self; 7] = [
        Self::Library,
        Self::LifeCycle,
        Self::Values,
        Self::State,
        Self::Numbers,
        Self::Physics,
        Self::Resources,
    ];
}

fn not_usable(call: &str, error: &LoadError) -> Stop {
    Stop::fail(call, "parameters of the check", error.to_string(), "success")
}

/// Problem of a value for the parameter of this dotted name.
fn wrong_value(schema: &Schema, key: &str, value: &Value) -> Option<String> {
    let all = &schema.parameters;
    let below = |head: &str| key.strip_prefix(head).is_some_and(|rest| rest.starts_with('.'));
    let wildcard = |name: &str| name.strip_suffix('*').is_some_and(|head| key.starts_with(head));
    if let Some(p) = all.iter().find(|p| p.name == key) {
        let wrong = check_value(p, None, value).err()?;
        let help = wrong.help.map_or_else(String::new, |help| format!("; {help}"));
        return Some(format!("`{key}` of `{}`: {}{help}", schema.name, wrong.message));
    }
    if all.iter().any(|p| wildcard(&p.name) || below(&p.name)) {
        return None;
    }
    match value {
        Value::Object(table) if all.iter().any(|p| p.name.starts_with(&format!("{key}."))) => {
            table.iter().find_map(|(name, value)| wrong_value(schema, &format!("{key}.{name}"), value))
        }
        _ => {
            let names = did_you_mean(key, all.iter().map(|p| p.name.as_str()));
            let names = names.map_or_else(String::new, |names| format!("; {names}"));
            Some(format!("`{}` has no parameter `{key}`{names}", schema.name))
        }
    }
}

/// A value inside the range of a parameter.
fn middle(p: &Parameter) -> Option<Value> {
    let number = match (p.min, p.max) {
        (Some(a), Some(b)) => 0.5 * (a + b),
        (Some(a), None) => a + 1.0,
        (None, Some(b)) => b - 1.0,
        (None, None) => 1.0,
    };
    match p.parameter_type {
        ParameterType::Number => Some(number.into()),
        ParameterType::Integer => Some((number.round() as i64).into()),
        ParameterType::Bool => Some(false.into()),
        ParameterType::Text => Some(p.choices.first().map_or("", String::as_str).into()),
        ParameterType::Numbers => Some(Value::Array(Vec::new())),
        ParameterType::NumberTable => Some(Value::Object(Map::new())),
        ParameterType::Path
        | ParameterType::NumberByName
        | ParameterType::TextByName
        | ParameterType::Tables => None,
    }
}

fn insert(map: &mut Map<String, Value>, name: &str, value: Value) {
    match name.split_once('.') {
        None => drop(map.insert(name.into(), value)),
        Some((head, rest)) => {
            let below = map.entry(head).or_insert_with(|| Value::Object(Map::new()));
            if let Value::Object(below) = below {
                insert(below, rest, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn given_parameters_are_held_against_the_schema() {
        let mu = Parameter::number("mu", "", 0.7, "Coulomb coefficient").positive();
        let own = Parameter::of("law.parameters.*", ParameterType::Text, "a name of your own").optional();
        let schema = Schema {
            name: "springs".into(),
            kind: Kind::Soil,
            help: "springs".into(),
            parameters: vec![mu, own],
        };
        let said = |key: &str, value: serde_json::Value| wrong_value(&schema, key, &value);
        assert_eq!(said("mu", 0.5.into()), None);
        assert_eq!(said("law.parameters.k", 3.into()), None);
        assert_eq!(said("law", serde_json::json!({ "parameters": {} })), None);
        let range = said("mu", (-1).into()).expect("out of range");
        assert!(range.contains("`mu` of `springs`") && range.contains("-1"), "{range}");
        let name = said("muu", 1.into()).expect("unknown");
        assert!(name.contains("no parameter `muu`") && name.contains("did you mean `mu`"), "{name}");
    }
}
