//! Checks of the attributes of both formats: numbers are finite and of a size that can be computed with, names are not
//! empty.
//!
//! Every attribute is checked, also those that only some models have, and those of default classes that nothing uses yet: a
//! `nan` is never meant.

use roxmltree::Node;

/// Attributes that are text, whatever their words look like.
const TEXT: [&str; 31] = [
    "name",
    "link",
    "joint",
    "joint1",
    "joint2",
    "type",
    "filename",
    "file",
    "model",
    "class",
    "childclass",
    "material",
    "texture",
    "mesh",
    "hfield",
    "body",
    "body1",
    "body2",
    "site",
    "site1",
    "site2",
    "geom",
    "geom1",
    "geom2",
    "tendon",
    "tendon1",
    "tendon2",
    "target",
    "objname",
    "refname",
    "prefix",
];

/// Attributes in which a huge number stands for none.
const OPEN_ENDED: [&str; 8] =
    ["lower", "upper", "effort", "velocity", "range", "ctrlrange", "forcerange", "actuatorfrcrange"];

/// Products of three such numbers are still finite.
pub(crate) const LARGEST: f64 = 1e100;

/// Checks the numbers and the name of an element.
pub(crate) fn check(node: Node) -> Result<(), String> {
    for attribute in node.attributes() {
        let (name, text) = (attribute.name(), attribute.value());
        if TEXT.contains(&name) {
            continue;
        }
        for word in text.split_whitespace() {
            let Ok(number) = word.parse::<f64>() else { continue };
            if !number.is_finite() {
                let way_out = match name {
                    "lower" | "upper" => "write a finite number, or make the joint continuous",
                    _ => "write finite numbers",
                };
                return Err(format!("{name} = \"{text}\" is not finite; {way_out}"));
            }
            if number.abs() > LARGEST && !OPEN_ENDED.contains(&name) {
                return Err(format!(
                    "{name} = \"{text}\" is beyond {LARGEST:e}, too large to compute with; check its unit"
                ));
            }
        }
    }
    Ok(())
}

/// Checks the name of an element; no name at all is right here.
pub(crate) fn check_name(node: Node) -> Result<(), String> {
    match node.attribute("name") {
        Some(name) if name.trim().is_empty() => Err(format!(
            "name = \"{name}\" is empty; variables and messages are called by it, so give it one"
        )),
        _ => Ok(()),
    }
}
