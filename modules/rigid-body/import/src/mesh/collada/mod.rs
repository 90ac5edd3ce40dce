//! COLLADA 1.4 and 1.5 (`.dae`): the triangles of the scene, each part as often as it is instantiated.
//!
//! Transforms of nodes and `<unit meter="…">` count. `<up_axis>` does not: RViz, Gazebo and MoveIt take coordinates as they
//! are, and robot files are made to look right there. Elements without triangles of their own (skins, splines, references
//! to other files) are refused by their line; materials, lights and cameras are ignored.

mod geometry;

use nalgebra::{Matrix4, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node};
use std::collections::HashMap;

/// Nodes within nodes; more are a circle of references.
const DEEPEST: usize = 64;

/// A triangle, m.
pub(super) type Triangle = [[f64; 3]; 3];

/// Contents of a file.
pub(super) struct Scene {
    pub triangles: Vec<Triangle>,
    /// Which axis the file calls up.
    pub up: String,
}

/// Reads the text of a file.
pub(super) fn read(text: &str) -> Result<Scene, String> {
    let document = Document::parse(text).map_err(|e| e.to_string())?;
    let root = document.root_element();
    if !root.has_tag_name("COLLADA") {
        return Err(wrong(root, "the root of COLLADA is <COLLADA>"));
    }
    let ids = document.descendants().filter_map(|n| Some((n.attribute("id")?, n))).collect();
    let asset = child(root, "asset");
    let unit = match asset.and_then(|a| child(a, "unit")).and_then(|u| Some((u, u.attribute("meter")?))) {
        None => 1.0,
        Some((u, text)) => {
            let length = text.parse().ok().filter(|m: &f64| *m > 0.0 && m.is_finite());
            length.ok_or_else(|| wrong(u, &format!("meter = \"{text}\" is not a length")))?
        }
    };
    let up =
        asset.and_then(|a| child(a, "up_axis")).and_then(|u| u.text()).unwrap_or("Y_UP").trim().to_owned();
    let mut reader = ColladaReader { ids, known: HashMap::new(), triangles: Vec::new() };
    reader.scene(root, &Matrix4::new_scaling(unit))?;
    Ok(Scene { triangles: reader.triangles, up })
}

/// Elements by id, geometries that were read, and the triangles found.
struct ColladaReader<'a> {
    ids: HashMap<&'a str, Node<'a, 'a>>,
    known: HashMap<&'a str, Vec<Triangle>>,
    triangles: Vec<Triangle>,
}

impl<'a> ColladaReader<'a> {
    fn scene(&mut self, root: Node<'a, 'a>, unit: &Matrix4<f64>) -> Result<(), String> {
        let wanted = child(root, "scene").and_then(|s| child(s, "instance_visual_scene"));
        let scene = match wanted {
            Some(instance) => Some(self.target(instance)?),
            None => root.descendants().find(|n| n.has_tag_name("visual_scene")),
        };
        if let Some(scene) = scene {
            return self.children(scene, unit, 0);
        }
        // A file without a scene is a list of parts in place.
        root.descendants().filter(|n| n.has_tag_name("geometry")).try_for_each(|g| self.add(g, unit))
    }

    /// All nodes directly within an element.
    fn children(&mut self, above: Node<'a, 'a>, place: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        above.children().filter(|n| n.has_tag_name("node")).try_for_each(|n| self.node(n, place, depth))
    }

    fn node(&mut self, node: Node<'a, 'a>, above: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        if depth > DEEPEST {
            return Err(wrong(node, "nodes refer to each other in a circle"));
        }
        let mut place = *above;
        for part in node.children().filter(Node::is_element) {
            if let Some(step) = transform(part)? {
                place *= step;
            }
        }
        for part in node.children().filter(Node::is_element) {
            match part.tag_name().name() {
                "instance_geometry" => {
                    let geometry = self.target(part)?;
                    self.add(geometry, &place)?;
                }
                "instance_node" => {
                    let other = self.target(part)?;
                    self.node(other, &place, depth + 1)?;
                }
                "instance_controller" => return Err(wrong(part, "skins and morphs are not read")),
                _ => {}
            }
        }
        self.children(node, &place, depth + 1)
    }

    /// Adds the triangles of a geometry in place; a mirrored one keeps its outside.
    fn add(&mut self, geometry: Node<'a, 'a>, place: &Matrix4<f64>) -> Result<(), String> {
        let id = geometry.attribute("id").unwrap_or_default();
        if !self.known.contains_key(id) || id.is_empty() {
            self.known.insert(id, geometry::triangles(geometry, &self.ids)?);
        }
        let mirrored = place.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        let put = |p: [f64; 3]| -> [f64; 3] { place.transform_point(&p.into()).into() };
        for [a, b, c] in self.known.get(id).into_iter().flatten() {
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            self.triangles.push([put(*a), put(*b), put(*c)]);
        }
        Ok(())
    }

    /// The element to which an instance refers.
    fn target(&self, instance: Node) -> Result<Node<'a, 'a>, String> {
        referred(&self.ids, instance, "url")
    }
}

/// The element that an attribute names.
fn referred<'a>(
    ids: &HashMap<&'a str, Node<'a, 'a>>,
    node: Node,
    name: &str,
) -> Result<Node<'a, 'a>, String> {
    let url = node.attribute(name).unwrap_or_default();
    let Some(id) = url.strip_prefix('#') else {
        return Err(wrong(
            node,
            &format!("{name} = \"{url}\" is not in this file; other files are not read"),
        ));
    };
    ids.get(id).copied().ok_or_else(|| wrong(node, &format!("there is no element with the id `{id}`")))
}

/// The transform from a node to its children, if this element is one.
fn transform(part: Node) -> Result<Option<Matrix4<f64>>, String> {
    let step = match part.tag_name().name() {
        "matrix" => Matrix4::from_row_slice(&numbers::<16>(part)?),
        "translate" => Matrix4::new_translation(&numbers::<3>(part)?.into()),
        "scale" => Matrix4::new_nonuniform_scaling(&numbers::<3>(part)?.into()),
        "rotate" => {
            let [x, y, z, degrees] = numbers::<4>(part)?;
            let axis = Unit::try_new(Vector3::new(x, y, z), 1e-12);
            axis.map_or(Matrix4::identity(), |a| Rotation3::from_axis_angle(&a, degrees.to_radians()).into())
        }
        "lookat" | "skew" => return Err(wrong(part, "is not read; let the mesh editor write <matrix>")),
        _ => return Ok(None),
    };
    Ok(Some(step))
}

/// Exactly so many finite numbers of an element's text.
fn numbers<const N: usize>(node: Node) -> Result<[f64; N], String> {
    let all = list::<f64>(node)?;
    let finite = all.iter().all(|x| x.is_finite());
    all.try_into()
        .ok()
        .filter(|_| finite)
        .ok_or_else(|| wrong(node, &format!("does not hold {N} finite numbers")))
}

/// All numbers of an element's text.
fn list<T: std::str::FromStr>(node: Node) -> Result<Vec<T>, String> {
    let bad = |word: &str| wrong(node, &format!("`{word}` is not a number that can stand here"));
    let words = node.text().unwrap_or_default().split_ascii_whitespace();
    words.map(|w| w.parse().map_err(|_| bad(w))).collect()
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|n| n.has_tag_name(name))
}

/// Error of an element, after its line and name.
fn wrong(node: Node, problem: &str) -> String {
    let line = node.document().text_pos_at(node.range().start).row;
    let name = node.attribute("id").map(|n| format!(" `{n}`")).unwrap_or_default();
    format!("line {line}: <{}>{name}: {problem}", node.tag_name().name())
}
