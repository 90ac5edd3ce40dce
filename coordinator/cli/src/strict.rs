//! `--strict` of `run` and `check`: sets the parameter `strict` of every module that has one.

use super::arguments::ScenarioArguments;
use terraglue_diagnostics::Result;
use terraglue_host::SearchPath;
use terraglue_scenario::Scenario;

/// Loads the scenario with its edits, and with `strict = true` where that is wanted and known.
pub fn load(arguments: &ScenarioArguments, sets: &[(String, String)], strict: bool) -> Result<Scenario> {
    let scenario = Scenario::load(&arguments.scenario, sets)?;
    if !strict {
        return Ok(scenario);
    }
    let search = SearchPath::standard(&arguments.module_path, &scenario.folder);
    let library = terraglue_fmu::library();
    let knows = |module: &str| {
        let found = library.find(module, &search, &scenario.folder);
        found.is_ok_and(|m| m.schema().parameters.iter().any(|p| p.name == "strict"))
    };
    let strict = scenario.subsystems.iter().filter(|s| knows(&s.module));
    let strict = strict.map(|s| (format!("{}.strict", s.name), "true".to_owned()));
    Ok(Scenario::load(&arguments.scenario, &sets.iter().cloned().chain(strict).collect::<Vec<_>>())?)
}
