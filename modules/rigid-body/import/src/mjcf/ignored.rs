//! Attributes that are neither read nor without effect: each is named, none is dropped silently.

use super::MjcfReader;
use roxmltree::Node;
use std::collections::BTreeMap;

/// Attributes for the pose of an element.
const TURNED: &[&str] = &["pos", "quat", "axisangle", "euler", "xyaxes", "zaxis"];
/// Attributes without effect on the mechanics, or that only tune MuJoCo's solver and its soft limits.
const HARMLESS: &[&str] = &["name", "class", "group", "user", "rgba", "material"];

/// Per element the attributes that are read, and those without effect besides [`HARMLESS`].
const KNOWN: [(&str, &[&str]); 17] = [
    (
        "joint",
        &[
            "type",
            "axis",
            "pos",
            "range",
            "limited",
            "damping",
            "frictionloss",
            "armature",
            "stiffness",
            "springref",
            "solreflimit",
            "solimplimit",
            "solreffriction",
            "solimpfriction",
            // of equality
            "joint1",
            "joint2",
            "polycoef",
            "active",
            "solref",
            "solimp",
        ],
    ),
    ("freejoint", &["align"]),
    ("body", &["childclass", "sleep"]),
    ("inertial", &["mass", "diaginertia", "fullinertia"]),
    (
        "geom",
        &[
            "type",
            "size",
            "fromto",
            "mesh",
            "hfield",
            "mass",
            "density",
            "contype",
            "conaffinity",
            "condim",
            "friction",
        ],
    ),
    ("position", &["joint", "kp", "kv", "gear", "forcerange", "forcelimited"]),
    ("velocity", &["joint", "kv", "gear", "forcerange", "forcelimited"]),
    ("motor", &["joint", "gear", "forcerange", "forcelimited", "ctrlrange", "ctrllimited"]),
    (
        "general",
        &[
            "joint",
            "gear",
            "forcerange",
            "forcelimited",
            "ctrlrange",
            "ctrllimited",
            "gaintype",
            "gainprm",
            "biastype",
            "biasprm",
            "dyntype",
        ],
    ),
    ("connect", &["body1", "body2", "anchor", "active", "solref", "solimp", "site1", "site2"]),
    ("weld", &["body1", "body2", "anchor", "relpose", "active", "solref", "solimp", "site1", "site2"]),
    ("exclude", &["body1", "body2"]),
    (
        "compiler",
        &[
            "angle",
            "eulerseq",
            "meshdir",
            "assetdir",
            "texturedir",
            "strippath",
            "autolimits",
            "inertiafromgeom",
            "discardvisual",
            "fusestatic",
            "convexhull",
            "usethread",
            "alignfree",
            "saveinertial",
            "settotalmass",
        ],
    ),
    (
        "option",
        &[
            "timestep",
            "gravity",
            "integrator",
            "solver",
            "cone",
            "jacobian",
            "iterations",
            "tolerance",
            "impratio",
            "ls_iterations",
            "ls_tolerance",
            "noslip_iterations",
            "noslip_tolerance",
            "ccd_iterations",
            "ccd_tolerance",
            "mpr_iterations",
            "mpr_tolerance",
            "sdf_iterations",
            "sdf_initpoints",
            "sleep_tolerance",
            "apirate",
            "magnetic",
        ],
    ),
    (
        "flag",
        &[
            "energy",
            "fwdinv",
            "invdiscrete",
            "multiccd",
            "warmstart",
            "eulerdamp",
            "refsafe",
            "midphase",
            "nativeccd",
            "island",
            "autoreset",
            "sensor",
            "sleep",
        ],
    ),
    (
        "mesh",
        &[
            "file",
            "vertex",
            "face",
            "scale",
            "refpos",
            "refquat",
            "normal",
            "texcoord",
            "smoothnormal",
            "content_type",
        ],
    ),
    ("hfield", &["file", "nrow", "ncol", "size", "elevation", "content_type"]),
];

/// By element and attribute: the warning of the first, and how many there are.
#[derive(Default)]
pub(super) struct Ignored {
    found: BTreeMap<(String, String), (String, usize)>,
}

impl Ignored {
    /// One warning per element and attribute.
    pub fn warnings(self) -> impl Iterator<Item = String> {
        self.found.into_values().map(|(text, count)| match count {
            1 => text,
            more => format!("{text} ({} more like it)", more - 1),
        })
    }
}

impl MjcfReader<'_, '_> {
    /// Notes the attributes of an element, its own or those of its default class, that have no effect.
    pub(super) fn warn_ignored(&mut self, node: Node, class: Option<&str>) {
        let tag = node.tag_name().name();
        let Some((_, known)) = KNOWN.iter().find(|(element, _)| *element == tag) else { return };
        let e = self.d.element(node, None);
        let e = if node.attribute("class").is_some() { e } else { e.inheriting(class) };
        let read = |name: &str| known.contains(&name) || HARMLESS.contains(&name) || TURNED.contains(&name);
        for (name, value) in self.d.attributes(&e) {
            // A switch matters when it is off, anything else when it is not 0.
            let off: &[&str] = if tag == "flag" { &["enable"] } else { &["0", "0.0", "false"] };
            if read(&name) || value.split_whitespace().all(|v| off.contains(&v)) {
                continue;
            }
            self.ignore(node, &name, &value);
        }
    }

    /// Notes that an attribute has no effect.
    pub(super) fn ignore(&mut self, node: Node, name: &str, value: &str) {
        let text = format!("has `{name}` = \"{value}\", which is not supported and does nothing");
        let text = self.place(node, &text);
        let key = (node.tag_name().name().to_owned(), name.to_owned());
        self.ignored.found.entry(key).or_insert((text, 0)).1 += 1;
    }
}
