//! The variables and actions of a run as clients list them: unit, range, help, and what a write does.

use serde_json::{Value, json};
use terraglue_engine::signals::VariableRef;
use terraglue_engine::testbed::Testbed;
use terraglue_host::Instance;
use terraglue_recording::TopicInfo;
use terraglue_subsystem::{Causality, Effect, ValueType, Variable};

/// Name of the kind of a value, for people and forms.
fn kind(of: ValueType) -> &'static str {
    match of {
        ValueType::F64 | ValueType::F32 => "real",
        ValueType::Bool => "bool",
        ValueType::Enumeration => "enum",
        ValueType::String => "string",
        ValueType::Binary | ValueType::Clock => "binary",
        _ => "int",
    }
}

fn effect(of: Effect) -> &'static str {
    match of {
        Effect::Live => "live",
        Effect::NeedsReset => "needs reset",
        Effect::ReadOnly => "read only",
    }
}

fn causality(of: Causality) -> &'static str {
    match of {
        Causality::Parameter => "parameter",
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Local => "local",
    }
}

fn variable(id: &str, subsystem: &str, v: &Variable, start: &Value) -> Value {
    json!({
        "id": id,
        "subsystem": subsystem,
        "kind": kind(v.value_type),
        "array": !v.dims.is_empty(),
        "choices": v.enumeration,
        "unit": v.unit,
        "help": v.help,
        // JSON has no infinity: no bound is null
        "min": v.min,
        "max": v.max,
        "effect": effect(v.effect),
        "causality": causality(v.causality),
        "start": start,
    })
}

/// `/variables` of a testbed.
pub fn variables(testbed: &Testbed) -> Value {
    let instances = testbed.instances();
    let one = |(id, of): (&str, VariableRef)| {
        variable(id, instances[of.slot()].name(), of.describe(instances), &value_of(instances, of))
    };
    testbed.signals().directory.iter().map(one).collect()
}

/// `/actions` of a testbed.
pub fn actions(testbed: &Testbed) -> Value {
    let of = |i: &Instance| {
        let named = |a: &terraglue_subsystem::Action| json!({ "id": format!("{}.{}", i.name(), a.name), "help": a.help });
        i.actions().iter().map(named).collect::<Vec<_>>()
    };
    testbed.instances().iter().flat_map(of).collect()
}

/// Value of a variable: a number, true or false, a name of an enumeration; null where there is none.
pub fn value(testbed: &Testbed, name: &str) -> Option<Value> {
    let of = testbed.signals().directory.find(name)?;
    Some(value_of(testbed.instances(), of))
}

/// Values of all variables, by full name.
pub fn values(testbed: &Testbed) -> Value {
    let instances = testbed.instances();
    let one = |(id, of): (&str, VariableRef)| (id.to_owned(), value_of(instances, of));
    testbed.signals().directory.iter().map(one).collect()
}

fn value_of(instances: &[Instance], of: VariableRef) -> Value {
    let v = of.describe(instances);
    of.number(instances).map_or(Value::Null, |number| shown(v.value_type, &v.enumeration, number))
}

/// A number as a value of its type.
fn shown(of: ValueType, names: &[String], number: f64) -> Value {
    match of {
        ValueType::Bool => json!(number != 0.0),
        ValueType::Enumeration => names.get(number as usize).map_or(json!(number), |name| json!(name)),
        // a whole number is written without a point, whatever its size
        of if kind(of) == "int" => json!(number as i64),
        _ => json!(number),
    }
}

/// `/variables` of a recording, from the metadata of its channels; all are read only.
pub fn recorded(topics: &[TopicInfo]) -> Value {
    let mut all = Vec::new();
    for topic in topics {
        let (Some(subsystem), Some(columns)) =
            (topic.metadata.get("subsystem"), topic.metadata.get("columns"))
        else {
            continue;
        };
        let columns: Vec<Value> = serde_json::from_str(columns).unwrap_or_default();
        let parameter = topic.topic.ends_with("/parameters");
        for column in &columns {
            let kind = match column["kind"].as_str().unwrap_or_default() {
                "bool" | "bools" => "bool",
                _ if column["values"].as_array().is_some_and(|names| !names.is_empty()) => "enum",
                "int64" | "int64s" => "int",
                _ => "real",
            };
            all.push(json!({
                "id": format!("{subsystem}.{}", column["name"].as_str().unwrap_or_default()),
                "subsystem": subsystem,
                "kind": kind,
                "array": false,
                "choices": column["values"],
                "unit": column["unit"],
                "help": column["help"],
                "effect": "read only",
                "why": "a recording cannot be changed",
                "causality": if parameter { "parameter" } else { "output" },
            }));
        }
    }
    Value::Array(all)
}
