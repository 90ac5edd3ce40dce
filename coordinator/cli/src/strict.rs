//! `--strict` of `run` and `check`: sets the parameter `strict` of every module that has one, and of every FMU.

use super::scenario_arguments::ScenarioArguments;
use terraglue_diagnostics::Result;
use terraglue_host::SearchPath;
use terraglue_scenario::Scenario;

/// Loads the scenario with its edits, and with `strict = true` where that is wanted and known.
pub fn load(arguments: &ScenarioArguments, sets: &[(String, String)], strict: bool) -> Result<Scenario> {
    // edits beyond those of --set are that of --duration, then those that are made here
    let mut options = vec!["--set"; arguments.sets.len()];
    options.resize(sets.len(), "--duration");
    let scenario = Scenario::load_by(&arguments.scenario, sets, &options)?;
    if !strict {
        return Ok(scenario);
    }
    let search = SearchPath::standard(&arguments.module_path, &scenario.folder);
    let library = terraglue_fmu::library();
    let knows = |module: &str| {
        let found = library.find(module, &search, &scenario.folder);
        found.is_ok_and(|m| m.schema().parameters.iter().any(|p| p.name == "strict"))
    };
    let strict = scenario.subsystems.iter().filter(|s| s.is_fmu() || knows(&s.module));
    let strict = strict.map(|s| (format!("{}.strict", s.name), "true".to_owned()));
    let sets: Vec<_> = sets.iter().cloned().chain(strict).collect();
    options.resize(sets.len(), "--strict");
    Ok(Scenario::load_by(&arguments.scenario, &sets, &options)?)
}
