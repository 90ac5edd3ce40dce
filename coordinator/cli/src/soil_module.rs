//! Checks that a module that replaces a soil is a soil, and that the terrain has one at all.

use super::scenario_arguments::ScenarioArguments;
use std::path::Path;
use terraglue_diagnostics::{Error, Result};
use terraglue_host::{SearchPath, available_modules};
use terraglue_scenario::advice::line_of;
use terraglue_scenario::{InputError, Scenario, SubsystemSpec, nearest};
use terraglue_subsystem::Kind;

/// Refuses edits that put another kind of module in the place of a soil; warns of a terrain without any soil.
pub fn check(scenario: &Scenario, arguments: &ScenarioArguments) -> Result {
    let search = search(scenario, arguments);
    if arguments.sets.iter().any(|(key, _)| key.ends_with(".module")) {
        let others = arguments.sets.iter().filter(|(key, _)| !key.ends_with(".module")).cloned();
        // Where the scenario is only good with the edit, there is nothing to compare it with.
        if let Ok(before) = Scenario::load(&arguments.scenario, &others.collect::<Vec<_>>()) {
            for old in &before.subsystems {
                let new = scenario.subsystems.iter().find(|s| s.name == old.name);
                let was_soil = kind(&old.module, &search, &scenario.folder) == Some(Kind::Soil);
                let found = |module: &str| kind(module, &search, &scenario.folder).is_some();
                if let Some(new) = new.filter(|new| was_soil && found(&new.module)) {
                    require_soil(&new.module, scenario, arguments).map_err(|error| match error {
                        Error::Input(no) => {
                            let InputError { message, help, .. } = *no;
                            scenario.source.error_at_value(&[&new.name, "module"], message, help).into()
                        }
                        other => other,
                    })?;
                }
            }
        }
    }
    let mut kinds = scenario.subsystems.iter().map(|s| kind(&s.module, &search, &scenario.folder));
    // A module that is not found is an error of its own.
    let as_stone = |s: &SubsystemSpec| s.parameters.get("ground").is_some_and(|ground| ground == "terrain");
    if scenario.terrain.is_some()
        && kinds.all(|k| k.is_some_and(|k| k != Kind::Soil))
        && !scenario.subsystems.iter().any(as_stone)
    {
        let message = "the terrain is not used: no subsystem of kind soil";
        log::warn!("{}", line_of(&scenario.source.error_at_value(&["terrain"], message, None)));
    }
    Ok(())
}

/// Refuses a module that is no soil, or is not found at all.
pub fn require_soil(module: &str, scenario: &Scenario, arguments: &ScenarioArguments) -> Result {
    let search = search(scenario, arguments);
    let why = match terraglue_fmu::library().find(module, &search, &scenario.folder) {
        Ok(found) if found.schema().kind == Kind::Soil => return Ok(()),
        Ok(_) => format!("module `{module}` is no soil"),
        Err(error) => error.to_string(),
    };
    let modules = available_modules(&search);
    let soils = modules.iter().filter(|m| m.schema.as_ref().is_ok_and(|s| s.kind == Kind::Soil));
    let names: Vec<&str> = soils.map(|m| m.name.as_str()).collect();
    let near =
        nearest(module, names.iter().copied()).map_or_else(String::new, |n| format!("did you mean `{n}`? "));
    let help = format!("{near}modules of kind soil: {}", names.join(", "));
    Err(InputError::plain(why, Some(help)).into())
}

fn search(scenario: &Scenario, arguments: &ScenarioArguments) -> SearchPath {
    SearchPath::standard(&arguments.module_path, &scenario.folder)
}

fn kind(module: &str, search: &SearchPath, folder: &Path) -> Option<Kind> {
    terraglue_fmu::library().find(module, search, folder).ok().map(|m| m.schema().kind)
}
