//! The faces of a convex mesh at its pose, as heights over a point: the underside is the highest of the planes that look down.

use super::Face;
use super::lower::WALL;
use super::slope::EDGE;
use crate::math::Rotation;

/// Planes that are evaluated side by side.
const LANES: usize = 4;

/// The faces by the side they look to; world axes, relative to the origin of the mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Planes {
    down: PlaneLanes,
    up: PlaneLanes,
    /// n·(x, y) ≤ offset inside: x and y of the normal, offset.
    walls: Vec<[f64; 3]>,
}

/// Planes z = a·x + b·y + c, whole lanes of them.
#[derive(Clone, Debug, Default)]
struct PlaneLanes {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Planes {
    /// For `faces`, at no pose yet.
    pub fn reserved(faces: &[Face]) -> Self {
        let heights = || {
            let lane = || Vec::with_capacity(faces.len() + LANES);
            PlaneLanes { a: lane(), b: lane(), c: lane() }
        };
        Self { down: heights(), up: heights(), walls: Vec::with_capacity(faces.len()) }
    }

    /// Turns the faces; does not allocate.
    pub fn turn(&mut self, faces: &[Face], rotation: &Rotation) {
        self.down.clear();
        self.up.clear();
        self.walls.clear();
        for face in faces {
            let [x, y, z] = rotation.to_world(face.normal);
            if z < -WALL {
                self.down.push([-x / z, -y / z, face.offset / z]);
            } else if z > WALL {
                self.up.push([-x / z, -y / z, face.offset / z]);
            } else {
                self.walls.push([x, y, face.offset]);
            }
        }
        self.down.fill_lane(f64::NEG_INFINITY);
        self.up.fill_lane(f64::INFINITY);
    }

    /// Height of the highest plane that looks down.
    fn highest_down(&self, x: f64, y: f64) -> f64 {
        self.down.fold(f64::NEG_INFINITY, x, y, |best, z| if z > best { z } else { best })
    }

    /// Height of the underside; none where the vertical line misses the mesh.
    pub fn lower(&self, x: f64, y: f64) -> Option<f64> {
        let low = self.highest_down(x, y);
        let high = self.up.fold(f64::INFINITY, x, y, |best, z| if z < best { z } else { best });
        let between_walls = self.walls.iter().all(|[a, b, offset]| a * x + b * y <= *offset);
        (between_walls && low <= high && low.is_finite()).then_some(low)
    }

    /// Slope of the underside at (x, y); on an edge, that of the flattest face.
    pub fn slope(&self, x: f64, y: f64) -> [f64; 2] {
        let low = self.highest_down(x, y);
        let steepness = |[a, b]: [f64; 2]| a * a + b * b;
        let meeting = self.down.at(x, y).filter(|(z, _)| *z >= low - EDGE).map(|(_, slope)| slope);
        meeting.min_by(|one, other| steepness(*one).total_cmp(&steepness(*other))).unwrap_or_default()
    }
}

impl PlaneLanes {
    fn clear(&mut self) {
        [&mut self.a, &mut self.b, &mut self.c].into_iter().for_each(Vec::clear);
    }

    fn push(&mut self, [a, b, c]: [f64; 3]) {
        self.a.push(a);
        self.b.push(b);
        self.c.push(c);
    }

    /// Fills the last lane with planes that never count.
    fn fill_lane(&mut self, beyond: f64) {
        while !self.a.len().is_multiple_of(LANES) {
            self.push([0.0, 0.0, beyond]);
        }
    }

    /// The best of the heights at (x, y).
    fn fold(&self, none: f64, x: f64, y: f64, better: impl Fn(f64, f64) -> f64) -> f64 {
        let mut best = [none; LANES];
        let lanes = |v| <[f64]>::as_chunks::<LANES>(v).0;
        for ((a, b), c) in lanes(&self.a).iter().zip(lanes(&self.b)).zip(lanes(&self.c)) {
            for k in 0..LANES {
                best[k] = better(best[k], a[k] * x + b[k] * y + c[k]);
            }
        }
        best.into_iter().fold(none, better)
    }

    /// Height at (x, y) and slope of each plane.
    fn at(&self, x: f64, y: f64) -> impl Iterator<Item = (f64, [f64; 2])> {
        let planes = self.a.iter().zip(&self.b).zip(&self.c);
        planes.map(move |((a, b), c)| (a * x + b * y + c, [*a, *b]))
    }
}
