//! Attributes that act on the mechanics and are not supported: each is named, none is dropped silently.

use super::Reader;
use roxmltree::Node;

/// Per element its attributes; those that only tune a solver are not here.
const IGNORED: [(&str, &[&str]); 8] = [
    ("joint", &["springdamper", "actuatorgravcomp", "ref"]),
    ("body", &["mocap", "gravcomp"]),
    ("geom", &["fluidshape", "priority", "shellinertia", "margin", "gap"]),
    ("position", &["dampratio", "inheritrange", "timeconst", "delay"]),
    ("motor", &["delay"]),
    (
        "compiler",
        &["balanceinertia", "boundmass", "boundinertia", "settotalmass", "inertiagrouprange", "coordinate"],
    ),
    ("option", &["wind", "density", "viscosity"]),
    ("mesh", &["builtin", "maxhullvert"]),
];

impl Reader<'_, '_> {
    /// Warns of what an element says in vain, itself or by its default class.
    pub(super) fn warn_ignored(&mut self, node: Node, class: Option<&str>) {
        let tag = node.tag_name().name();
        let Some((_, names)) = IGNORED.iter().find(|(element, _)| *element == tag) else { return };
        let e = self.d.element(node, None);
        let e = if node.attribute("class").is_some() { e } else { e.inheriting(class) };
        for name in *names {
            let Some(value) = self.d.text(&e, name).map(str::to_owned) else { continue };
            let neutral = value.split_whitespace().all(|v| v == "0" || v == "false" || v == "0.0");
            if !neutral {
                self.warn(
                    node,
                    &format!("has `{name}` = \"{value}\", which is not supported and does nothing"),
                );
            }
        }
    }
}
