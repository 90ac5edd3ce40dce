//! Where in a scenario a complaint belongs that its author does not place: of a module about its parameters, of what makes the
//! terrain. The message names a key or a value, and that has a place.

use super::node::{Node, Place, Raw};
use super::source::Source;
use terraglue_diagnostics::InputError;

impl Source {
    /// An error at the key or value of table `table` that its message names, one that an edit brought first; at the path
    /// `otherwise` where it names none.
    pub fn error_about(
        &self,
        table: &str,
        otherwise: &[&str],
        message: impl Into<String>,
        help: Option<String>,
    ) -> Box<InputError> {
        let message = message.into();
        let place = self.named_in(table, &message).unwrap_or_else(|| self.value_place(otherwise));
        self.error(&place, message, help)
    }

    /// An error of all of table `table`: at the last edit of it, at its head where there is none.
    pub fn error_of_table(
        &self,
        table: &str,
        message: impl Into<String>,
        help: Option<String>,
    ) -> Box<InputError> {
        let edit = self.root.get(table).and_then(last_edit);
        self.error(&edit.cloned().unwrap_or_else(|| self.value_place(&[table])), message, help)
    }

    /// The place in a table of what a message names.
    fn named_in(&self, table: &str, message: &str) -> Option<Place> {
        let table = self.root.get(table)?;
        let mut found =
            names(message).filter_map(|name| by_key(table, name).or_else(|| by_text(table, name)));
        let first = found.next()?;
        let edited = |at: &&Place| at.set.is_some();
        Some(Some(first).filter(edited).or_else(|| found.find(edited)).unwrap_or(first).clone())
    }
}

/// The last edit of a value or of anything below it.
fn last_edit(node: &Node) -> Option<&Place> {
    let below = node.entries().iter().filter_map(|(_, below)| last_edit(below));
    let own = Some(&node.at).filter(|at| at.set.is_some());
    own.into_iter().chain(below).max_by_key(|at| at.set)
}

/// Parts of a message that can be a name: those in backquotes, then words with an underscore.
fn names(message: &str) -> impl Iterator<Item = &str> {
    let quoted = message.split('`').skip(1).step_by(2);
    let is_of_name = |c: char| c.is_alphanumeric() || "_.".contains(c);
    let bare = message.split(move |c| !is_of_name(c)).map(|word| word.trim_matches('.'));
    quoted.chain(bare.filter(|word| word.contains('_')))
}

/// The value of a key of that dotted name, at any depth.
fn by_key<'a>(node: &'a Node, name: &str) -> Option<&'a Place> {
    let own = node.entries().iter().find_map(|(key, below)| match name.strip_prefix(key.as_str()) {
        Some("") => Some(&below.at),
        Some(rest) => by_key(below, rest.strip_prefix('.')?),
        None => None,
    });
    own.or_else(|| node.entries().iter().find_map(|(_, below)| by_key(below, name)))
}

/// The first value that is that text.
fn by_text<'a>(node: &'a Node, text: &str) -> Option<&'a Place> {
    match &node.value {
        Raw::Text(own) => (own == text).then_some(&node.at),
        Raw::List(items) => items.iter().find_map(|below| by_text(below, text)),
        Raw::Table(entries) => entries.iter().find_map(|(_, below)| by_text(below, text)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use crate::Scenario;

    const TEXT: &str = "[time]\nduration_s = 1.0\n[terrain]\nkind = \"flat\"\nsize_m = [1, 1]\nspacing_m = 0.1\n\
        [robot]\nmodule = \"rigid-body\"\nstiffness = 600.0\njoints = { hip = 0.1 }\nmotor = \"off\"\n";

    /// File or option, and the words that are marked.
    fn marked(sets: &[(&str, &str)], message: &str) -> (String, String) {
        let sets: Vec<_> = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let scenario = Scenario::parse(TEXT, "a.toml", &sets).expect("good");
        let error = scenario.source.error_about("robot", &["robot"], message, None);
        let span = error.span.expect("a place");
        let words = &error.source_code.inner()[span.offset()..span.offset() + span.len()];
        (error.source_code.name().to_owned(), words.to_owned())
    }

    fn at(file: &str, words: &str) -> (String, String) {
        (file.into(), words.into())
    }

    #[test]
    fn what_a_message_names_is_marked() {
        assert_eq!(marked(&[], "`stiffness` is too small"), at("a.toml", "600.0"));
        assert_eq!(marked(&[], "`joints.hip` is odd"), at("a.toml", "0.1"));
        assert_eq!(marked(&[], "joint `hip` starts outside"), at("a.toml", "0.1"));
        assert_eq!(marked(&[], "there is no motor `off`"), at("a.toml", "\"off\""));
        assert_eq!(marked(&[], "nothing is named"), at("a.toml", "[robot]"));
    }

    #[test]
    fn an_edit_that_is_named_is_marked_first() {
        let sets = [("robot.position_m", "[0, 0]")];
        assert_eq!(marked(&sets, "position_m takes three numbers"), at("--set", "[0, 0]"));
        assert_eq!(marked(&sets, "`stiffness` does not fit `position_m`"), at("--set", "[0, 0]"));
        assert_eq!(marked(&sets, "`stiffness` is too small"), at("a.toml", "600.0"));
    }

    #[test]
    fn a_table_is_marked_at_its_last_edit() {
        let of = |sets: &[(String, String)]| {
            let scenario = Scenario::parse(TEXT, "a.toml", sets).expect("good");
            let error = scenario.source.error_of_table("terrain", "too high", None);
            error.source_code.inner()[error.span.expect("a place").offset()..].to_owned()
        };
        let set = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        assert!(of(&[]).starts_with("[terrain]"));
        let sets = [
            set("terrain.height_m", "900.0"),
            set("terrain.spacing_m", "0.2"),
            set("robot.stiffness", "1.0"),
        ];
        assert_eq!(of(&sets), "0.2");
    }
}
