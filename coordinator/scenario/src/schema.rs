//! The JSON Schema of a scenario file, for editors; made from [`super::keys`].

use super::keys::{Form, Key, Table, subsystem_keys, tables};
use serde_json::{Map, Value, json};
use terraglue_subsystem::{Parameter, ParameterType};

/// The schema as text, ending with a newline.
pub fn text() -> String {
    let mut text = serde_json::to_string_pretty(&schema()).unwrap_or_default();
    text.push('\n');
    text
}

/// The schema.
pub fn schema() -> Value {
    let all = tables();
    let properties: Map<String, Value> = all.iter().map(|t| (t.name.to_owned(), table(t))).collect();
    let required: Vec<&str> = all.iter().filter(|t| t.required).map(|t| t.name).collect();
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Terraglue scenario",
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": subsystem(),
    })
}

fn table(table: &Table) -> Value {
    let body = object(&table.keys, false);
    match table.repeated {
        true => json!({ "description": table.help, "type": "array", "items": body }),
        false => {
            let mut body = body;
            body["description"] = table.help.into();
            body
        }
    }
}

fn subsystem() -> Value {
    let mut body = object(&subsystem_keys(), true);
    body["description"] =
        "A subsystem; other keys are parameters of its module (see `terraglue modules`).".into();
    body
}

fn object(keys: &[Key], open: bool) -> Value {
    let properties: Map<String, Value> = keys.iter().map(|k| (k.parameter.name.clone(), value(k))).collect();
    let needed = |k: &&Key| k.parameter.default.is_null() && !k.parameter.optional && k.only.is_empty();
    let required: Vec<&str> = keys.iter().filter(needed).map(|k| k.parameter.name.as_str()).collect();
    json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": open })
}

fn value(key: &Key) -> Value {
    let p = &key.parameter;
    let mut schema = match key.form {
        Form::Texts => {
            json!({ "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }] })
        }
        Form::Assignments | Form::Map | Form::Vary => json!({ "type": "object", "minProperties": 1 }),
        Form::Count(n) => {
            json!({ "type": "array", "items": number(p, "number"), "minItems": n, "maxItems": n })
        }
        Form::Plain => plain(p),
    };
    let unit = if p.unit.is_empty() { String::new() } else { format!(" ({})", p.unit) };
    let only = if key.only.is_empty() { String::new() } else { format!(" [kind {}]", key.only.join(", ")) };
    schema["description"] = format!("{}{unit}{only}", p.help).into();
    if !p.default.is_null() {
        schema["default"] = p.default.clone();
    }
    schema
}

fn plain(p: &Parameter) -> Value {
    match p.parameter_type {
        ParameterType::Number => number(p, "number"),
        ParameterType::Integer => number(p, "integer"),
        ParameterType::Bool => json!({ "type": "boolean" }),
        ParameterType::Text if !p.choices.is_empty() => json!({ "enum": p.choices }),
        ParameterType::Text | ParameterType::Path => json!({ "type": "string" }),
        ParameterType::Numbers => json!({ "type": "array", "items": number(p, "number") }),
        ParameterType::NumberTable => {
            json!({ "type": "object", "additionalProperties": number(p, "number") })
        }
        ParameterType::NumberByName => either(number(p, "number")),
        ParameterType::TextByName if !p.choices.is_empty() => either(json!({ "enum": p.choices })),
        ParameterType::TextByName => either(json!({ "type": "string" })),
        ParameterType::Tables => json!({ "type": "array", "items": { "type": "object" } }),
    }
}

/// One value, or a table of them by name.
fn either(one: Value) -> Value {
    json!({ "anyOf": [one, { "type": "object", "additionalProperties": one }] })
}

fn number(p: &Parameter, kind: &str) -> Value {
    let mut schema = json!({ "type": kind });
    if let Some(min) = p.min {
        schema[if p.above_min { "exclusiveMinimum" } else { "minimum" }] = min.into();
    }
    if let Some(max) = p.max {
        schema["maximum"] = max.into();
    }
    schema
}
