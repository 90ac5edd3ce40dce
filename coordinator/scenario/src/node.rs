//! A parsed scenario as a plain tree in which every key and value knows where it was written.

use serde_json::{Map, Value as Json};
use std::ops::Range;
use toml_edit::{Item, Table, TableLike, Value};

/// Where something was written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// Number of the `--set` that brought it; none: the file.
    pub set: Option<usize>,
    /// Byte range in the file or in the text of the `--set`.
    pub range: Range<usize>,
}

/// A key with its value.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// The key.
    pub key: Place,
    /// The value; of a table, its header.
    pub at: Place,
    /// The value.
    pub value: Raw,
}

/// A value.
#[derive(Clone, Debug)]
pub enum Raw {
    /// true or false.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A floating-point number, also nan and inf.
    Number(f64),
    /// Text; also a date, which no key takes.
    Text(String),
    /// A list or an array of tables.
    List(Vec<Node>),
    /// A table in the order of the file.
    Table(Vec<(String, Node)>),
}

impl Default for Raw {
    fn default() -> Self {
        Self::Table(Vec::new())
    }
}

impl Node {
    /// The tree of a parsed document.
    pub fn of_document(table: &Table) -> Self {
        let whole = Place { set: None, range: 0..0 };
        Self { key: whole.clone(), at: whole, value: Raw::Table(of_table(table)) }
    }

    /// A value that `--set` number `set` brought; all of it has one place.
    pub fn of_set(value: &Value, key: Place, at: Place) -> Self {
        let mut node = of_value(value, key.range.clone());
        node.stamp(&key, &at);
        node
    }

    fn stamp(&mut self, key: &Place, at: &Place) {
        (self.key, self.at) = (key.clone(), at.clone());
        match &mut self.value {
            Raw::List(items) => items.iter_mut().for_each(|n| n.stamp(key, at)),
            Raw::Table(entries) => entries.iter_mut().for_each(|(_, n)| n.stamp(key, at)),
            _ => {}
        }
    }

    /// Entry of a table.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entries().iter().find(|(k, _)| k == key).map(|(_, node)| node)
    }

    /// Entries of a table; empty for anything else.
    pub fn entries(&self) -> &[(String, Node)] {
        match &self.value {
            Raw::Table(entries) => entries,
            _ => &[],
        }
    }

    /// Whether it is a table.
    pub fn is_table(&self) -> bool {
        matches!(self.value, Raw::Table(_))
    }

    /// As JSON; nan and inf become null, which no check accepts.
    pub fn to_json(&self) -> Json {
        match &self.value {
            Raw::Bool(b) => Json::Bool(*b),
            Raw::Integer(i) => Json::from(*i),
            Raw::Number(x) => Json::from(*x),
            Raw::Text(t) => Json::String(t.clone()),
            Raw::List(items) => Json::Array(items.iter().map(Node::to_json).collect()),
            Raw::Table(entries) => Json::Object(to_map(entries)),
        }
    }

    /// The first key or text below it that holds `words`.
    pub fn find(&self, words: &str) -> Option<&Place> {
        match &self.value {
            Raw::Text(text) => text.contains(words).then_some(&self.at),
            Raw::List(items) => items.iter().find_map(|n| n.find(words)),
            Raw::Table(entries) => entries
                .iter()
                .find_map(|(key, n)| n.find(words).or_else(|| key.contains(words).then_some(&n.key))),
            _ => None,
        }
    }

    /// From the first to the last byte of the file that belongs to it.
    pub fn extent(&self) -> Range<usize> {
        let below: Vec<&Node> = match &self.value {
            Raw::List(items) => items.iter().collect(),
            Raw::Table(entries) => entries.iter().map(|(_, node)| node).collect(),
            _ => Vec::new(),
        };
        below
            .iter()
            .filter(|n| n.at.set.is_none())
            .map(|n| n.extent())
            .fold(self.at.range.clone(), |a, b| a.start.min(b.start)..a.end.max(b.end))
    }
}

fn to_map(entries: &[(String, Node)]) -> Map<String, Json> {
    entries.iter().map(|(key, node)| (key.clone(), node.to_json())).collect()
}

fn of_table(table: &dyn TableLike) -> Vec<(String, Node)> {
    let entry = |(key, item): (&str, &Item)| {
        let key_range = table.key(key).and_then(|k| k.span());
        let range = key_range.or_else(|| item.span()).unwrap_or(0..0);
        (key.to_owned(), of_item(item, range))
    };
    table.iter().map(entry).collect()
}

fn of_item(item: &Item, key: Range<usize>) -> Node {
    match item {
        Item::Value(value) => of_value(value, key),
        Item::Table(table) => {
            let at = table.span().unwrap_or_else(|| key.clone());
            node(key, at, Raw::Table(of_table(table)))
        }
        Item::ArrayOfTables(tables) => {
            let items = tables.iter().map(|table| {
                let at = table.span().unwrap_or_else(|| key.clone());
                node(key.clone(), at, Raw::Table(of_table(table)))
            });
            let items: Vec<Node> = items.collect();
            let at = items.first().map_or_else(|| key.clone(), |n| n.at.range.clone());
            node(key, at, Raw::List(items))
        }
        Item::None => node(key.clone(), key, Raw::Text(String::new())),
    }
}

fn of_value(value: &Value, key: Range<usize>) -> Node {
    let at = value.span().unwrap_or_else(|| key.clone());
    let raw = match value {
        Value::String(s) => Raw::Text(s.value().clone()),
        Value::Integer(i) => Raw::Integer(*i.value()),
        Value::Float(x) => Raw::Number(*x.value()),
        Value::Boolean(b) => Raw::Bool(*b.value()),
        Value::Datetime(d) => Raw::Text(d.value().to_string()),
        Value::Array(items) => Raw::List(items.iter().map(|v| of_value(v, key.clone())).collect()),
        Value::InlineTable(table) => Raw::Table(of_table(table)),
    };
    node(key, at, raw)
}

fn node(key: Range<usize>, at: Range<usize>, value: Raw) -> Node {
    Node { key: Place { set: None, range: key }, at: Place { set: None, range: at }, value }
}

/// Text of an entry.
pub fn text(node: &Node, key: &str) -> Option<String> {
    match &node.get(key)?.value {
        Raw::Text(text) => Some(text.clone()),
        _ => None,
    }
}
