//! `--set key.path=value`: edits of a scenario before it is checked.

use super::node::{Node, Place, Raw};
use terraglue_diagnostics::InputError;
use toml_edit::{DocumentMut, Item, Key, Value};

/// One edit, split into its parts.
pub struct Edit {
    /// Dotted path; a number selects from an array of tables.
    pub path: Vec<String>,
    /// New value.
    pub value: Value,
    key: Place,
    at: Place,
}

impl Edit {
    /// Reads edit number `number`, which `option` of the command line brought. A value that is not TOML is a bare word, i.e. text.
    pub fn parse(number: usize, option: &str, key: &str, value: &str) -> Result<Self, Box<InputError>> {
        let text = edit_text(key, value);
        let refuse = |what: String| {
            let source_code = miette::NamedSource::new(option, text.clone());
            let help = Some("write --set table.key=value, e.g. --set time.step_s=0.0005".into());
            Box::new(InputError { message: what, source_code, span: Some((0..key.len()).into()), help })
        };
        let keys = Key::parse(key).map_err(|e| refuse(format!("`{key}` is no key path: {}", e.message())))?;
        if keys.is_empty() || key.trim().is_empty() {
            return Err(refuse("a `--set` without a key".into()));
        }
        let path = keys.iter().map(|k| k.get().to_owned()).collect();
        let parsed = value.trim().parse::<Value>().unwrap_or_else(|_| Value::from(value.trim()));
        let place = |range| Place { set: Some(number), range };
        let at = place(key.len() + 1..text.len());
        Ok(Self { path, value: parsed, key: place(0..key.len()), at })
    }

    /// Puts the value into the tree.
    pub fn apply(&self, root: &mut Node) {
        insert(root, &self.path, self);
    }

    /// Puts the value into the text.
    pub fn apply_to_text(&self, document: &mut DocumentMut) {
        let mut item = document.as_item_mut();
        let Some((last, tables)) = self.path.split_last() else { return };
        for part in tables {
            item = match item {
                Item::ArrayOfTables(_) => match part.parse::<usize>().ok().and_then(|i| item.get_mut(i)) {
                    Some(below) => below,
                    None => return,
                },
                Item::Table(table) => table.entry(part).or_insert_with(toml_edit::table),
                Item::Value(Value::InlineTable(_)) => &mut item[part.as_str()],
                _ => return,
            };
        }
        if let Some(table) = item.as_table_like_mut() {
            table.insert(last, Item::Value(self.value.clone()));
        }
    }
}

/// Splits `key.path=value`.
pub fn split(text: &str) -> Option<(String, String)> {
    text.split_once('=').map(|(key, value)| (key.trim().to_owned(), value.trim().to_owned()))
}

/// An edit as the user would write it.
pub fn edit_text(key: &str, value: &str) -> String {
    format!("{key}={value}")
}

fn insert(node: &mut Node, path: &[String], edit: &Edit) {
    let Some((part, rest)) = path.split_first() else {
        *node = Node::of_set(&edit.value, edit.key.clone(), edit.at.clone());
        return;
    };
    match &mut node.value {
        Raw::List(items) => {
            if let Some(item) = part.parse::<usize>().ok().and_then(|i| items.get_mut(i)) {
                insert(item, rest, edit);
            } else {
                *node = Node { key: edit.key.clone(), at: edit.key.clone(), value: Raw::default() };
                insert(node, path, edit);
            }
        }
        Raw::Table(entries) => {
            let index = entries.iter().position(|(key, _)| key == part).unwrap_or_else(|| {
                let new = Node { key: edit.key.clone(), at: edit.key.clone(), value: Raw::default() };
                entries.push((part.clone(), new));
                entries.len() - 1
            });
            insert(&mut entries[index].1, rest, edit);
        }
        // A key below a plain value: replaced by a table, which the check then refuses at this place.
        _ => {
            *node = Node { key: edit.key.clone(), at: edit.key.clone(), value: Raw::default() };
            insert(node, path, edit);
        }
    }
}
