//! Checks of every element before anything is read: finite numbers, names that are unique, default classes that exist.

use super::defaults::Defaults;
use crate::error::Error;
use crate::values;
use roxmltree::Node;
use std::collections::BTreeMap;

/// Sections whose elements share their names, whatever their tags.
const SHARED: [&str; 4] = ["actuator", "equality", "sensor", "tendon"];

/// Refuses faults that no reader of single elements sees.
pub(super) fn survey(d: &Defaults, root: Node) -> Result<(), Error> {
    let mut names: BTreeMap<(&str, &str), Node> = BTreeMap::new();
    for node in root.descendants().filter(Node::is_element) {
        let wrong = |problem| d.wrong(&d.element(node, None), problem);
        values::check(node).and_then(|()| values::check_name(node)).map_err(wrong)?;
        known_class(d, node).map_err(wrong)?;
        let Some(name) = node.attribute("name") else { continue };
        if let Some(first) = names.insert((kind(node), name), node) {
            let (file, line) = d.place(first);
            return Err(wrong(format!("the name is used twice, first in {file}:{line}; names are unique")));
        }
    }
    Ok(())
}

/// Kind of element within which a name is unique.
fn kind<'a>(node: Node<'a, '_>) -> &'a str {
    let section = node.parent_element().map_or("", |p| p.tag_name().name());
    match (SHARED.iter().find(|s| **s == section), node.tag_name().name()) {
        (Some(shared), _) => shared,
        (None, "freejoint") => "joint",
        (None, tag) => tag,
    }
}

fn known_class(d: &Defaults, node: Node) -> Result<(), String> {
    if node.has_tag_name("default") {
        return Ok(());
    }
    for key in ["class", "childclass"] {
        let Some(wanted) = node.attribute(key).filter(|c| !d.has_class(c)) else { continue };
        let near = d.class_names().min_by_key(|c| strsim::damerau_levenshtein(c, wanted));
        let near = near.map(|c| format!("; did you mean `{c}`?")).unwrap_or_default();
        return Err(format!("{key} = \"{wanted}\": there is no such class in <default>{near}"));
    }
    Ok(())
}
