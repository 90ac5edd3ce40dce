//! Origin of a run: its scenario, files and modules. Only with the same origin a run resumes to the same bytes.

use std::path::{Path, PathBuf};
use terraglue_diagnostics::fingerprint;
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::testbed::{Options, find};
use terraglue_host::{SearchPath, described, law};
use terraglue_recording::fingerprints;
use terraglue_scenario::{InputError, Scenario, SubsystemSpec};
use terraglue_subsystem::persist;

/// Scenario, files and modules of a run.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Origin {
    program: String,
    /// The scenario's file; relative paths refer to its folder.
    path: String,
    /// Its text after all edits.
    text: String,
    module_paths: Vec<String>,
    /// Fingerprints of what the scenario names.
    inputs: Vec<String>,
    modules: Vec<Part>,
}
persist!(Origin { program, path, text, module_paths, inputs, modules });

/// A module, or the law of a soil.
#[derive(Clone, Debug, PartialEq)]
struct Part {
    /// `soil (soil-bekker)`.
    name: String,
    version: String,
    /// Of its file; 0: linked into the program.
    fingerprint: u64,
}
persist!(Part { name, version, fingerprint });

fn refused(message: String, help: &str) -> Error {
    InputError::plain(message, Some(help.into())).into()
}

/// A path that means the same in every folder.
fn lasting(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).to_string_lossy().into_owned()
}

impl Origin {
    /// Of a scenario as it is now.
    pub fn of(scenario: &Scenario, options: &Options) -> Result<Self> {
        Ok(Self {
            program: crate::VERSION.into(),
            path: lasting(Path::new(&scenario.source.path)),
            text: scenario.source.text.clone(),
            module_paths: options.module_paths.iter().map(|p| lasting(p)).collect(),
            inputs: fingerprints(scenario).lines().map(str::to_owned).collect(),
            modules: parts(scenario, options)?,
        })
    }

    pub fn scenario(&self) -> Result<Scenario> {
        Ok(Scenario::again(Path::new(&self.path), &self.text)?)
    }

    pub fn module_paths(&self) -> Vec<PathBuf> {
        self.module_paths.iter().map(PathBuf::from).collect()
    }

    pub fn check(&self, scenario: &Scenario, options: &Options) -> Result {
        let now = Self::of(scenario, options)?;
        if self.program != now.program {
            let message =
                format!("the checkpoint is of terraglue {}, this is terraglue {}", self.program, now.program);
            return Err(refused(message, "go on with the version that began the run, or start it anew"));
        }
        self.check_inputs(&now)?;
        for (was, is) in self.modules.iter().zip(&now.modules) {
            was.check(is)?;
        }
        Ok(())
    }

    /// Refuses another scenario, after all edits.
    pub fn check_scenario(&self, now: &Self) -> Result {
        let differs = match terraglue_scenario::differences(&self.text, &now.text) {
            Some(all) if all.is_empty() => return Ok(()),
            all => all.and_then(|all| all.first().map(|one| format!(": {one}"))).unwrap_or_default(),
        };
        let message = format!("the state is one of another scenario{differs}");
        Err(refused(message, "build the testbed of the same scenario, with the same edits and the same seed"))
    }

    fn check_inputs(&self, now: &Self) -> Result {
        let key = |line: &String| line.rsplit_once(' ').map_or(line.clone(), |(key, _)| key.to_owned());
        let only = |a: &[String], b: &[String]| a.iter().find(|line| !b.contains(line)).map(key);
        let changed = only(&self.inputs, &now.inputs).or_else(|| only(&now.inputs, &self.inputs));
        let Some(changed) = changed else { return Ok(()) };
        let message = format!("what `{changed}` of `{}` names has changed since the checkpoint", self.path);
        Err(refused(message, "put it back as it was, or start the run anew"))
    }
}

impl Part {
    /// By what lies in a file.
    fn of(name: String, file: Option<&Path>) -> Self {
        let bytes = file.and_then(|file| terraglue_subsystem::files::read(file).ok());
        let version = file.and_then(described).map(|d| d.version).unwrap_or_default();
        Self { name, version, fingerprint: bytes.map_or(0, |bytes| fingerprint(&bytes)) }
    }

    fn check(&self, now: &Self) -> Result {
        if self.version != now.version {
            let message = format!(
                "{} was version {} at the checkpoint and is version {} now",
                self.name, self.version, now.version
            );
            return Err(refused(message, "go on with the version that began the run, or start it anew"));
        }
        if self.fingerprint != now.fingerprint {
            log::warn!(
                "{} is another file of the same version than at the checkpoint: what follows may differ from a run without a break",
                self.name
            );
        }
        Ok(())
    }
}

/// All modules, FMUs and laws of a scenario.
fn parts(scenario: &Scenario, options: &Options) -> Result<Vec<Part>> {
    let library = terraglue_fmu::library();
    let search = SearchPath::standard(&options.module_paths, &scenario.folder);
    let mut all = Vec::new();
    for spec in &scenario.subsystems {
        let name = format!("`{}` ({})", spec.name, spec.module);
        if spec.is_fmu() {
            all.push(Part::of(name, Some(&scenario.folder.join(&spec.module))));
            continue;
        }
        all.push(Part::of(name, find(scenario, spec, options, &library)?.path()));
        all.extend(law_of(spec, &search, scenario));
    }
    Ok(all)
}

/// The law of a soil that is a module of its own.
fn law_of(spec: &SubsystemSpec, search: &SearchPath, scenario: &Scenario) -> Option<Part> {
    let name = spec.parameters.get("law")?.get("plugin")?.as_str()?;
    let file = law::locate(name, search, &scenario.folder).ok()?;
    Some(Part::of(format!("the law `{name}` of `{}`", spec.name), Some(&file)))
}
