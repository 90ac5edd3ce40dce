//! `terraglue fmu info`: the description of an FMU, as tables or as JSON. None of its code runs.

use super::Exit;
use super::output::outln;
use super::show::{plain, table};
use serde_json::{Map, Value, json};
use std::path::Path;
use terraglue_diagnostics::Result;
use terraglue_fmi::Fmu;
use terraglue_fmi::overview::{Fact, Overview};

/// Facts of the head that the first line has, or that are not worth one.
const SAID: [&str; 4] = ["modelName", "fmiVersion", "variableNamingConvention", "numberOfEventIndicators"];

/// Shows an FMU.
///
/// # Errors
/// The file is no FMU.
pub fn info(
    fmu: &Path,
    as_json: bool,
    wrong: impl Fn(terraglue_fmi::Error) -> terraglue_diagnostics::Error,
) -> Result<Exit> {
    let overview = Overview::read(fmu).map_err(wrong)?;
    // why it is not run here, if so
    let refused = Fmu::inspect(fmu).err().map(|e| e.to_string());
    if as_json {
        outln!(
            "{}",
            serde_json::to_string_pretty(&as_value(&overview, refused.as_deref())).unwrap_or_default()
        );
        return Ok(Exit::Done);
    }
    let kinds: Vec<&str> = overview.interfaces.iter().map(|(kind, _)| kind.as_str()).collect();
    outln!(
        "{}: `{}`, FMI {}, {}",
        fmu.display(),
        overview.fact("modelName"),
        overview.fact("fmiVersion"),
        kinds.join(", ")
    );
    if let Some(why) = &refused {
        outln!("not run here: {why}");
    }
    head(&overview);
    variables(&overview);
    Ok(Exit::Done)
}

/// Facts as `name = text`.
fn listed(facts: &[Fact]) -> String {
    facts.iter().map(|(name, text)| format!("{name} = {text}")).collect::<Vec<_>>().join(", ")
}

fn head(overview: &Overview) {
    let mut rows = plain(table(&[]));
    let mut row = |name: &str, text: String| {
        if !text.is_empty() {
            rows.add_row([name.to_owned(), text]);
        }
    };
    for (name, text) in overview.facts.iter().filter(|(name, _)| !SAID.contains(&name.as_str())) {
        row(name, text.clone());
    }
    let platforms =
        if overview.platforms.is_empty() { "none".to_owned() } else { overview.platforms.join(", ") };
    row("platforms", platforms);
    row("default experiment", listed(&overview.experiment));
    for (kind, facts) in &overview.interfaces {
        row(kind, listed(facts));
    }
    row(
        "log categories",
        overview.log_categories.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", "),
    );
    for [name, version, about] in &overview.standards {
        row("layered standard", format!("{name} {version} {about}").trim().to_owned());
    }
    for (name, kind) in &overview.terminals {
        row("terminal", format!("{name} {kind}").trim().to_owned());
    }
    outln!("{rows}");
}

fn variables(overview: &Overview) {
    let mut rows =
        table(&["variable", "reference", "type", "causality", "variability", "unit", "start", "description"]);
    for v in &overview.variables {
        rows.add_row([
            &v.name,
            &v.reference,
            &v.value_type,
            &v.causality,
            &v.variability,
            &v.unit,
            &v.start,
            &v.description,
        ]);
    }
    if !overview.variables.is_empty() {
        outln!("{rows}");
    }
}

fn object(facts: &[Fact]) -> Value {
    Value::Object(facts.iter().map(|(name, text)| (name.clone(), json!(text))).collect::<Map<_, _>>())
}

fn as_value(overview: &Overview, refused: Option<&str>) -> Value {
    let interfaces: Vec<Value> = overview
        .interfaces
        .iter()
        .map(|(kind, facts)| json!({ "kind": kind, "attributes": object(facts) }))
        .collect();
    let variables: Vec<Value> = overview
        .variables
        .iter()
        .map(|v| {
            json!({
                "name": v.name, "reference": v.reference, "type": v.value_type, "causality": v.causality,
                "variability": v.variability, "initial": v.initial, "unit": v.unit, "start": v.start, "description": v.description,
            })
        })
        .collect();
    let standards: Vec<Value> = overview
        .standards
        .iter()
        .map(|[name, version, about]| json!({ "name": name, "version": version, "description": about }))
        .collect();
    json!({
        "attributes": object(&overview.facts),
        "interfaces": interfaces,
        "default_experiment": object(&overview.experiment),
        "platforms": overview.platforms,
        "log_categories": object(&overview.log_categories),
        "terminals": object(&overview.terminals),
        "layered_standards": standards,
        "variables": variables,
        "not_run_because": refused,
    })
}
