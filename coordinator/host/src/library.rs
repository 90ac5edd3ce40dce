//! Modules from shared libraries and modules linked into the program.
#![allow(unsafe_code)] // Loading a library runs its constructors and calls its entry.

use super::crash::Beginning;
use super::description::Description;
use super::error::LoadError;
use super::isolation::{self, Isolation, What};
use super::law::{self, LawHost};
use super::python::{self, PythonFile};
use super::search::{self, SearchPath, below, file_name, is_path, module_name, python_name};
use super::{HostServices, Instance, TeardownErrors};
use libloading::os::unix::{Library as Handle, RTLD_LOCAL, RTLD_NOW, Symbol};
use serde_json::{Map, Value};
use std::error::Error as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use terraglue_fmi::elf::{foreign_machine, is_elf, needed_length};
use terraglue_plugin::ForeignModule;
use terraglue_plugin::abi::{TG_ABI_MAJOR, TgEntry};
use terraglue_subsystem::{Advice, Config, Error as Failure, Host, Kind, Module, Result, Schema, Subsystem};

type Instantiate = fn(&Config, Arc<dyn Host>) -> Result<Box<dyn Subsystem>>;

#[derive(Clone)]
enum Origin {
    Builtin(Instantiate),
    Foreign(Arc<ForeignModule>, PathBuf),
    Python(PythonSource),
}

/// A module in Python and who runs it.
#[derive(Clone)]
struct PythonSource {
    path: PathBuf,
    interpreter: PathBuf,
}

/// A module that is ready to make instances.
#[derive(Clone)]
pub struct LoadedModule {
    schema: Arc<Schema>,
    origin: Origin,
}

impl LoadedModule {
    /// A module linked into the program.
    pub fn builtin<M: Module>() -> Self {
        Self { schema: Arc::new(M::schema()), origin: Origin::Builtin(M::instantiate) }
    }

    /// Loads a library. Checked in this order: it is a library; its section, where it has one, names our ABI; the
    /// system loads it; it has the entry; its table can be used; it describes itself. Of a file in Python only the
    /// description is read.
    ///
    /// # Errors
    /// [`LoadError`] of the first check that fails.
    pub fn load(path: &Path) -> std::result::Result<Self, LoadError> {
        let path = path.to_path_buf();
        inspect(&path)?;
        if python::is_python(&path) {
            let file = PythonFile::read(&path)?;
            log::info!("module {} from {}", file.schema.name, path.display());
            let interpreter = python::interpreter(None, Path::new("."));
            let source = PythonSource { path, interpreter };
            return Ok(Self { schema: Arc::new(file.schema), origin: Origin::Python(source) });
        }
        let table = entry(&path)?;
        let begun = Beginning::of_file(&path, terraglue_plugin::ENTRY);
        // SAFETY: the symbol is the entry of a Terraglue module, whose contract is terraglue.h; the library is
        // never unloaded.
        let module = unsafe { ForeignModule::new(table()) };
        let module = module.map_err(|source| LoadError::Table { path: path.clone(), source })?;
        begun.goes_on("schema");
        let schema =
            module.schema().map_err(|e| LoadError::Schema { path: path.clone(), message: e.to_string() })?;
        log::info!("module {} from {}", schema.name, path.display());
        Ok(Self { schema: Arc::new(schema), origin: Origin::Foreign(Arc::new(module), path) })
    }

    /// The foreign module; None: linked into the program.
    pub(super) fn foreign(&self) -> Option<&ForeignModule> {
        match &self.origin {
            Origin::Foreign(module, _) => Some(module),
            Origin::Builtin(_) | Origin::Python(_) => None,
        }
    }

    /// Name, kind and parameters.
    pub fn schema(&self) -> &Schema {
        &self.schema
    }

    /// File; None: linked into the program.
    pub fn path(&self) -> Option<&Path> {
        match &self.origin {
            Origin::Builtin(_) => None,
            Origin::Foreign(_, path) => Some(path),
            Origin::Python(source) => Some(&source.path),
        }
    }

    /// Whether it is a file in Python, which lives in a process of its own.
    pub fn is_python(&self) -> bool {
        matches!(self.origin, Origin::Python(_))
    }

    /// Its interpreter and its file, if it is in Python.
    pub(super) fn python(&self) -> Option<(&Path, &Path)> {
        match &self.origin {
            Origin::Python(source) => Some((&source.interpreter, &source.path)),
            _ => None,
        }
    }

    /// The same run by this interpreter, where it is in Python.
    pub fn run_by(mut self, interpreter: PathBuf) -> Self {
        if let Origin::Python(source) = &mut self.origin {
            source.interpreter = interpreter;
        }
        self
    }

    /// Makes an instance; what the configuration leaves out gets the default of the schema.
    ///
    /// # Errors
    /// [`LoadError::Instantiate`]: the module refuses the configuration or fails.
    pub fn instantiate(
        &self,
        instance_name: &str,
        config: Config,
        services: &HostServices,
    ) -> std::result::Result<Instance, LoadError> {
        if self.is_python() {
            return self.instantiate_isolated(instance_name, config, services, Isolation::default());
        }
        let config = config.with_defaults(&self.schema);
        let _begun =
            Beginning::of_instance(instance_name, self.path().unwrap_or(Path::new(&self.schema.name)));
        let made = self.make(&config, services.for_instance(instance_name), services);
        self.supervised(instance_name, made)
    }

    /// The subsystem alone, without supervision.
    ///
    /// # Errors
    /// Errors of the module or its law; a module in Python runs in a process of its own only.
    pub fn make(
        &self,
        config: &Config,
        host: Arc<dyn Host>,
        services: &HostServices,
    ) -> Result<Box<dyn Subsystem>> {
        let host = match law::of_config(&self.schema, config, host.as_ref(), services)? {
            Some(law) => Arc::new(LawHost { host, law }),
            None => host,
        };
        match &self.origin {
            Origin::Builtin(instantiate) => instantiate(config, host),
            Origin::Foreign(module, _) => {
                module.instantiate(config, host).map(|s| Box::new(s) as Box<dyn Subsystem>)
            }
            Origin::Python(source) => {
                let text = format!("{} is run in a process of its own", source.path.display());
                Err(Failure::Refused(text))
            }
        }
    }

    /// The same in a process of its own, which may take so long for a call; a module linked into the program has no library and
    /// stays here.
    ///
    /// # Errors
    /// As [`LoadedModule::instantiate`], or no process can be started.
    pub fn instantiate_isolated(
        &self,
        instance_name: &str,
        config: Config,
        services: &HostServices,
        isolation: Isolation,
    ) -> std::result::Result<Instance, LoadError> {
        let config = config.with_defaults(&self.schema);
        let host = services.for_instance(instance_name);
        let made = match self.path() {
            None => self.make(&config, host, services),
            Some(path) => {
                let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
                let config = serde_json::from_str(&config.to_json()).unwrap_or_default();
                let what = match &self.origin {
                    Origin::Python(source) => {
                        What::Python { path, config, python: source.interpreter.clone() }
                    }
                    _ => What::Module { path, config },
                };
                isolation::start(what, &host, services, isolation)
            }
        };
        self.supervised(instance_name, made)
    }

    fn supervised(
        &self,
        instance_name: &str,
        made: Result<Box<dyn Subsystem>>,
    ) -> std::result::Result<Instance, LoadError> {
        let (subsystem, module) = (instance_name.to_owned(), self.schema.name.clone());
        match made {
            Ok(made) => {
                let made = Instance::new(instance_name, &module, self.schema.kind, made);
                let wrong = made.scene().shapes.iter().find_map(|s| Some((&s.name, s.wrong()?)));
                let message = wrong.map(|(name, why)| format!("the shape `{name}`: {why}"));
                match message {
                    Some(message) => Err(LoadError::Instantiate { subsystem, module, message }),
                    None => Ok(made),
                }
            }
            Err(Failure::Refused(message)) => Err(LoadError::Refused { subsystem, module, message }),
            Err(Failure::Fatal(message)) => Err(LoadError::Instantiate { subsystem, module, message }),
            Err(other) => Err(LoadError::Instantiate { subsystem, module, message: other.to_string() }),
        }
    }
}

impl std::fmt::Debug for LoadedModule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LoadedModule").field("name", &self.schema.name).field("path", &self.path()).finish()
    }
}

/// Whether a file can be a module, as far as its bytes say without running it.
fn inspect(path: &Path) -> std::result::Result<(), LoadError> {
    let path_buf = || path.to_path_buf();
    if !path.is_file() {
        return Err(LoadError::MissingFile { path: path_buf() });
    }
    if python::is_python(path) {
        return PythonFile::read(path).map(drop);
    }
    let bytes = terraglue_subsystem::files::read(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::OutOfMemory => {
            let reason = format!("{e}; `memory_mb` of the subsystem is the most that an isolated one has");
            LoadError::CannotLoad { path: path_buf(), reason }
        }
        _ => LoadError::NotALibrary { path: path_buf(), reason: e.to_string() },
    })?;
    if !is_elf(&bytes) {
        let reason = if bytes.is_empty() { "the file is empty" } else { "it has no ELF header" };
        return Err(LoadError::NotALibrary { path: path_buf(), reason: reason.into() });
    }
    let whole = needed_length(&bytes).unwrap_or(usize::MAX);
    if whole > bytes.len() {
        let reason = format!("it is cut off after {} bytes", bytes.len());
        return Err(LoadError::NotALibrary { path: path_buf(), reason });
    }
    if let Some(machine) = foreign_machine(&bytes) {
        return Err(LoadError::OtherMachine { path: path_buf(), machine });
    }
    match Description::of(&bytes) {
        Some(d) if d.abi_major() != Some(TG_ABI_MAJOR) => {
            Err(LoadError::Version { path: path_buf(), found: d.abi })
        }
        _ => Ok(()),
    }
}

/// Loads a library for good and finds its entry.
pub(super) fn entry(path: &Path) -> std::result::Result<TgEntry, LoadError> {
    // A bare file name would be searched by the system, so the path is made absolute.
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let _begun = Beginning::of_file(path, "dlopen");
    // SAFETY: the user asked for this library in the scenario; its constructors run.
    let handle = unsafe { Handle::open(Some(&full), RTLD_NOW | RTLD_LOCAL) };
    let handle = handle.map_err(|e| LoadError::CannotLoad { path: path.to_path_buf(), reason: cause(&e) })?;
    // SAFETY: a symbol of this name has this type, by the contract of terraglue.h.
    let symbol: std::result::Result<Symbol<TgEntry>, _> =
        unsafe { handle.get(terraglue_plugin::ENTRY.as_bytes()) };
    let entry = symbol
        .map(|s| *s)
        .map_err(|e| LoadError::MissingSymbol { path: path.to_path_buf(), reason: cause(&e) });
    // Never unloaded: instances, texts and thread-local destructors of the module stay valid.
    std::mem::forget(handle);
    entry
}

/// The system's own words: the top message of libloading hides them.
fn cause(error: &libloading::Error) -> String {
    error.source().map_or_else(|| error.to_string(), ToString::to_string)
}

/// Modules by name: those linked into the program first, then those on the search path.
#[derive(Clone, Debug, Default)]
pub struct Library {
    builtins: Vec<LoadedModule>,
    fmus: Option<FmuFactory>,
    advisers: Vec<(Kind, Adviser)>,
}

/// Advice on unlikely parameters of a module and of the regions of its mask, under a gravity (m/s²).
pub type Adviser = fn(&Config, &[(String, Map<String, Value>)], f64) -> Vec<Advice>;

/// Makes a subsystem of the FMU at a path with the keys of its table; errors at its end go into the last argument.
pub type FmuFactory = fn(
    &Path,
    &Map<String, Value>,
    Arc<dyn Host>,
    TeardownErrors,
) -> terraglue_subsystem::Result<Box<dyn Subsystem>>;

impl Library {
    /// No module linked into the program and no FMUs: libraries on the search path alone.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same with what makes subsystems of FMUs.
    pub fn with_fmus(mut self, factory: FmuFactory) -> Self {
        self.fmus = Some(factory);
        self
    }

    /// The same with advice on the parameters of modules of a kind.
    pub fn with_adviser(mut self, kind: Kind, adviser: Adviser) -> Self {
        self.advisers.push((kind, adviser));
        self
    }

    /// Advice on the parameters of a module of that kind.
    pub fn advice(
        &self,
        kind: Kind,
        config: &Config,
        regions: &[(String, Map<String, Value>)],
        gravity: f64,
    ) -> Vec<Advice> {
        let of_kind = self.advisers.iter().filter(|(of, _)| *of == kind);
        of_kind.flat_map(|(_, adviser)| adviser(config, regions, gravity)).collect()
    }

    /// Factory of subsystems from FMUs.
    ///
    /// # Errors
    /// The program has none.
    pub fn fmus(&self) -> terraglue_subsystem::Result<FmuFactory> {
        let missing =
            "this program makes no subsystems of FMUs; build the testbed with `terraglue::library()`";
        self.fmus.ok_or_else(|| terraglue_subsystem::Error::Refused(missing.into()))
    }

    /// The same with a module linked into the program; it hides files of its name.
    pub fn with<M: Module>(mut self) -> Self {
        self.builtins.push(LoadedModule::builtin::<M>());
        self
    }

    /// The module that a scenario names. A value with `/` or ending in `.so` or `.py` is a path relative to `folder`, the
    /// scenario's; any other is a name: soil-bekker is the file libsoil_bekker_plugin.so on the search path.
    ///
    /// # Errors
    /// [`LoadError`]: no module of this name on the search path, or a file that cannot be loaded.
    pub fn find(
        &self,
        name: &str,
        search: &SearchPath,
        folder: &Path,
    ) -> std::result::Result<LoadedModule, LoadError> {
        if is_path(name) {
            return LoadedModule::load(&below(folder, name));
        }
        if let Some(module) = self.builtins.iter().find(|m| m.schema.name == name) {
            return Ok(module.clone());
        }
        match search.locate(name) {
            Some(path) => LoadedModule::load(&path),
            None => Err(self.unknown(name, search)),
        }
    }

    #[cold]
    fn unknown(&self, name: &str, search: &SearchPath) -> LoadError {
        let found = search.all().into_iter().map(|(n, _)| n);
        let names = self.builtins.iter().map(|m| m.schema.name.clone()).chain(found);
        LoadError::Unknown {
            name: name.into(),
            file: format!("{} or {}", file_name(name), python_name(name)),
            looked: search.folders().to_vec(),
            nearest: search::nearest(name, names),
        }
    }
}

/// A module on the search path.
#[derive(Debug)]
pub struct AvailableModule {
    /// Name by its file.
    pub name: String,
    /// File.
    pub path: PathBuf,
    /// Name, kind, help and parameters, or why the file cannot be used.
    pub schema: std::result::Result<Schema, LoadError>,
}

/// A file of a module, as far as it can be described without running it.
#[derive(Debug)]
pub struct ListedModule {
    /// Name by its file.
    pub name: String,
    /// File.
    pub path: PathBuf,
    /// Description in its section; None: it has none.
    pub description: Option<Description>,
    /// Why it would be refused; None: it can be loaded, as far as its bytes say.
    pub refused: Option<LoadError>,
    /// The file of the same name that is found before it.
    pub hidden_by: Option<PathBuf>,
}

/// All files of modules on the search path, by name. No code of them runs.
pub fn listed_modules(search: &SearchPath) -> Vec<ListedModule> {
    let every = search.every();
    let first = |name: &str| every.iter().find(|(n, _)| n == name).map(|(_, path)| path.clone());
    let listed = |(name, path): &(String, PathBuf)| ListedModule {
        name: name.clone(),
        path: path.clone(),
        description: described(path),
        refused: inspect(path).err(),
        hidden_by: first(name).filter(|f| f != path),
    };
    every.iter().map(listed).collect()
}

/// The file of a module by its path, wherever it lies. No code of it runs.
///
/// # Errors
/// There is no such file.
pub fn listed_file(path: &Path) -> std::result::Result<ListedModule, LoadError> {
    if !path.is_file() {
        return Err(LoadError::MissingFile { path: path.to_path_buf() });
    }
    let file = path.file_name().and_then(|f| f.to_str()).unwrap_or_default();
    let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or_default().replace('_', "-");
    Ok(ListedModule {
        name: module_name(file).unwrap_or(stem),
        path: path.to_path_buf(),
        description: described(path),
        refused: inspect(path).err(),
        hidden_by: None,
    })
}

/// Description of a file, without running it.
pub fn described(path: &Path) -> Option<Description> {
    if python::is_python(path) {
        return PythonFile::read(path).ok().map(|f| f.description);
    }
    Description::read(path)
}

/// All modules on the search path, by name. Each is loaded to ask for its schema.
pub fn available_modules(search: &SearchPath) -> Vec<AvailableModule> {
    let module = |(name, path): (String, PathBuf)| {
        let schema = LoadedModule::load(&path).map(|m| m.schema().clone());
        AvailableModule { name, path, schema }
    };
    search.all().into_iter().map(module).collect()
}
