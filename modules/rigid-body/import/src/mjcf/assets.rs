//! Meshes and height fields of the `<asset>` section, from files or from the text.

use super::defaults::Defaults;
use crate::error::Error;
use crate::mesh::{Folders, Mesh, Solid, corners_of, load};
use crate::model::Heights;
use crate::shapes::hull_notice;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use roxmltree::Node;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Most nodes of a height field along one direction.
const MOST_NODES: u32 = 1 << 14;

/// An asset, or why there is none: that matters only where a shape needs it.
pub(super) type Asset<T> = Result<T, String>;

/// A mesh and its replacement on bodies that move.
pub(super) struct MeshAsset {
    pub triangles: Arc<Mesh>,
    pub hull: Arc<Mesh>,
    /// Whether it is convex.
    pub convex: bool,
    /// Solid for its mass: the enclosed one, or its hull if it is open.
    pub solid: Solid,
    /// Notice of the choice that was made.
    pub notice: String,
}

/// All of them by name.
#[derive(Default)]
pub(super) struct Assets {
    pub meshes: BTreeMap<String, Asset<MeshAsset>>,
    pub fields: BTreeMap<String, Asset<Arc<Heights>>>,
}

impl Assets {
    /// Reads the sections `<asset>`; `folders.beside` is that of the robot file.
    pub fn read(d: &Defaults, root: Node, folders: &Folders) -> Result<Self, Error> {
        let mut me = Self::default();
        let files = Files::new(root, folders);
        let sections = root.children().filter(|n| n.has_tag_name("asset"));
        for node in sections.flat_map(|n| n.children()).filter(Node::is_element) {
            match node.tag_name().name() {
                "mesh" => {
                    let (name, mesh) = me.mesh(d, node, &files)?;
                    me.meshes.insert(name, mesh);
                }
                "hfield" => {
                    let (name, field) = me.field(d, node, &files)?;
                    me.fields.insert(name, field);
                }
                _ => {}
            }
        }
        Ok(me)
    }

    fn mesh(&self, d: &Defaults, node: Node, files: &Files) -> Result<(String, Asset<MeshAsset>), Error> {
        let e = d.element(node, None);
        let file = node.attribute("file");
        let name = node.attribute("name").or_else(|| file.and_then(stem)).unwrap_or_default().to_owned();
        if self.meshes.contains_key(&name) || name.is_empty() {
            return Err(d.wrong(&e, "its name is empty or used twice".into()));
        }
        let read = match (file, d.numbers(&e, "vertex")?) {
            (Some(file), _) => files.mesh(file),
            (None, Some(numbers)) if numbers.len().is_multiple_of(3) => {
                let faces = d.numbers(&e, "face")?.unwrap_or_default();
                with_faces(corners_of(&numbers), &faces)
            }
            _ => Err("needs a file or a list of vertices, three numbers each".into()),
        };
        let scale = d.vector(&e, "scale")?.unwrap_or_else(|| Vector3::repeat(1.0));
        let (place, turn) = (d.vector(&e, "refpos")?, d.numbers(&e, "refquat")?);
        let turn = turn.unwrap_or_else(|| vec![1.0, 0.0, 0.0, 0.0]);
        let [w, i, j, k] = turn[..] else {
            return Err(d.wrong(&e, format!("refquat has {} numbers; four are needed", turn.len())));
        };
        let asset = read.and_then(|mesh| {
            let mut mesh = mesh.scaled(scale.into());
            let turn = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-9);
            let turn = turn.ok_or("refquat is 0")?.inverse();
            let place = place.unwrap_or_else(Vector3::zeros);
            mesh.points.iter_mut().for_each(|p| *p = (turn * (Vector3::from(*p) - place)).into());
            asset(mesh)
        });
        Ok((name, asset))
    }

    /// Heights are scaled to 0 … size[2], whatever their unit.
    fn field(&self, d: &Defaults, node: Node, files: &Files) -> Result<(String, Asset<Arc<Heights>>), Error> {
        let e = d.element(node, None);
        let file = node.attribute("file");
        let name = node.attribute("name").or_else(|| file.and_then(stem)).unwrap_or_default().to_owned();
        if self.fields.contains_key(&name) || name.is_empty() {
            return Err(d.wrong(&e, "its name is empty or used twice".into()));
        }
        let size = d.numbers(&e, "size")?.unwrap_or_default();
        let [x, y, z, _] = size[..] else {
            return Err(d.wrong(&e, "size needs four numbers: half lengths x and y, height, depth".into()));
        };
        if !(x > 0.0 && y > 0.0 && z > 0.0) {
            return Err(d.wrong(&e, format!("size = {size:?}: half lengths and height are positive")));
        }
        let grid = match file {
            Some(file) => files.grid(file),
            None => {
                let count = |name| d.count(&e, name, MOST_NODES).map(|n| n.unwrap_or(0) as usize);
                let nodes = [count("ncol")?, count("nrow")?];
                let text = d.numbers(&e, "elevation")?.unwrap_or_else(|| vec![0.0; nodes[0] * nodes[1]]);
                // The text starts with the row of the largest y.
                Ok((nodes, text.rchunks(nodes[0].max(1)).flatten().copied().collect()))
            }
        };
        let field = grid.and_then(|(nodes, heights)| {
            if nodes.iter().any(|n| *n < 2) || heights.len() != nodes[0] * nodes[1] {
                let [ncol, nrow] = nodes;
                return Err(format!(
                    "nrow = {nrow} times ncol = {ncol}, both at least 2, are not {}",
                    heights.len()
                ));
            }
            let (low, high) = (fold(&heights, f64::min), fold(&heights, f64::max));
            let per_unit = if high > low { z / (high - low) } else { 0.0 };
            let heights = heights.iter().map(|h| per_unit * (h - low)).collect();
            Ok(Arc::new(Heights { nodes, lengths: [2.0 * x, 2.0 * y], heights }))
        });
        Ok((name, field))
    }
}

fn fold(heights: &[f64], f: fn(f64, f64) -> f64) -> f64 {
    heights.iter().copied().reduce(f).unwrap_or(0.0)
}

fn asset(mesh: Mesh) -> Asset<MeshAsset> {
    let (hull, beyond) = mesh.hull()?;
    // Corners without triangles stand for their hull.
    let mesh = if mesh.triangles.is_empty() { hull.clone() } else { mesh };
    let solid = if mesh.is_closed() { mesh.solid() } else { hull.solid() };
    let convex = mesh.is_convex();
    let notice = hull_notice(&mesh, (&hull, beyond), convex);
    Ok(MeshAsset { triangles: Arc::new(mesh), hull: Arc::new(hull), convex, solid, notice })
}

fn with_faces(mut mesh: Mesh, faces: &[f64]) -> Asset<Mesh> {
    let corners = mesh.points.len() as f64;
    if !faces.len().is_multiple_of(3) || faces.iter().any(|k| k.fract() != 0.0 || *k < 0.0 || *k >= corners) {
        return Err("face: three numbers of vertices each".into());
    }
    mesh.triangles = faces.chunks_exact(3).map(|f| [f[0] as u32, f[1] as u32, f[2] as u32]).collect();
    Ok(mesh)
}

fn stem(file: &str) -> Option<&str> {
    Path::new(file).file_stem().and_then(|s| s.to_str())
}

/// Folders of the files of assets.
struct Files {
    folders: Folders,
    strip: bool,
}

impl Files {
    fn new(root: Node, folders: &Folders) -> Self {
        let compilers = || root.children().filter(|n| n.has_tag_name("compiler"));
        let text = |name: &str| compilers().filter_map(|c| c.attribute(name)).next_back().map(str::to_owned);
        let below = text("meshdir").or_else(|| text("assetdir")).unwrap_or_default();
        let folders = Folders { beside: folders.beside.join(below), ..folders.clone() };
        Self { folders, strip: text("strippath").as_deref() == Some("true") }
    }

    fn find(&self, file: &str) -> Asset<std::path::PathBuf> {
        let bare = Path::new(file).file_name().and_then(|f| f.to_str()).filter(|_| self.strip);
        self.folders.find(bare.unwrap_or(file)).map_err(|p| format!("`{file}`: {p}"))
    }

    fn mesh(&self, file: &str) -> Asset<Mesh> {
        let path = self.find(file)?;
        load(&path).map(|l| l.mesh).map_err(|p| format!("{}: {p}", path.display()))
    }

    /// MuJoCo's binary height field: rows and columns as i32, then f32 from the row of the smallest y on.
    fn grid(&self, file: &str) -> Asset<([usize; 2], Vec<f64>)> {
        let path = self.find(file)?;
        let at = |p: String| format!("{}: {p}", path.display());
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            let way_out = "a height field from an image is not read here; let [terrain] kind = \"png\" and ground = \
                           \"terrain\" do it, or write elevation = \"…\"";
            return Err(at(way_out.into()));
        }
        let bytes = terraglue_subsystem::files::read(&path).map_err(|e| at(e.to_string()))?;
        let words: Vec<[u8; 4]> = bytes.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
        let [rows, columns, rest @ ..] = words.as_slice() else {
            return Err(at("it is shorter than its head".into()));
        };
        let count = |w: &[u8; 4]| usize::try_from(i32::from_le_bytes(*w)).unwrap_or(0);
        let heights: Vec<f64> = rest.iter().map(|w| f64::from(f32::from_le_bytes(*w))).collect();
        if heights.iter().any(|h| !h.is_finite()) {
            return Err(at("a height is not finite".into()));
        }
        Ok(([count(columns), count(rows)], heights))
    }
}
