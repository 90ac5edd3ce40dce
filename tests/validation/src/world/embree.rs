//! The same triangles in Embree, installed by name: where rays meet them, and how many it casts in a second.
//!
//! Only in the long run. Embree computes in single precision, so a ray at an edge may meet a shape that it misses here.

use super::scenes::{cast, stand, told};
use super::{Context, Figure, Limit};
use crate::process::{Outcome, command, root, target};
use random_scenes::{Heights, Stand, lend, sweep};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Stdio};
use terraglue_ground::{Rotation, compose};
use terraglue_subsystem::{BodyState, Geometry, Material, Pose, Ray, Scene, SceneBody, SceneShape};
use terraglue_world::WorldBuilder;

const SCRIPT: &str = "tests/validation/src/world/embree.py";
const SCENE: &str = "synthetic/synthetic_wef_scene.npz";
/// Sides of a stem in Embree.
const SIDES: u32 = 8;

/// Corners of a triangle, m.
pub type Triangle = [[f64; 3]; 3];

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if context.quick {
        return Ok(Vec::new());
    }
    std::fs::create_dir_all(&context.scratch).map_err(|e| e.to_string())?;
    if let Err(why) = python() {
        return Ok(vec![Figure::skipped("world.embree", why)]);
    }
    let mut out = own(context)?;
    match std::env::var_os("TERRAGLUE_FOREST_DATA") {
        Some(folder) => out.extend(synthetic(context, &Path::new(&folder).join(SCENE))?),
        None => out.push(Figure::skipped("world.embree.synthetic", "TERRAGLUE_FOREST_DATA is not set")),
    }
    Ok(out)
}

/// The drawn stand, its stems as triangles on either side.
fn own(context: &Context) -> Outcome<Vec<Figure>> {
    let trees = Stand::new(1, 250);
    let mut scene = trees.scene.clone();
    scene.shapes.iter_mut().for_each(|s| s.geometry = with_sides(&s.geometry));
    let world = stand(&trees, &scene, None)?;
    let rays = both(above(&trees));
    let found: Vec<f64> = cast(&world, &rays).iter().map(|hit| hit.distance).collect();
    let triangles = triangles_of(&trees);
    let embree = Embree::start(&context.scratch, &triangles, &rays)?;
    Ok(compared("stand", "a drawn stand of 250 trees", &found, &embree.distances))
}

/// 242 trees of a real stand; its ground as a field of heights.
fn synthetic(context: &Context, file: &Path) -> Outcome<Vec<Figure>> {
    let unpacked = context.scratch.join("synthetic");
    let mut script = command(python()?, &[SCRIPT, "unpack"]);
    let output = script.current_dir(root()).arg(file).arg(&unpacked).output().map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let told_of: Vec<f64> = result(&text).split(' ').filter_map(|x| x.parse().ok()).collect();
    let [ground, x, y] = told_of[..] else {
        return Err(format!("{}: {}", file.display(), String::from_utf8_lossy(&output.stderr).trim()));
    };
    let triangles = read(&unpacked)?;
    let triangles: Vec<Triangle> = triangles
        .as_chunks::<9>()
        .0
        .iter()
        .map(|t| std::array::from_fn(|i| std::array::from_fn(|k| t[3 * i + k])))
        .collect();
    let (ground, plants) = triangles.split_at(ground as usize);
    let heights = heights_of(ground);
    let mut builder = WorldBuilder::new();
    let scene = Scene {
        bodies: vec![SceneBody { name: "plants".into(), mass: 0.0 }],
        shapes: vec![SceneShape {
            id: 0,
            body: 0,
            name: "plants".into(),
            geometry: mesh(plants),
            body_from_shape: Pose::IDENTITY,
            collides: false,
            material: Material::UNKNOWN,
        }],
        joints: Vec::new(),
    };
    told(builder.subsystem("plants", &scene, &[BodyState::REST], &[true]))?;
    told(builder.ground(0, &heights.info()))?;
    let mut world = builder.build(0.0);
    let tiles = heights.tiles();
    told(world.update([0.0; 2]).ground(0, lend(&tiles, &heights, 1)))?;
    let node = |v: f64, k: usize| ((v - heights.origin[k]) / heights.spacing).round() as u32;
    let rays = both([x, y, heights.at(node(x, 0), node(y, 1)) + 2.0]);
    let found: Vec<f64> = cast(&world, &rays).iter().map(|hit| hit.distance).collect();
    let embree = Embree::start(&context.scratch, &triangles, &rays)?;
    Ok(compared("synthetic", "242 trees of a real stand", &found, &embree.distances))
}

fn compared(id: &str, of: &str, own: &[f64], theirs: &[f64]) -> Vec<Figure> {
    let seen = |x: f64| x <= 120.0;
    let count = |all: &[f64]| all.iter().filter(|x| seen(**x)).count() as f64;
    let hits = (count(own) / count(theirs) - 1.0).abs();
    let both = own.iter().zip(theirs).filter(|(a, b)| seen(**a) && seen(**b));
    let mut off: Vec<f64> = both.map(|(a, b)| 1e3 * (a - b).abs()).collect();
    off.sort_by(f64::total_cmp);
    let p99 = off.get(off.len() * 99 / 100).copied().unwrap_or(f64::NAN);
    let figure = |name: &str, value, limit, what: String| {
        Figure::new(format!("world.embree.{id}.{name}"), value, Limit::AtMost(limit), what)
    };
    let rays = own.len();
    vec![
        figure(
            "hits",
            hits,
            1e-3,
            format!("hits of {rays} rays in {of}, their number over Embree's, from 1"),
        ),
        figure(
            "p99",
            p99,
            1.0,
            format!("mm between the distances here and in Embree, 99th percentile, {of}"),
        ),
    ]
}

/// Turns of a scanner with 16 lasers and of one with 64.
pub fn both(at: [f64; 3]) -> Vec<Ray> {
    [vlp16(at), os1_64(at)].concat()
}

/// A turn of a scanner with 16 lasers.
pub fn vlp16(at: [f64; 3]) -> Vec<Ray> {
    sweep(at, 1800, 16, [-15.0, 15.0], [0.0; 2])
}

/// A turn of a scanner with 64 lasers.
pub fn os1_64(at: [f64; 3]) -> Vec<Ray> {
    sweep(at, 1024, 64, [-22.5, 22.5], [0.0; 2])
}

/// Two metres above the middle of a stand.
pub fn above(stand: &Stand) -> [f64; 3] {
    let middle = stand.heights.size.map(|n| n / 2);
    [0.0, 0.0, stand.heights.at(middle[0], middle[1]) + 2.0]
}

/// All triangles of a stand in the world, with stems that have sides.
pub fn triangles_of(stand: &Stand) -> Vec<Triangle> {
    let mut all: Vec<Triangle> = stand.heights.triangles().collect();
    for shape in &stand.scene.shapes {
        let world_from_body = &stand.states[shape.body as usize].world_from_body;
        let at = compose(world_from_body, &shape.body_from_shape);
        let rotation = Rotation::from_quaternion(at.orientation);
        let Geometry::Mesh { points, triangles } = with_sides(&shape.geometry) else { continue };
        let world = |k: &u32| {
            let turned = rotation.to_world(points[*k as usize]);
            std::array::from_fn(|k| turned[k] + at.position[k])
        };
        all.extend(triangles.iter().map(|[a, b, c]| [world(a), world(b), world(c)]));
    }
    all
}

/// A cone without its tip as triangles; everything else as it is.
fn with_sides(geometry: &Geometry) -> Geometry {
    let Geometry::ConeFrustum { half_length, radius_bottom, radius_top } = geometry else {
        return geometry.clone();
    };
    let corner = |k: u32, z: f64, radius: f64| {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(SIDES);
        [radius * libm::cos(angle), radius * libm::sin(angle), z]
    };
    let bottom = (0..SIDES).map(|k| corner(k, -half_length, *radius_bottom));
    let top = (0..SIDES).map(|k| corner(k, *half_length, *radius_top));
    let points = bottom.chain(top).collect();
    let side = |k: u32| {
        let next = (k + 1) % SIDES;
        [[k, next, SIDES + k], [next, SIDES + next, SIDES + k]]
    };
    Geometry::Mesh { points, triangles: (0..SIDES).flat_map(side).collect() }
}

fn mesh(triangles: &[Triangle]) -> Geometry {
    let numbers = (0..triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]);
    Geometry::Mesh { points: triangles.as_flattened().to_vec(), triangles: numbers.collect() }
}

/// Heights at the corners of triangles over a square lattice.
fn heights_of(triangles: &[Triangle]) -> Heights {
    let points = triangles.as_flattened();
    let origin = [0, 1].map(|k| points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min));
    let end = [0, 1].map(|k| points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max));
    let cells = ((triangles.len() / 2) as f64).sqrt().round();
    let spacing = (end[0] - origin[0]) / cells;
    let size = [cells as u32 + 1; 2];
    let mut values = vec![f64::NAN; (size[0] * size[1]) as usize];
    for p in points {
        let [i, j] = [0, 1].map(|k| ((p[k] - origin[k]) / spacing).round() as usize);
        values[j * size[0] as usize + i] = p[2];
    }
    Heights { origin, spacing, size, values }
}

/// Embree with triangles and rays in another process.
pub struct Embree {
    child: Child,
    ask: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    /// Where the rays meet the triangles, m.
    pub distances: Vec<f64>,
}

impl Embree {
    /// Starts it and casts the rays once.
    pub fn start(scratch: &Path, triangles: &[Triangle], rays: &[Ray]) -> Outcome<Self> {
        let places = ["triangles", "rays", "distances"].map(|name| scratch.join(format!("embree-{name}")));
        write(&places[0], triangles.as_flattened().as_flattened())?;
        let numbers: Vec<f64> = rays.iter().flat_map(|r| r.origin.into_iter().chain(r.direction)).collect();
        write(&places[1], &numbers)?;
        let mut script = command(python()?, &[SCRIPT, "cast"]);
        script.current_dir(root()).args(&places).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = script.spawn().map_err(|e| format!("Embree did not start: {e}"))?;
        let (ask, answers) = (child.stdin.take(), child.stdout.take());
        let answers = BufReader::new(answers.ok_or("Embree has no output")?);
        let mut this = Self { child, ask, answers, distances: Vec::new() };
        this.answer()?;
        this.distances = read(&places[2])?;
        Ok(this)
    }

    /// CPU time of one round, s.
    pub fn round(&mut self) -> Outcome<f64> {
        let ask = self.ask.as_mut().ok_or("Embree has no input")?;
        ask.write_all(b"\n").and_then(|()| ask.flush()).map_err(|e| format!("Embree: {e}"))?;
        self.answer()?.parse().map_err(|e| format!("Embree: {e}"))
    }

    fn answer(&mut self) -> Outcome<String> {
        let mut line = String::new();
        self.answers.read_line(&mut line).map_err(|e| format!("Embree: {e}"))?;
        match result(&line) {
            "" => Err("Embree ended without an answer".into()),
            answer => Ok(answer.to_owned()),
        }
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        drop(self.ask.take());
        // it ends with its input
        let _ = self.child.wait();
    }
}

/// The text after `RESULT`.
fn result(text: &str) -> &str {
    text.lines().find_map(|line| line.strip_prefix("RESULT ")).unwrap_or_default().trim()
}

fn write(path: &Path, numbers: &[f64]) -> Outcome {
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}

fn read(path: &Path) -> Outcome<Vec<f64>> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect())
}

/// The Python of `target/peers-world`, with embreex.
pub fn python() -> Outcome<PathBuf> {
    let folder = target().join("peers-world");
    let python = folder.join("bin/python");
    let run = |program: &Path, arguments: &[&str]| {
        let done = command(program, arguments).stdout(Stdio::null()).stderr(Stdio::null()).status();
        done.is_ok_and(|s| s.success())
    };
    let has = || run(&python, &["-c", "import embreex, numpy"]);
    if has() {
        return Ok(python);
    }
    let made = run("python3".as_ref(), &["-m", "venv", "--clear", &folder.display().to_string()]);
    if made && run(&python, &["-m", "pip", "install", "--quiet", "embreex", "numpy"]) && has() {
        return Ok(python);
    }
    Err("Embree is not here: `pip install embreex` did not work".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_is_there() {
        assert!(root().join(SCRIPT).exists());
    }

    #[test]
    fn a_surface_that_is_taken_apart_is_put_together_again() {
        let heights = Stand::new(3, 1).heights;
        let again = heights_of(&heights.triangles().collect::<Vec<_>>());
        assert!(again.size == heights.size && (again.spacing - heights.spacing).abs() < 1e-12);
        assert_eq!(again.values, heights.values);
    }
}
