//! The testbed of a scenario, as every command makes it.

use super::arguments::RunArguments;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::testbed::{Options, Testbed};
use terraglue_host::ProcessState;
use terraglue_scenario::{InputError, Scenario};
use terraglue_subsystem::Kind;

/// Options of the testbed.
pub fn options(arguments: &RunArguments, cancel: &Arc<AtomicBool>) -> Options {
    options_of(arguments.threads, &arguments.scenario.module_path, cancel)
}

/// The same of threads and folders of modules.
pub fn options_of(threads: usize, module_paths: &[PathBuf], cancel: &Arc<AtomicBool>) -> Options {
    Options {
        threads,
        module_paths: module_paths.to_owned(),
        cancel: Arc::clone(cancel),
        standing: Arc::default(),
    }
}

/// Builds a testbed. Whatever stops it, a module that refuses its files among them, is wrong input.
pub fn build(scenario: &Scenario, options: &Options) -> Result<Testbed> {
    let process_state = ProcessState::now();
    let library = terraglue_fmu::library().with_adviser(Kind::Soil, terraglue_soil_law::advice);
    let built = Testbed::build_with(scenario, options, &library).map_err(|error| match error {
        Error::Input(_) | Error::Module { function: "instantiate", .. } => error,
        other => Error::Input(InputError::plain(other.to_string(), None)),
    });
    set_back(&process_state);
    built
}

/// Tells what had to be set back.
pub fn set_back(process_state: &ProcessState) {
    let changed = process_state.restore();
    if !changed.is_empty() {
        let changed = changed.join(", ");
        log::warn!(
            "a module or FMU changed what all share, {changed}: it is set back; `isolate = true` keeps such a one apart"
        );
    }
}
