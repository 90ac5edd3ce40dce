//! Differences of two scenarios, key by key: a recording carries the text of its own.

use super::node::Node;
use serde_json::Value;
use std::collections::BTreeMap;
use toml_edit::Document;

/// A key whose values differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// `table.key`; elements of lists of tables by their number from 0.
    pub key: String,
    /// Its value in the first text, as JSON; none: it is not there.
    pub first: Option<String>,
    /// Its value in the second one.
    pub second: Option<String>,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let shown = |v: &Option<String>| v.clone().unwrap_or_else(|| "absent".into());
        write!(f, "`{}` is {} and not {}", self.key, shown(&self.second), shown(&self.first))
    }
}

/// All keys with different values in the order of their names; 1 and 1.0 are the same number. `None`: one of the
/// texts is not TOML.
pub fn differences(first: &str, second: &str) -> Option<Vec<Difference>> {
    let (first, second) = (values(first)?, values(second)?);
    let keys: std::collections::BTreeSet<&String> = first.keys().chain(second.keys()).collect();
    let difference = |key: &String| Difference {
        key: key.clone(),
        first: first.get(key).cloned(),
        second: second.get(key).cloned(),
    };
    Some(keys.into_iter().map(difference).filter(|d| d.first != d.second).collect())
}

fn values(text: &str) -> Option<BTreeMap<String, String>> {
    let document = Document::parse(text.to_owned()).ok()?;
    let mut all = BTreeMap::new();
    flatten("", &Node::of_document(document.as_table()).to_json(), &mut all);
    Some(all)
}

/// Tables and lists of tables become keys; a list of values stays one value.
fn flatten(prefix: &str, value: &Value, all: &mut BTreeMap<String, String>) {
    let below = |key: &str| if prefix.is_empty() { key.to_owned() } else { format!("{prefix}.{key}") };
    match value {
        Value::Object(table) => table.iter().for_each(|(key, value)| flatten(&below(key), value, all)),
        Value::Array(items) if !items.is_empty() && items.iter().all(Value::is_object) => {
            items.iter().enumerate().for_each(|(k, item)| flatten(&below(&k.to_string()), item, all));
        }
        other => drop(all.insert(prefix.to_owned(), plain(other).to_string())),
    }
}

/// The value with all numbers as floating-point ones.
fn plain(value: &Value) -> Value {
    match value {
        Value::Number(n) => n.as_f64().map_or_else(|| value.clone(), Value::from),
        Value::Array(items) => items.iter().map(plain).collect(),
        other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_values_make_a_difference() {
        let first = "[time]\nstep_s = 1\n[[event]]\nat_s = 2.0\nset = { \"a.b\" = [1, 2] }\n";
        let same =
            "event = [{ set = { \"a.b\" = [1.0, 2.0] }, at_s = 2 }] # said otherwise\ntime.step_s = 1.0";
        assert_eq!(differences(first, same), Some(Vec::new()));
        let other = first.replace("at_s = 2.0", "at_s = 3.0") + "[soil]\nmodule = \"sand\"\n";
        let found: Vec<String> =
            differences(first, &other).expect("TOML").iter().map(Difference::to_string).collect();
        assert_eq!(found, ["`event.0.at_s` is 3.0 and not 2.0", "`soil.module` is \"sand\" and not absent"]);
        assert_eq!(differences("[", first), None);
    }
}
