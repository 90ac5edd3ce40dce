//! `terraglue modules` and `variables`: what there is to choose from.

use super::arguments::ScenarioArguments;
use super::output::outln;
use super::run::build;
use super::{Exit, show};
use std::path::{Path, PathBuf};
use terraglue::Result;
use terraglue::check_module::{LastCheck, last_check};
use terraglue::host::{AvailableModule, Library, SearchPath, available_modules, listed_modules};
use terraglue::scenario::{InputError, Scenario, allowed_values};
use terraglue::subsystem::{Causality, Effect, Kind, Schema, ValueType, Variable};
use terraglue::testbed::Options;

/// Every variable and action of the scenario's subsystems.
pub fn variables(arguments: &ScenarioArguments) -> Result<Exit> {
    let scenario = Scenario::load(&arguments.scenario, &arguments.sets)?;
    let options = Options { module_paths: arguments.module_path.clone(), ..Options::default() };
    let testbed = build(&scenario, &options)?;
    let mut table = show::table(&["variable", "type", "unit", "role", "change", "range", "help"]);
    let mut actions = show::table(&["action", "help"]);
    testbed.view(|view| {
        for s in view.subsystems {
            for v in s.instance.variables() {
                table.add_row(variable_row(s.name, v));
            }
            for a in s.instance.actions() {
                actions.add_row([format!("{}.{}", s.name, a.name), a.help.clone()]);
            }
        }
    });
    outln!("{table}");
    if actions.row_count() > 0 {
        outln!("{actions}");
    }
    Ok(Exit::Done)
}

fn variable_row(subsystem: &str, v: &Variable) -> [String; 7] {
    let role = match v.causality {
        Causality::Parameter => "parameter",
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Local => "local",
    };
    let change = match v.effect {
        Effect::Live => "at any time",
        Effect::NeedsReset => "before the start",
        Effect::ReadOnly => "never",
    };
    let name = format!("{subsystem}.{}", v.name);
    [name, type_name(v), v.unit.clone(), role.into(), change.into(), range(v), v.help.clone()]
}

fn type_name(v: &Variable) -> String {
    let base = match v.value_type {
        ValueType::Enumeration => v.enumeration.join(" | "),
        other => format!("{other:?}").to_lowercase(),
    };
    let dims: String = v.dims.iter().map(|d| format!("[{d}]")).collect();
    base + &dims
}

fn range(v: &Variable) -> String {
    match (v.min.is_finite(), v.max.is_finite()) {
        (true, true) => format!("{} … {}", v.min, v.max),
        (true, false) => format!("≥ {}", v.min),
        (false, true) => format!("≤ {}", v.max),
        (false, false) => String::new(),
    }
}

/// The modules on the search path.
pub fn modules(name: Option<&str>, module_path: &[PathBuf], json: bool) -> Result<Exit> {
    let search = SearchPath::standard(module_path, Path::new("."));
    if name.is_none() && !json {
        return Ok(listing(&search));
    }
    let mut found = available_modules(&search);
    found.retain(|m| name.is_none_or(|n| n == m.name));
    if let (Some(name), true) = (name, found.is_empty()) {
        // Says every folder that was searched, and the nearest name.
        let unknown = Library::new().find(name, &search, Path::new("."));
        let told = unknown.err().map_or_else(|| format!("no module `{name}`"), |e| e.to_string());
        return Err(InputError::plain(told, None).into());
    }
    if json {
        let describe = |m: &AvailableModule| match &m.schema {
            Ok(schema) => {
                let check = last_check(&m.path);
                serde_json::json!({ "name": m.name, "path": m.path, "schema": schema, "last_check": check })
            }
            Err(e) => serde_json::json!({ "name": m.name, "path": m.path, "error": e.to_string() }),
        };
        outln!("{}", serde_json::Value::Array(found.iter().map(describe).collect()));
        return Ok(Exit::Done);
    }
    for module in &found {
        match &module.schema {
            Err(e) => outln!("{}: cannot be used: {e}\n", module.name),
            Ok(schema) => describe(module, schema),
        }
    }
    Ok(Exit::Done)
}

/// One line per file, from the section of the library: no code of it runs.
fn listing(search: &SearchPath) -> Exit {
    let mut table = show::table(&["module", "version", "ABI", "licence", "file", "last check", ""]);
    let found = listed_modules(search);
    for m in &found {
        let described = m.description.clone().unwrap_or_default();
        let note = match (&m.refused, &m.hidden_by) {
            (Some(why), _) => format!("refused: {why}"),
            (None, Some(by)) => format!("hidden by {}", by.display()),
            (None, None) if m.description.is_none() => "does not describe itself".into(),
            (None, None) => String::new(),
        };
        let file = m.path.display().to_string();
        let check = last_check(&m.path).map_or_else(|| "–".to_owned(), |last| last.words());
        let name = m.name.clone();
        table.add_row([name, described.version, described.abi, described.license, file, check, note]);
    }
    if found.is_empty() {
        outln!("no module found; see --module-path");
    } else {
        outln!("{table}\n`terraglue modules NAME` shows what a module takes.");
    }
    Exit::Done
}

/// What a check said, and with which version of the program.
fn told(last: &LastCheck) -> String {
    format!("{} (seed {}, terraglue {})", last.summary, last.seed, last.version)
}

fn describe(module: &AvailableModule, schema: &Schema) {
    let kind = match schema.kind {
        Kind::Soil => "soil",
        Kind::Robot => "robot",
        Kind::Controller => "controller",
        Kind::Law => "law",
    };
    outln!("{} ({kind}): {}\n{}", schema.name, schema.help, module.path.display());
    match last_check(&module.path) {
        None => outln!("not checked since it was built: terraglue check-module {}", module.path.display()),
        Some(last) => outln!("last check: {}; {}", last.words(), told(&last)),
    }
    let mut table = show::table(&["parameter", "takes", "default", "help"]);
    for p in &schema.parameters {
        let default = match (&p.default, p.optional) {
            (serde_json::Value::Null, true) => "–".to_owned(),
            (serde_json::Value::Null, false) => "required".to_owned(),
            (value, _) => value.to_string(),
        };
        table.add_row([p.name.clone(), allowed_values(p), default, p.help.clone()]);
    }
    outln!("{table}\n");
}
