//! The text of a scenario, kept so that every error can show file, line and the offending words.

use super::model::Entry;
use super::node::{Node, Place, Raw};
use miette::NamedSource;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use terraglue_diagnostics::InputError;
use terraglue_fmi::ssp::Package;

/// A scenario's text, kept for errors.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// Path as the user gave it.
    pub path: String,
    /// Contents after `--set`: a scenario file that gives the same run.
    pub text: String,
    /// Contents of the file; spans refer to it.
    pub(super) file_text: Arc<str>,
    /// Edits by `--set` and the like: the option, and `key.path=value`.
    pub(super) sets: Arc<[(String, String)]>,
    /// The parsed text after the edits.
    pub(super) root: Arc<Node>,
    /// The system structure that it was made from, whose files lie elsewhere.
    pub(super) package: Option<Arc<Package>>,
}

impl Source {
    /// An error at a byte range of the file.
    pub fn error_at(
        &self,
        span: Range<usize>,
        message: impl Into<String>,
        help: Option<String>,
    ) -> Box<InputError> {
        self.error(&Place { set: None, range: span }, message, help)
    }

    /// An error at the key or value of an entry that holds one of `words`, in the file or in the `--set` that brought it;
    /// at the whole entry where none does.
    pub fn error_in(
        &self,
        entry: Entry,
        words: &[&str],
        message: impl Into<String>,
        help: Option<String>,
    ) -> Box<InputError> {
        let node = match self.root.get(entry.table).map(|node| &node.value) {
            Some(Raw::List(items)) => items.get(entry.number),
            _ => None,
        };
        let found =
            node.and_then(|node| words.iter().find_map(|w| node.find(w).map(|at| self.narrow(at, w))));
        let whole = || match node {
            Some(node) if node.at.set.is_none() => Place { set: None, range: node.extent() },
            Some(node) => node.at.clone(),
            None => Place::default(),
        };
        self.error(&found.unwrap_or_else(whole), message, help)
    }

    /// The words within a place, or all of it.
    fn narrow(&self, place: &Place, words: &str) -> Place {
        let text = self.text_at(place).1;
        // a value that an edit brought has no places of its own within it
        let range = if place.set.is_some() { 0..text.len() } else { place.range.clone() };
        let at = text.get(range.clone()).and_then(|text| text.find(words));
        at.map_or_else(
            || place.clone(),
            |at| {
                let start = range.start + at;
                Place { set: place.set, range: start..start + words.len() }
            },
        )
    }

    /// Name and text of the file, or of the `--set`, that a place is in.
    fn text_at(&self, place: &Place) -> (&str, &str) {
        match place.set.and_then(|i| self.sets.get(i)) {
            Some((option, set)) => (option.as_str(), set.as_str()),
            None => (self.path.as_str(), self.file_text.as_ref()),
        }
    }

    /// An error at the value of a key path, e.g. `["robot", "model"]`; at the nearest table above when absent.
    pub fn error_at_value(
        &self,
        path: &[&str],
        message: impl Into<String>,
        help: Option<String>,
    ) -> Box<InputError> {
        self.error(&self.value_place(path), message, help)
    }

    /// The folder of the file; relative paths refer to it.
    pub fn folder(&self) -> PathBuf {
        if let Some(package) = &self.package {
            return package.folder().to_owned();
        }
        match Path::new(&self.path).parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        }
    }

    pub(super) fn error(
        &self,
        place: &Place,
        message: impl Into<String>,
        help: Option<String>,
    ) -> Box<InputError> {
        let (name, text) = self.text_at(place);
        let end = place.range.end.min(text.len());
        Box::new(InputError {
            message: message.into(),
            source_code: NamedSource::new(name, text.to_owned()),
            span: Some((place.range.start.min(end)..end).into()),
            help,
        })
    }

    /// Place of the value at a path, or of the deepest table on the way that exists.
    pub(super) fn value_place(&self, path: &[&str]) -> Place {
        self.deepest(path).0.at.clone()
    }

    /// Place of the key at a path, or of the deepest table on the way that exists.
    pub(super) fn key_place(&self, path: &[&str]) -> Place {
        let (node, complete) = self.deepest(path);
        if complete { node.key.clone() } else { node.at.clone() }
    }

    /// Whether the file or an edit has this path.
    pub(super) fn has(&self, path: &[&str]) -> bool {
        self.deepest(path).1
    }

    fn deepest(&self, path: &[&str]) -> (&Node, bool) {
        let mut node = self.root.as_ref();
        for key in path {
            match &node.value {
                Raw::Table(_) => match node.get(key) {
                    Some(below) => node = below,
                    None => return (node, false),
                },
                _ => return (node, false),
            }
        }
        (node, true)
    }
}
