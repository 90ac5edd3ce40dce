//! `terraglue convert scenario.toml -o system.ssp`: a scenario of FMUs as a system structure.

use super::Exit;
use super::output::outln;
use serde_json::Value;
use std::path::Path;
use terraglue_diagnostics::Result;
use terraglue_fmi::description::Variable;
use terraglue_fmi::export::{Compression, Content, pack};
use terraglue_fmi::ssp::{self, NewComponent, NewConnection};
use terraglue_fmi::{Fmu, ModelDescription};
use terraglue_fmu::{host_keys, start_values};
use terraglue_scenario::{Connection, ConnectionOrder, Extrapolate, InputError, Scenario, SubsystemSpec};
use terraglue_subsystem::ValueType;

/// Writes the archive.
pub fn write(from: &Path, to: &Path) -> Result<Exit> {
    let scenario = Scenario::load(from, &[])?;
    fits(&scenario)?;
    let mut parts = Vec::new();
    let mut entries = Vec::new();
    for spec in &scenario.subsystems {
        let file = scenario.folder.join(&spec.module);
        let (description, _) = Fmu::inspect(&file).map_err(|e| InputError::plain(e.to_string(), None))?;
        let source = format!("resources/{}.fmu", spec.name);
        let values = values(&scenario, spec, &description)?;
        let component =
            NewComponent { name: spec.name.clone(), source: source.clone(), values, ..Default::default() };
        entries.push((source, Content::File(file)));
        parts.push((component, description));
    }
    let connections: Vec<NewConnection> =
        scenario.connections.iter().map(|c| connection(&scenario, c, &mut parts)).collect::<Result<_>>()?;
    let components: Vec<NewComponent> = parts.into_iter().map(|(component, _)| component).collect();
    let tool = format!("Terraglue {}", env!("CARGO_PKG_VERSION"));
    let text = ssp::describe((&scenario.name, &tool), scenario.time.duration_s, &components, &connections);
    entries.insert(0, ("SystemStructure.ssd".to_owned(), Content::Text(text)));
    pack(to, &entries, Compression::Deflate).map_err(|e| InputError::plain(e, None))?;
    notes(&scenario)?;
    outln!("{}: {} FMUs, {} connections", to.display(), components.len(), connections.len());
    Ok(Exit::Done)
}

/// Refuses a scenario that a system structure cannot represent.
fn fits(scenario: &Scenario) -> Result {
    let source = &scenario.source;
    let help = || Some("`terraglue export` makes one FMU of a whole scenario".to_owned());
    if let Some(spec) = scenario.subsystems.iter().find(|s| !s.is_fmu()) {
        let message = format!("`{}` is a module: a system structure holds FMUs only", spec.name);
        return Err(source.error_at_value(&[&spec.name, "module"], message, help()).into());
    }
    let tables = [
        ("glue", scenario.glue.first().map(|g| g.entry)),
        ("event", scenario.events.first().map(|e| e.entry)),
        ("fault", scenario.faults.first().map(|f| f.entry)),
    ];
    for (table, entry) in tables {
        if let Some(entry) = entry {
            let message = format!("`[[{table}]]`: a system structure knows no such thing");
            return Err(source.error_in(entry, &[], message, help()).into());
        }
    }
    Ok(())
}

/// Says what goes no further: how a master runs the system is its own affair.
fn notes(scenario: &Scenario) -> Result {
    eprintln!(
        "note: a system structure names no communication step: {} s is left to the master",
        scenario.time.step_s
    );
    for spec in &scenario.subsystems {
        let mut keys = host_keys(&spec.parameters).map_err(|e| wrong(scenario, spec, e.to_string()))?;
        keys.extend((spec.step_multiple > 1).then(|| "step_multiple".to_owned()));
        keys.extend(spec.isolate.then(|| "isolate".to_owned()));
        for key in keys {
            eprintln!(
                "note: `{key}` of `{}` is left out: the master that runs the system sets it",
                spec.name
            );
        }
    }
    let ordered =
        |c: &&Connection| c.order != ConnectionOrder::Structure || c.extrapolate != Extrapolate::Constant;
    if scenario.connections.iter().any(|c| ordered(&c)) {
        eprintln!("note: `order` and `extrapolate` of connections are left out");
    }
    Ok(())
}

/// An error in the table of an FMU.
fn wrong(scenario: &Scenario, spec: &SubsystemSpec, message: String) -> Box<InputError> {
    scenario.source.error_about(&spec.name, &[&spec.name], message, None)
}

/// Start values of an FMU.
fn values(
    scenario: &Scenario,
    spec: &SubsystemSpec,
    description: &ModelDescription,
) -> Result<Vec<(String, ssp::Value)>> {
    let wrong = |message: String| wrong(scenario, spec, message);
    let all = start_values(&spec.parameters).map_err(|e| wrong(e.to_string()))?;
    let one = |(name, value): (String, Value)| {
        let real = description
            .position(&name)
            .is_some_and(|k| matches!(description.variables[k].value_type, ValueType::F64 | ValueType::F32));
        let converted = match &value {
            Value::Bool(on) => ssp::Value::Boolean(*on),
            Value::String(text) => ssp::Value::Text(text.clone()),
            Value::Number(number) => match number.as_i64().filter(|_| !real) {
                Some(whole) => ssp::Value::Integer(whole),
                None => ssp::Value::Real(number.as_f64().unwrap_or(f64::NAN)),
            },
            _ => return Err(wrong(format!("`{name}` = {value} is no single value")).into()),
        };
        Ok((name, converted))
    };
    all.into_iter().map(one).collect()
}

/// A connection, whose ends become connectors of their components.
fn connection(
    scenario: &Scenario,
    own: &Connection,
    parts: &mut [(NewComponent, ModelDescription)],
) -> Result<NewConnection> {
    let wrong = |key: &str, message: String, help: Option<String>| {
        terraglue_diagnostics::Error::from(scenario.source.error_in(own.entry, &[key], message, help))
    };
    if !own.map.is_empty() {
        return Err(wrong("map", "`map` is not written into system structures".into(), None));
    }
    let mut ends = Vec::new();
    for (key, name, kind) in [("from", &own.from, "output"), ("to", &own.to, "input")] {
        let help =
            || Some("name one variable of one FMU on each side, no pattern and no whole array".to_owned());
        let found = parts.iter_mut().find_map(|(component, description)| {
            let variable = name.strip_prefix(&component.name)?.strip_prefix('.')?;
            let k = description.position(variable)?;
            Some((component, &description.variables[k]))
        });
        let Some((component, variable)) = found else {
            return Err(wrong(key, format!("`{name}` is no variable of an FMU of this scenario"), help()));
        };
        let value_type = value_type(variable).ok_or_else(|| {
            wrong(key, format!("`{name}` is an array or of a type that SSP 1.0 cannot connect"), help())
        })?;
        let connector = (variable.name.clone(), kind, value_type);
        if !component.connectors.contains(&connector) {
            component.connectors.push(connector);
        }
        ends.push([component.name.clone(), variable.name.clone()]);
    }
    let mut ends = ends.into_iter();
    let (from, to) = (ends.next().unwrap_or_default(), ends.next().unwrap_or_default());
    Ok(NewConnection { from, to, affine: (own.factor, own.offset), converts: own.convert })
}

/// The type of a connector; none: that of the variable, as of an enumeration, which the description of the FMU defines.
fn value_type(variable: &Variable) -> Option<Option<&'static str>> {
    if !variable.dimensions.is_empty() {
        return None;
    }
    Some(Some(match variable.value_type {
        ValueType::F64 | ValueType::F32 => "Real",
        ValueType::Bool => "Boolean",
        ValueType::String => "String",
        ValueType::Binary => "Binary",
        ValueType::Enumeration => return Some(None),
        ValueType::Clock => return None,
        _ => "Integer",
    }))
}
