//! Checks of the text of a URDF file, with lines, before `urdf-rs` reads it: its messages have no place.

use crate::error::{Error, Source};
use crate::values::{self, check_name};
use roxmltree::{Document, Node};

/// Attributes that hold numbers: element, attribute, how many.
const NUMBERS: [(&str, &str, usize); 27] = [
    ("origin", "xyz", 3),
    ("origin", "rpy", 3),
    ("axis", "xyz", 3),
    ("mass", "value", 1),
    ("inertia", "ixx", 1),
    ("inertia", "ixy", 1),
    ("inertia", "ixz", 1),
    ("inertia", "iyy", 1),
    ("inertia", "iyz", 1),
    ("inertia", "izz", 1),
    ("sphere", "radius", 1),
    ("cylinder", "radius", 1),
    ("cylinder", "length", 1),
    ("capsule", "radius", 1),
    ("capsule", "length", 1),
    ("box", "size", 3),
    ("mesh", "scale", 3),
    ("limit", "lower", 1),
    ("limit", "upper", 1),
    ("limit", "effort", 1),
    ("limit", "velocity", 1),
    ("dynamics", "damping", 1),
    ("dynamics", "friction", 1),
    ("mimic", "multiplier", 1),
    ("mimic", "offset", 1),
    ("color", "rgba", 4),
    ("calibration", "rising", 1),
];

/// Kinds of joints of the format.
const KINDS: [&str; 7] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];

/// Deepest nesting of elements that is read: readers of trees of elements call themselves.
const DEEPEST: usize = 500;

/// Refuses elements in each other beyond that, before anything walks down.
pub(crate) fn check_depth(source: &Source) -> Result<(), Error> {
    let (text, mut depth, mut at) = (source.text, 0_usize, 0);
    while let Some(found) = text[at..].find('<').map(|k| at + k) {
        let rest = &text[found..];
        let end = |mark: &str| rest.find(mark).map_or(text.len(), |k| found + k + mark.len());
        if rest.starts_with("<!--") {
            at = end("-->");
        } else if rest.starts_with("<![CDATA[") {
            at = end("]]>");
        } else {
            at = found + tag_length(rest);
            let open = !rest.starts_with("</") && !rest.starts_with("<!") && !rest.starts_with("<?");
            if open && !text[found..at].ends_with("/>") {
                depth += 1;
            } else if rest.starts_with("</") {
                depth = depth.saturating_sub(1);
            }
        }
        if depth > DEEPEST {
            let line = 1 + text[..found].matches('\n').count();
            return Err(source.syntax(line, format!("elements lie more than {DEEPEST} deep in each other")));
        }
    }
    Ok(())
}

/// Length of a tag to its `>`; one in a quoted value does not end it.
fn tag_length(tag: &str) -> usize {
    let mut quote = None;
    for (k, c) in tag.char_indices() {
        match (quote, c) {
            (None, '>') => return k + 1,
            (None, '"' | '\'') => quote = Some(c),
            (Some(q), c) if q == c => quote = None,
            _ => {}
        }
    }
    tag.len()
}

/// Refuses text that is no XML or not URDF, attributes that are not there and numbers that are none.
pub(crate) fn check(source: &Source) -> Result<(), Error> {
    check_depth(source)?;
    let document =
        Document::parse(source.text).map_err(|e| source.syntax(e.pos().row as usize, e.to_string()))?;
    let wrong = |node: Node, problem: String| {
        let line = document.text_pos_at(node.range().start).row as usize;
        let element = called(node);
        Err(Error::Element { file: source.file.into(), line, element, problem })
    };
    let root = document.root_element();
    if !root.has_tag_name("robot") {
        return wrong(root, "the root of URDF is <robot>".into());
    }
    for node in root.children().filter(Node::is_element) {
        let needed: &[&str] = match node.tag_name().name() {
            "link" => &["name"],
            "joint" => &["name", "type"],
            _ => continue,
        };
        if let Some(lacks) = needed.iter().find(|a| node.attribute(**a).is_none()) {
            return wrong(node, format!("has no `{lacks}`"));
        }
        check_name(node).or_else(|problem| wrong(node, problem))?;
        if node.has_tag_name("joint") {
            joint(node).or_else(|problem| wrong(node, problem))?;
        }
        for below in node.descendants().filter(Node::is_element) {
            numbers(below).and_then(|()| values::check(below)).or_else(|problem| wrong(below, problem))?;
        }
    }
    Ok(())
}

/// Attributes that `urdf-rs` requires and that are optional in the format: element, attribute, value.
const LEFT_OUT: [(&str, &str, &str); 3] =
    [("limit", "effort", "0"), ("limit", "velocity", "0"), ("texture", "filename", "")];

/// The same for elements: the parent, the child, and its default.
const EMPTY: [(&str, &str, &str); 2] = [
    ("inertial", "mass", "<mass value=\"0\"/>"),
    ("inertial", "inertia", "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>"),
];

/// The text with declarations for its undeclared prefixes, which most readers of URDF tolerate; lines stay.
pub(crate) fn declared(text: &str) -> String {
    let mut text = text.to_owned();
    // More than any file has.
    for _ in 0..16 {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = Document::parse(&text) else { break };
        let Some(root) = text.find("<robot").map(|at| at + "<robot".len()) else { break };
        text.insert_str(root, &format!(" xmlns:{prefix}=\"{prefix}\""));
    }
    text
}

/// The text with these attributes; lines stay where they are.
pub(crate) fn complete(text: &str) -> String {
    let Ok(document) = Document::parse(text) else { return text.into() };
    let mut whole = String::with_capacity(text.len());
    let mut done = 0;
    for node in document.descendants().filter(Node::is_element) {
        let of_this = EMPTY.iter().filter(|(element, ..)| node.has_tag_name(*element));
        for (element, _, instead) in
            of_this.filter(|(_, name, _)| !node.children().any(|c| c.has_tag_name(*name)))
        {
            let start = node.range().start + 1 + element.len();
            let Some(end) = text[start..node.range().end].find('>').map(|k| start + k + 1) else { continue };
            // An empty `<inertial/>` has no inside.
            if !text[..end].ends_with("/>") {
                whole += &text[done..end];
                whole += instead;
                done = end;
            }
        }
        for (element, name, value) in LEFT_OUT {
            if node.has_tag_name(element) && node.attribute(name).is_none() {
                let at = node.range().start + 1 + element.len();
                whole += &text[done..at];
                whole += &format!(" {name}=\"{value}\"");
                done = at;
            }
        }
    }
    whole + &text[done..]
}

/// Tag and name of an element, or of the one around it that has a name.
fn called(node: Node) -> String {
    let tag = |n: Node| match n.attribute("name") {
        Some(name) => format!("<{}> `{name}`", n.tag_name().name()),
        None => format!("<{}>", n.tag_name().name()),
    };
    let around = node.ancestors().find(|n| n.attribute("name").is_some() && n.parent_element().is_some());
    match around.filter(|n| *n != node) {
        Some(owner) => format!("{} of {}", tag(node), tag(owner)),
        None => tag(node),
    }
}

fn joint(node: Node) -> Result<(), String> {
    let kind = node.attribute("type").unwrap_or_default();
    if !KINDS.contains(&kind) {
        return Err(format!(
            "type `{kind}` is unknown; use revolute, continuous, prismatic, planar, spherical or fixed"
        ));
    }
    for end in ["parent", "child"] {
        if !node.children().any(|n| n.has_tag_name(end) && n.attribute("link").is_some()) {
            return Err(format!("has no <{end} link=\"…\"/>"));
        }
    }
    Ok(())
}

fn numbers(node: Node) -> Result<(), String> {
    let of_this = NUMBERS.iter().filter(|(element, ..)| node.has_tag_name(*element));
    for (_, name, count) in of_this {
        let Some(text) = node.attribute(*name) else { continue };
        let read: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse::<f64>).collect();
        if !read.is_ok_and(|n| n.len() == *count) {
            let needed = if *count == 1 { "a number".into() } else { format!("{count} numbers") };
            return Err(format!("{name} = \"{text}\" is not {needed}"));
        }
    }
    Ok(())
}
