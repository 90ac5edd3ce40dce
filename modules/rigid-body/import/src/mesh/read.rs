//! Mesh files: STL, ascii and binary, and OBJ, by the crate `mesh-loader`; COLLADA by [`super::collada`].

use super::{Mesh, collada};
use mesh_loader::Loader;
use std::collections::BTreeMap;
use std::path::Path;

/// A file as it was read.
pub(crate) struct Loaded {
    pub mesh: Mesh,
    /// Remark on content of the file that has no effect.
    pub remark: Option<String>,
}

/// Reads all triangles of a file.
pub(crate) fn load(path: &Path) -> Result<Loaded, String> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let bytes = || terraglue_subsystem::files::read(path).map_err(|e| e.to_string());
    match ending.as_str() {
        "stl" | "obj" => Ok(Loaded { mesh: by_loader(path, &ending, &mut bytes()?)?, remark: None }),
        "dae" => {
            let text = String::from_utf8(bytes()?).map_err(|e| e.to_string())?;
            let scene = collada::read(&text)?;
            let mut mesh = Builder::default();
            scene.triangles.into_iter().for_each(|t| mesh.add(t));
            let remark = (scene.up != "Z_UP").then(|| {
                format!(
                    "<up_axis> {} is not heeded, as in RViz and Gazebo; turn it by <origin rpy=…>",
                    scene.up
                )
            });
            Ok(Loaded { mesh: mesh.finish()?, remark })
        }
        _ => Err(format!(
            "meshes of kind `.{ending}` cannot be read; convert it to STL, OBJ or COLLADA (.dae), which mesh editors write"
        )),
    }
}

/// Bytes of a binary STL file before its triangles, and of each triangle.
const STL: (usize, usize) = (84, 50);

/// Hides the header of a binary STL file that begins with the word of ascii ones: its length distinguishes them.
fn without_false_start(bytes: &mut [u8]) {
    let Some(count) = bytes.get(80..84).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes) else {
        return;
    };
    if bytes.len() == STL.0 + STL.1 * count as usize {
        bytes[..80].fill(b' ');
    }
}

/// A binary STL file that ends before its triangles do: half a mesh is another shape.
fn cut_off(bytes: &[u8]) -> Option<String> {
    let count = u32::from_le_bytes(bytes.get(80..84)?.try_into().ok()?);
    let there = (bytes.len() - STL.0) / STL.1;
    let begin = String::from_utf8_lossy(&bytes[..bytes.len().min(1024)]);
    let is_text = begin.trim_start().starts_with("solid") && begin.contains("facet");
    (!is_text && there < count as usize)
        .then(|| format!("it names {count} triangles and holds {there}: it was cut off; export it again"))
}

fn by_loader(path: &Path, ending: &str, bytes: &mut [u8]) -> Result<Mesh, String> {
    if ending == "stl" {
        without_false_start(bytes);
        if let Some(why) = cut_off(bytes) {
            return Err(why);
        }
    }
    // The loader chooses by the ending as it is written most often.
    let named = path.with_extension(ending);
    let scene = Loader::default().load_from_slice(bytes, &named).map_err(|e| e.to_string())?;
    let mut mesh = Builder::default();
    for part in &scene.meshes {
        for face in &part.faces {
            let corner = |k: u32| part.vertices.get(k as usize).map(|p| p.map(f64::from));
            let [Some(a), Some(b), Some(c)] = face.map(corner) else {
                return Err("a triangle names a corner that is not there".into());
            };
            mesh.add([a, b, c]);
        }
    }
    mesh.finish()
}

/// Corners as listed in a text, without triangles.
pub(crate) fn corners_of(numbers: &[f64]) -> Mesh {
    let points = numbers.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    Mesh { points, triangles: Vec::new() }
}

/// Joins corners at the same place, which STL repeats for every triangle.
#[derive(Default)]
struct Builder {
    mesh: Mesh,
    known: BTreeMap<[u64; 3], u32>,
}

impl Builder {
    fn add(&mut self, triangle: [[f64; 3]; 3]) {
        let corners = triangle.map(|p| {
            // 0 and −0 are the same place.
            let p = p.map(|x| x + 0.0);
            *self.known.entry(p.map(f64::to_bits)).or_insert_with(|| {
                self.mesh.points.push(p);
                self.mesh.points.len() as u32 - 1
            })
        });
        let [a, b, c] = corners;
        if a != b && b != c && c != a {
            self.mesh.triangles.push(corners);
        }
    }

    fn finish(self) -> Result<Mesh, String> {
        let mesh = self.mesh;
        if mesh.points.iter().flatten().any(|x| !x.is_finite()) {
            return Err("a corner is not finite".into());
        }
        if mesh.triangles.is_empty() { Err("it has no triangles".into()) } else { Ok(mesh) }
    }
}
