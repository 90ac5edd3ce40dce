//! `terraglue check`: everything that can be checked without running.

use super::arguments::CheckArguments;
use super::output::outln;
use super::testbed::build;
use super::{Exit, show, soil_module, strict};
use terraglue_diagnostics::Result;
use terraglue_engine::testbed::Options;
use terraglue_host::SearchPath;
use terraglue_recording::Recorder;
use terraglue_scenario::{Scenario, SubsystemSpec};

/// Loads the scenario, its modules and files, and resolves all names.
pub fn check(arguments: &CheckArguments) -> Result<Exit> {
    let (arguments, strict) = (&arguments.scenario, arguments.strict);
    let scenario = strict::load(arguments, &arguments.sets, strict)?;
    soil_module::check(&scenario, arguments)?;
    let options = Options { module_paths: arguments.module_path.clone(), ..Options::default() };
    let testbed = build(&scenario, &options)?;
    testbed.view(|view| Recorder::check(view, &scenario))?;
    let mut table = show::table(&["subsystem", "module", "bodies", "variables", "note"]);
    testbed.view(|view| {
        for (s, spec) in view.subsystems.iter().zip(&scenario.subsystems) {
            let [bodies, variables] =
                [s.scene.bodies.len(), s.instance.variables().len()].map(|n| n.to_string());
            table.add_row([s.name, s.module, &bodies, &variables, &note(&scenario, spec, &options)]);
        }
    });
    outln!("{table}");
    outln!(
        "{} is good: {}, {}, {} s in steps of {} s, gluing `{}`",
        arguments.scenario.display(),
        counted(testbed.signals().connections(), "connection"),
        counted(scenario.events.len(), "event"),
        scenario.time.duration_s,
        scenario.time.step_s,
        scenario.gluing.strategy
    );
    Ok(Exit::Done)
}

/// `1 event`, `2 events`.
fn counted(number: usize, what: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {what}{plural}")
}

/// Numbers of the soil row that the module does not take.
fn note(scenario: &Scenario, spec: &SubsystemSpec, options: &Options) -> String {
    let search = SearchPath::standard(&options.module_paths, &scenario.folder);
    let Ok(module) = terraglue_fmu::library().find(&spec.module, &search, &scenario.folder) else {
        return String::new();
    };
    let takes = |name: &str| module.schema().parameters.iter().any(|p| p.name == name);
    let unused: Vec<&str> = spec.offered.keys().map(String::as_str).filter(|name| !takes(name)).collect();
    if unused.is_empty() { String::new() } else { format!("offered, not used: {}", unused.join(", ")) }
}
