//! `terraglue modules` and `variables`: what there is to choose from.

use super::arguments::VariablesArguments;
use super::output::outln;
use super::testbed::build;
use super::{Exit, show};
use std::path::{Path, PathBuf};
use terraglue_conformance::{LastCheck, last_check};
use terraglue_diagnostics::Result;
use terraglue_engine::signals::pattern;
use terraglue_engine::testbed::Options;
use terraglue_host::{
    AvailableModule, ListedModule, LoadError, LoadedModule, SearchPath, available_modules, described,
    is_path, listed_file, listed_modules,
};
use terraglue_scenario::{InputError, Scenario, allowed_values, did_you_mean};
use terraglue_subsystem::{Causality, Effect, Schema, ValueType, Variable};

/// Variables and actions of the scenario's subsystems, all or those that are asked for.
pub fn variables(arguments: &VariablesArguments) -> Result<Exit> {
    let of = &arguments.scenario;
    let scenario = Scenario::load(&of.scenario, &of.sets)?;
    let options = Options { module_paths: of.module_path.clone(), ..Options::default() };
    let testbed = build(&scenario, &options)?;
    let (mut variables, mut actions) = (Vec::new(), Vec::new());
    testbed.view(|view| {
        for s in view.subsystems {
            variables.extend(s.instance.variables().iter().map(|v| variable_row(s.name, v)));
            actions.extend(
                s.instance.actions().iter().map(|a| [format!("{}.{}", s.name, a.name), a.help.clone()]),
            );
        }
    });
    if let Some(pattern) = &arguments.pattern {
        let names = variables.iter().map(|v| &v[0]).chain(actions.iter().map(|a| &a[0]));
        let names: Vec<String> = names.cloned().collect();
        variables.retain(|row| fits(pattern, &row[0]));
        actions.retain(|row| fits(pattern, &row[0]));
        if variables.is_empty() && actions.is_empty() {
            let help = did_you_mean(pattern, names.iter().map(String::as_str));
            return Err(InputError::plain(format!("no variable or action matches `{pattern}`"), help).into());
        }
    }
    if arguments.json {
        outln!("{}", json(&variables, &actions));
    } else {
        columns(&["variable", "type", "unit", "role", "change", "range", "help"], variables);
        columns(&["action", "help"], actions);
    }
    Ok(Exit::Done)
}

/// Whether a name is one of those that a pattern, or a piece of a name, asks for.
pub fn fits(pattern: &str, name: &str) -> bool {
    match pattern.contains('*') {
        true => pattern::matches(pattern, name),
        false => name.to_lowercase().contains(&pattern.to_lowercase()),
    }
}

/// Rows under their heads, without lines between them; nothing where there are none.
fn columns<const N: usize>(heads: &[&str; N], rows: Vec<[String; N]>) {
    if rows.is_empty() {
        return;
    }
    let mut table = show::plain(show::table(heads));
    rows.into_iter().for_each(|row| {
        table.add_row(row);
    });
    outln!("{}", table.trim_fmt());
}

fn json(variables: &[[String; 7]], actions: &[[String; 2]]) -> serde_json::Value {
    let variable = |[name, kind, unit, role, change, range, help]: &[String; 7]| {
        serde_json::json!({ "name": name, "type": kind, "unit": unit, "role": role, "change": change,
            "range": range, "help": help })
    };
    let action = |[name, help]: &[String; 2]| serde_json::json!({ "name": name, "help": help });
    serde_json::json!({ "variables": variables.iter().map(variable).collect::<Vec<_>>(),
        "actions": actions.iter().map(action).collect::<Vec<_>>() })
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

/// The modules on the search path, one with its parameters, or those whose names fit a pattern. `asked` loads them to ask
/// for their parameters, in this process.
pub fn modules(name: Option<&str>, module_path: &[PathBuf], json: bool, asked: bool) -> Result<Exit> {
    let search = SearchPath::standard(module_path, Path::new("."));
    let whole =
        name.is_some_and(|name| is_path(name) || listed_modules(&search).iter().any(|m| m.name == name));
    if !json && !asked {
        return match name {
            Some(name) if whole => shown(name, &search, module_path),
            part => listing(part, &search),
        };
    }
    let mut found = match name {
        Some(path) if is_path(path) => vec![available(listed_file(Path::new(path)).map_err(wrong)?)],
        _ => available_modules(&search),
    };
    found.retain(|m| name.is_none_or(|n| is_path(n) || if whole { n == m.name } else { fits(n, &m.name) }));
    if let (Some(name), true) = (name, found.is_empty()) {
        return Err(unknown(name, &search));
    }
    if json {
        let describe = |m: &AvailableModule| match &m.schema {
            Ok(schema) => {
                let check = last_check(&m.path);
                let section = described(&m.path);
                serde_json::json!({ "name": m.name, "path": m.path, "schema": schema, "description": section,
                    "last_check": check })
            }
            Err(e) => serde_json::json!({ "name": m.name, "path": m.path, "error": e.to_string() }),
        };
        outln!("{}", serde_json::Value::Array(found.iter().map(describe).collect()));
        return Ok(Exit::Done);
    }
    for module in &found {
        match &module.schema {
            Err(e) => outln!("{}: cannot be used: {e}\n", module.name),
            Ok(schema) => describe(schema),
        }
    }
    Ok(Exit::Done)
}

fn wrong(error: LoadError) -> terraglue_diagnostics::Error {
    InputError::plain(error.to_string(), None).into()
}

/// A file with its parameters; it is loaded.
fn available(file: ListedModule) -> AvailableModule {
    let schema = LoadedModule::load(&file.path).map(|m| m.schema().clone());
    AvailableModule { name: file.name, path: file.path, schema }
}

/// Says the nearest name, and where none is near every folder that was searched.
fn unknown(name: &str, search: &SearchPath) -> terraglue_diagnostics::Error {
    let names: Vec<String> =
        listed_modules(search).into_iter().filter(|m| m.hidden_by.is_none()).map(|m| m.name).collect();
    if let Some(near) = did_you_mean(name, names.iter().map(String::as_str)) {
        return InputError::plain(format!("no module matches `{name}`"), Some(near)).into();
    }
    let unknown = terraglue_fmu::library().find(name, search, Path::new("."));
    let told = unknown.err().map_or_else(|| format!("no module matches `{name}`"), |e| e.to_string());
    InputError::plain(told, Some("`terraglue modules` lists those that are found".into())).into()
}

/// Shows the description in the section of one module, in this process; its parameters, which only its code knows, come
/// from another one.
fn shown(name: &str, search: &SearchPath, module_path: &[PathBuf]) -> Result<Exit> {
    let m = match is_path(name) {
        true => listed_file(Path::new(name)).map_err(wrong)?,
        false => {
            let mut found = listed_modules(search).into_iter();
            let found = found.find(|m| m.name == name && m.hidden_by.is_none());
            found.ok_or_else(|| unknown(name, search))?
        }
    };
    let d = m.description.clone().unwrap_or_default();
    let kind = if d.kind.is_empty() { "kind unknown".into() } else { d.kind.clone() };
    outln!("{} ({kind})\n{}", m.name, m.path.display());
    let facts = [("version", &d.version), ("ABI", &d.abi), ("licence", &d.license), ("authors", &d.authors)];
    for (what, text) in facts.iter().filter(|(_, text)| !text.is_empty()) {
        outln!("{what}: {text}");
    }
    match last_check(&m.path) {
        None => outln!("not checked since it was built: terraglue check-module {}", m.path.display()),
        Some(last) => outln!("last check: {}; {}", last.words(), told(&last)),
    }
    if let Some(can) = &d.can {
        outln!("can: {}", can.join(", "));
    }
    if !d.variables.is_empty() {
        let mut table = show::table(&["variable", "role", "type", "unit"]);
        for line in &d.variables {
            let mut cells = line.splitn(4, ' ');
            table.add_row([(); 4].map(|()| cells.next().unwrap_or_default().replace(" | ", " or ")));
        }
        outln!("{table}");
    }
    if let Some(why) = &m.refused {
        // a file that was named is to be one; of a module that is found it is a fact like others
        if is_path(name) {
            return Err(InputError::plain(why.to_string(), None).into());
        }
        outln!("cannot be used: {why}");
        return Ok(Exit::Done);
    }
    parameters(name, module_path);
    Ok(Exit::Done)
}

/// Lets another process load a module and show its parameters; reports how that process ended.
fn parameters(name: &str, module_path: &[PathBuf]) {
    let mut command = std::process::Command::new("/proc/self/exe");
    command.args(["modules", name, "--asked"]).stdin(std::process::Stdio::null());
    for path in module_path {
        command.arg("--module-path").arg(path);
    }
    match command.output() {
        Ok(done) if done.status.success() => outln!("{}", String::from_utf8_lossy(&done.stdout).trim_end()),
        Ok(done) => {
            let how = terraglue_host::isolation::last_words(done.status);
            outln!("its parameters cannot be asked for: {how}");
        }
        Err(e) => outln!("its parameters cannot be asked for: {e}"),
    }
}

/// One line per file, all or those whose names fit, from the section of the library: no code of it runs.
fn listing(part: Option<&str>, search: &SearchPath) -> Result<Exit> {
    let heads = ["module", "kind", "version", "ABI", "licence", "file", "last check", ""];
    let mut table = show::listing(&heads);
    let mut found = listed_modules(search);
    if let Some(part) = part {
        found.retain(|m| fits(part, &m.name));
        if found.is_empty() {
            return Err(unknown(part, search));
        }
    }
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
        let d = described;
        table.add_row([name, d.kind, d.version, d.abi, d.license, file, check, note]);
    }
    if found.is_empty() {
        let folders: Vec<_> = search.folders().iter().map(|f| format!("\n  {}", f.display())).collect();
        outln!(
            "no module found in:{}\n`cargo build` makes those of the project beside the program, `cargo xtask install PREFIX` \
             installs them with it; --module-path DIR or TERRAGLUE_MODULE_PATH adds a folder",
            folders.concat()
        );
    } else {
        outln!("{}\n`terraglue modules NAME` shows what a module takes.", table.trim_fmt());
    }
    Ok(Exit::Done)
}

/// Result of a check, with its seed and the version of the program.
fn told(last: &LastCheck) -> String {
    format!("{} (seed {}, terraglue {})", last.summary, last.seed, last.version)
}

fn describe(schema: &Schema) {
    outln!("{}", schema.help);
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
