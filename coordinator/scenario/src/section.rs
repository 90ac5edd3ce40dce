//! One table of a scenario, checked against its keys, with the defaults filled in.

use super::keys::{Form, Key, Table};
use super::node::{Node, Place, Raw};
use super::source::Source;
use serde_json::Value;
use std::path::PathBuf;
use terraglue_diagnostics::InputError;
use terraglue_diagnostics::did_you_mean;
use terraglue_diagnostics::{Complaint, check_value};
use terraglue_subsystem::ParameterType;

type Checked<T> = Result<T, Box<InputError>>;

/// A checked table; what a getter names is one of the table's keys.
pub struct Section<'a> {
    source: &'a Source,
    table: &'a Table,
    node: Option<&'a Node>,
}

impl<'a> Section<'a> {
    /// Checks the keys, types and ranges of `node`; an absent table has defaults only.
    pub fn check(source: &'a Source, table: &'a Table, node: Option<&'a Node>) -> Checked<Self> {
        let section = Self { source, table, node };
        match node {
            None if table.required => {
                let message = format!("the table `[{}]` is missing", table.name);
                Err(source.error(&Place::default(), message, Some(table.help.into())))
            }
            None => Ok(section),
            Some(node) if !node.is_table() => {
                let brackets = if table.repeated { "[[…]]" } else { "[…]" };
                let message = format!("`{}` is a table, written {brackets}", table.name);
                Err(source.error(&node.at, message, Some(table.help.into())))
            }
            Some(node) => section.check_entries(node).map(|()| section),
        }
    }

    fn check_entries(&self, node: &Node) -> Checked<()> {
        for (name, entry) in node.entries() {
            let Some(key) = self.table.keys.iter().find(|k| k.parameter.name == *name) else {
                return Err(self.unknown(name, entry));
            };
            check_entry(self.source, key, entry)?;
        }
        let kind = self.optional_text("kind");
        for key in &self.table.keys {
            let name = key.parameter.name.as_str();
            let known = key.only.is_empty() || kind.as_deref().is_some_and(|k| key.only.contains(&k));
            match node.get(name) {
                Some(entry) if !known => {
                    let kind = kind.as_deref().unwrap_or_default();
                    let message = format!("`{name}` does not belong to kind `{kind}`");
                    let help = Some(format!("`{name}` is known to: {}", key.only.join(", ")));
                    return Err(self.source.error(&entry.key, message, help));
                }
                None if known && key.parameter.default.is_null() && !key.parameter.optional => {
                    let message = format!("`{}` lacks `{name}`", self.table.name);
                    let help = Some(format!("{name}: {}; takes {}", key.parameter.help, key.allowed()));
                    return Err(self.source.error(&node.at, message, help));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn unknown(&self, name: &str, entry: &Node) -> Box<InputError> {
        let kind = self.optional_text("kind");
        let fits = |k: &&Key| k.only.is_empty() || kind.as_deref().is_none_or(|kind| k.only.contains(&kind));
        let names = self.table.keys.iter().filter(fits).map(|k| k.parameter.name.as_str());
        let message = format!("unknown key `{name}` in `{}`", self.table.name);
        self.source.error(&entry.key, message, did_you_mean(name, names))
    }

    /// Value of a key, or its default; null when neither.
    pub fn value(&self, key: &str) -> Value {
        let default =
            || self.table.keys.iter().find(|k| k.parameter.name == key).map(|k| k.parameter.default.clone());
        self.entry(key).map(Node::to_json).or_else(default).unwrap_or_default()
    }

    /// The entry as written.
    pub fn entry(&self, key: &str) -> Option<&'a Node> {
        self.node.and_then(|n| n.get(key))
    }

    /// A number or its default.
    pub fn number(&self, key: &str) -> f64 {
        self.value(key).as_f64().unwrap_or_default()
    }

    /// A number that may be absent.
    pub fn optional_number(&self, key: &str) -> Option<f64> {
        self.value(key).as_f64()
    }

    /// A whole number ≥ 0 or its default.
    pub fn count(&self, key: &str) -> u64 {
        self.value(key).as_u64().unwrap_or_default()
    }

    /// A whole number that may be absent.
    pub fn optional_count(&self, key: &str) -> Option<u64> {
        self.value(key).as_u64()
    }

    /// Text or its default.
    pub fn text(&self, key: &str) -> String {
        self.optional_text(key).unwrap_or_default()
    }

    /// Text that may be absent.
    pub fn optional_text(&self, key: &str) -> Option<String> {
        self.value(key).as_str().map(str::to_owned)
    }

    /// A list of N numbers or its default.
    pub fn numbers<const N: usize>(&self, key: &str) -> [f64; N] {
        let value = self.value(key);
        std::array::from_fn(|i| value.get(i).and_then(Value::as_f64).unwrap_or_default())
    }

    /// A file that exists, its path resolved against the folder of the scenario.
    pub fn file(&self, key: &str) -> PathBuf {
        self.source.folder().join(self.text(key))
    }

    /// An error at a place.
    pub fn error_at(&self, place: &Place, message: String, help: Option<String>) -> Box<InputError> {
        self.source.error(place, message, help)
    }

    /// An error at the value of a key.
    pub fn error(&self, key: &str, message: String, help: Option<String>) -> Box<InputError> {
        let place = self.entry(key).or(self.node).map(|n| n.at.clone()).unwrap_or_default();
        self.source.error(&place, message, help)
    }
}

/// Checks the value of one key.
pub fn check_entry(source: &Source, key: &Key, entry: &Node) -> Checked<()> {
    let ok = match key.form {
        Form::Texts => matches!(&entry.value, Raw::Text(_)) || is_list_of_texts(entry),
        Form::Assignments | Form::Map | Form::Vary => entry.is_table() && !entry.entries().is_empty(),
        _ => {
            let value = entry.to_json();
            let complain = |c: Complaint| source.error(&worst_place(entry), c.message, c.help);
            check_value(&key.parameter, key.count(), &value).map_err(complain)?;
            return check_path(source, key, entry);
        }
    };
    if ok {
        return Ok(());
    }
    let message = format!("`{}` takes {}", key.parameter.name, key.allowed());
    Err(source.error(&entry.at, message, Some(key.parameter.help.clone())))
}

/// The value itself; of a table that was meant to be a value, its key.
fn worst_place(entry: &Node) -> Place {
    entry.at.clone()
}

fn is_list_of_texts(entry: &Node) -> bool {
    matches!(&entry.value, Raw::List(items) if items.iter().all(|i| matches!(i.value, Raw::Text(_))))
}

fn check_path(source: &Source, key: &Key, entry: &Node) -> Checked<()> {
    match (key.parameter.parameter_type, &entry.value) {
        (ParameterType::Path, Raw::Text(text)) => {
            must_exist(source, text).map_err(|c| source.error(&entry.at, c.message, c.help))
        }
        _ => Ok(()),
    }
}

/// Complains when a path relative to the scenario does not exist, naming the most similar file beside it.
pub fn must_exist(source: &Source, text: &str) -> Result<(), Complaint> {
    let path = source.folder().join(text);
    if path.exists() {
        return Ok(());
    }
    let wanted = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let siblings = path.parent().and_then(|folder| std::fs::read_dir(folder).ok()).into_iter().flatten();
    let mut names: Vec<String> =
        siblings.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    // a link that leads nowhere has the very name
    names.retain(|name| *name != wanted);
    let near = terraglue_diagnostics::nearest(&wanted, names.iter().map(String::as_str));
    let help = match near {
        Some(near) => format!("did you mean `{near}`? Paths are relative to the folder of the scenario"),
        None => "paths are relative to the folder of the scenario".into(),
    };
    Err(Complaint { message: format!("no file `{text}` (looked at {})", path.display()), help: Some(help) })
}
