//! Content of a URDF file that nothing reads: each kind of element and attribute is named once, none is dropped
//! silently.

use crate::error::Source;
use roxmltree::{Document, Node};
use std::collections::BTreeMap;

/// Says which controller drives a joint: nearly every robot of ROS has them, and nothing mechanical is lost without.
const TRANSMISSION: &str = "transmission";

/// An element, its children, and its attributes. Colours and textures are left to viewers.
const KNOWN: [(&str, &[&str], &[&str]); 21] = [
    ("robot", &["link", "joint", "material", TRANSMISSION], &["name", "version"]),
    ("link", &["inertial", "visual", "collision"], &["name"]),
    ("inertial", &["origin", "mass", "inertia"], &[]),
    ("mass", &[], &["value"]),
    ("inertia", &[], &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]),
    ("origin", &[], &["xyz", "rpy"]),
    ("visual", &["origin", "geometry", "material"], &["name"]),
    ("collision", &["origin", "geometry"], &["name"]),
    ("geometry", &["box", "cylinder", "sphere", "capsule", "mesh"], &[]),
    ("box", &[], &["size"]),
    ("cylinder", &[], &["radius", "length"]),
    ("sphere", &[], &["radius"]),
    ("capsule", &[], &["radius", "length"]),
    ("mesh", &[], &["filename", "scale"]),
    ("joint", &["origin", "parent", "child", "axis", "dynamics", "limit", "mimic"], &["name", "type"]),
    ("parent", &[], &["link"]),
    ("child", &[], &["link"]),
    ("axis", &[], &["xyz"]),
    ("dynamics", &[], &["damping", "friction"]),
    ("limit", &[], &["lower", "upper", "effort", "velocity"]),
    ("mimic", &[], &["joint", "multiplier", "offset"]),
];

/// By kind: the warning of the first, and how many there are.
type Found = BTreeMap<String, (String, usize)>;

/// Warnings, one for every kind of element or attribute without effect, and notices of known ones that are not used.
pub(crate) fn told(source: &Source, robot: &urdf_rs::Robot) -> (Vec<String>, Vec<String>) {
    let Ok(document) = Document::parse(source.text) else { return Default::default() };
    let mut found = Found::new();
    look(source, document.root_element(), &mut found);
    let warnings = found.into_values().map(|(text, count)| match count {
        1 => text,
        more => format!("{text} ({} more like it)", more - 1),
    });
    let notices = effort(source, robot).into_iter().chain(transmissions(source, &document));
    (warnings.collect(), notices.collect())
}

fn look(source: &Source, node: Node, found: &mut Found) {
    let tag = node.tag_name().name();
    let Some((_, children, attributes)) = KNOWN.iter().find(|(element, ..)| *element == tag) else { return };
    let line = |node: Node| node.document().text_pos_at(node.range().start).row;
    let mut note = |kind: String, line: u32, what: String| {
        let text = format!("{}:{line}: {what} is not supported and does nothing", source.file);
        found.entry(kind).or_insert((text, 0)).1 += 1;
    };
    for a in node.attributes().filter(|a| !attributes.contains(&a.name())) {
        let what = format!("`{}` = \"{}\" of <{tag}>", a.name(), a.value());
        note(format!("{tag} {}", a.name()), line(node), what);
    }
    for child in node.children().filter(Node::is_element) {
        let name = child.tag_name().name();
        if !children.contains(&name) {
            note(format!("{tag}/{name}"), line(child), format!("<{name}> in <{tag}>"));
        }
    }
    node.children().filter(|c| children.contains(&c.tag_name().name())).for_each(|c| look(source, c, found));
}

fn transmissions(source: &Source, document: &Document) -> Option<String> {
    let mut all = document.root_element().children().filter(|c| c.has_tag_name(TRANSMISSION));
    let line = document.text_pos_at(all.next()?.range().start).row;
    let text =
        format!("<{TRANSMISSION}> is for controllers of ROS and does nothing ({} in all)", all.count() + 1);
    Some(format!("{}:{line}: {text}", source.file))
}

fn effort(source: &Source, robot: &urdf_rs::Robot) -> Option<String> {
    let bounded = robot.joints.iter().find(|j| j.limit.effort != 0.0 || j.limit.velocity != 0.0)?;
    let text = "`effort` and `velocity` of <limit> are not used: the scenario's `max_torque` bounds the motors (`terraglue new scenario` copies `effort` into it)";
    Some(source.joint(&bounded.name, text).to_string())
}
