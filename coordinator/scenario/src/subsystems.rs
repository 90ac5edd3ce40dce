//! Tables with `module`: subsystems. The host's keys are taken out, the rest are parameters of the module.

use super::isolation::IsolationSpec;
use super::keys::subsystem_keys;
use super::mask;
use super::model::SubsystemSpec;
use super::module_kind::ModuleKind;
use super::node::{Node, Raw, text};
use super::section::check_entry;
use super::soil_row;
use super::source::Source;
use serde_json::{Map, Value};
use terraglue_diagnostics::Complaint;
use terraglue_diagnostics::InputError;
use terraglue_diagnostics::did_you_mean;

/// All subsystems in the order of their names.
pub fn all(source: &Source) -> Result<Vec<SubsystemSpec>, Box<InputError>> {
    let reserved = super::keys::tables();
    let is_subsystem = |(name, node): &&(String, Node)| {
        (node.get("module").is_some() || node.get("fmu").is_some())
            && !reserved.iter().any(|t| t.name == name.as_str())
    };
    let entries = source.root.entries().iter().filter(is_subsystem);
    let mut specs = entries.map(|(name, node)| one(source, name, node)).collect::<Result<Vec<_>, _>>()?;
    if specs.is_empty() {
        let help = Some("a subsystem is a table with `module`, e.g. [soil] module = \"soil-bekker\"".into());
        return Err(source.error_at(0..0, "the scenario has no subsystem", help));
    }
    specs.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(specs)
}

fn one(source: &Source, name: &str, node: &Node) -> Result<SubsystemSpec, Box<InputError>> {
    if name.trim().is_empty() || name.contains(['.', '*']) {
        let message =
            format!("`{name}` is no name for a subsystem: it may not be empty, nor hold `.` or `*`");
        let help =
            "variables are called `subsystem.variable`, and `*` stands for any: write letters, digits and _";
        return Err(source.error(&node.key, message, Some(help.into())));
    }
    let host_keys = subsystem_keys();
    for key in &host_keys {
        if let Some(entry) = node.get(&key.parameter.name) {
            check_entry(source, key, entry)?;
        }
    }
    let module = match (node.get("module"), node.get("fmu")) {
        (None, Some(fmu)) => fmu_path(source, fmu)?,
        (Some(_), Some(fmu)) => {
            let message = format!("`[{name}]` is either a `module` or an `fmu`");
            return Err(source.error(&fmu.key, message, Some("delete one of the two".into())));
        }
        _ => text(node, "module").unwrap_or_default(),
    };
    if module.trim().is_empty() {
        let help = "`terraglue modules` lists those that are found; the path of a file does, too".to_owned();
        return Err(source.error_at_value(
            &[name, "module"],
            format!("`[{name}]` names no module"),
            Some(help),
        ));
    }
    let is_host_key = |key: &str| host_keys.iter().any(|k| k.parameter.name == key);
    Ok(SubsystemSpec {
        name: name.into(),
        step_multiple: node.get("step_multiple").and_then(|n| n.to_json().as_u64()).unwrap_or(1) as u32,
        isolate: node.get("isolate").is_some_and(|n| n.to_json().as_bool() == Some(true)),
        isolation: isolation(node),
        python: text(node, "python"),
        build: text(node, "build"),
        sources: node.get("sources").map(texts).unwrap_or_default(),
        parameters: parameters(node, &module, is_host_key),
        offered: soil_row::offered(source, name, node, &module)?,
        regions: mask::regions(source, name, node, &module)?,
        module,
    })
}

/// How it is kept in a process of its own.
fn isolation(node: &Node) -> IsolationSpec {
    let number =
        |key: &str, otherwise: f64| node.get(key).and_then(|n| n.to_json().as_f64()).unwrap_or(otherwise);
    let usual = IsolationSpec::default();
    IsolationSpec {
        load_timeout_s: number("load_timeout_s", usual.load_timeout_s),
        step_timeout_s: number("step_timeout_s", usual.step_timeout_s),
        memory_bytes: (number("memory_mb", (usual.memory_bytes >> 20) as f64) as u64) << 20,
    }
}

/// A text or a list of texts.
pub(super) fn texts(node: &Node) -> Vec<String> {
    match node.to_json() {
        Value::String(one) => vec![one],
        Value::Array(all) => all.iter().filter_map(|t| t.as_str().map(str::to_owned)).collect(),
        _ => Vec::new(),
    }
}

/// The path of an FMU as it was written; the file must exist and be named `….fmu`.
fn fmu_path(source: &Source, node: &Node) -> Result<String, Box<InputError>> {
    let path = match &node.value {
        Raw::Text(path) if ModuleKind::is_fmu(path) => path.clone(),
        _ => return Err(source.error(&node.at, "`fmu` takes the path of a file `….fmu` in quotes", None)),
    };
    super::section::must_exist(source, &path).map_err(|c| source.error(&node.at, c.message, c.help))?;
    Ok(path)
}

/// The module's parameters; those in the sub-table with the module's name come on top.
fn parameters(node: &Node, module: &str, is_host_key: impl Fn(&str) -> bool) -> Map<String, Value> {
    let entries = node.entries().iter().filter(|(key, _)| !is_host_key(key) && key != module);
    let mut all: Map<String, Value> = entries.map(|(key, n)| (key.clone(), n.to_json())).collect();
    match node.get(module) {
        Some(own) if own.is_table() => merge(&mut all, own),
        Some(other) => drop(all.insert(module.into(), other.to_json())),
        None => {}
    }
    all
}

fn merge(all: &mut Map<String, Value>, own: &Node) {
    for (key, node) in own.entries() {
        match (all.get_mut(key), node.is_table()) {
            (Some(Value::Object(below)), true) => merge(below, node),
            _ => drop(all.insert(key.clone(), node.to_json())),
        }
    }
}

/// Complains when `subsystem.something` names no subsystem of the scenario, or nothing below it.
pub fn check_reference(reference: &str, names: &[&str]) -> Result<(), Complaint> {
    let Some((subsystem, rest)) = reference.split_once('.').filter(|(_, rest)| !rest.is_empty()) else {
        let message = format!("`{reference}` is not of the form `subsystem.name`");
        let subsystem = reference.trim_end_matches('.');
        let help = match names.contains(&subsystem) {
            true => Some(format!(
                "`{subsystem}` is a subsystem: say what of it; `terraglue variables SCENARIO {subsystem}` lists its variables"
            )),
            false => did_you_mean(reference, names.iter().copied()),
        };
        return Err(Complaint { message, help });
    };
    debug_assert!(!rest.is_empty());
    if subsystem.contains('*') || names.contains(&subsystem) {
        return Ok(());
    }
    let message = format!("`{reference}`: there is no subsystem `{subsystem}`");
    Err(Complaint { message, help: did_you_mean(subsystem, names.iter().copied()) })
}
