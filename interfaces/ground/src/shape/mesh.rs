//! The underside of a mesh that is not convex: the lowest of its triangles above a point, found through a tree of boxes.
//!
//! Inside and outside play no role, so an open mesh has an underside, too: that of its sheets.

use crate::math::{Rotation, cross, dot, scaled};

/// Corners of a mesh that stick out of the plane of a triangle by more than this part of its size make it not convex.
const FLAT: f64 = 1e-6;
/// A triangle whose part seen from above is smaller than this is a wall and no underside.
const WALL: f64 = 1e-10;
/// Triangles whose heights differ by less than this (m) meet there in an edge: the flatter one counts.
const EDGE: f64 = 1e-9;
/// Triangles in a leaf of the tree.
const LEAF: usize = 4;

/// Whether the triangles are the faces of a convex body: closed, and no corner outside the plane of any of them.
pub(crate) fn is_convex(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> bool {
    if !is_closed(triangles) {
        return false;
    }
    let size = points.iter().map(|p| dot(*p, *p)).fold(0.0, f64::max).sqrt();
    triangles.iter().filter_map(|t| super::face_of(points, t)).all(|face| {
        let beyond = |p: &[f64; 3]| dot(face.normal, *p) - face.offset > FLAT * size;
        !points.iter().any(beyond)
    })
}

/// Whether each edge is passed as often in one direction as in the other.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let edges = |turned: bool| {
        let of = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let all = triangles.iter().flat_map(of).map(|[a, b]| if turned { [b, a] } else { [a, b] });
        let mut all: Vec<[u32; 2]> = all.collect();
        all.sort_unstable();
        all
    };
    edges(false) == edges(true)
}

/// First intersection of a vertical line with a mesh, from below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Height above the origin of the mesh, m.
    pub z: f64,
    /// Normal of the triangle, world, looking down; any length.
    pub normal: [f64; 3],
}

/// The triangles of a mesh in a tree of boxes, in the mesh's own frame.
#[derive(Clone, Debug)]
pub(crate) struct MeshTree {
    triangles: Vec<Triangle>,
    branches: Vec<Branch>,
}

#[derive(Clone, Debug)]
struct Triangle {
    corners: [[f64; 3]; 3],
    /// Twice its area as a vector, m².
    normal: [f64; 3],
}

#[derive(Clone, Debug)]
struct Branch {
    centre: [f64; 3],
    half: [f64; 3],
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    /// First triangle and the one behind the last.
    Leaf(usize, usize),
    /// The branch behind this one, and another.
    Fork(usize),
}

impl MeshTree {
    /// Of the triangles that have an area.
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        let of = |t: &[u32; 3]| {
            super::face_of(points, t)?;
            let corners = t.map(|k| points[k as usize]);
            let edge = |k: usize| std::array::from_fn(|c| corners[k][c] - corners[0][c]);
            Some(Triangle { corners, normal: cross(edge(1), edge(2)) })
        };
        let triangles: Vec<Triangle> = triangles.iter().filter_map(of).collect();
        let mut tree = Self { triangles, branches: Vec::new() };
        if !tree.triangles.is_empty() {
            tree.grow(0, tree.triangles.len());
        }
        tree
    }

    /// Adds the branch of a range of triangles, halved along its longest side.
    fn grow(&mut self, first: usize, end: usize) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in self.triangles[first..end].iter().flat_map(|t| &t.corners) {
            low = std::array::from_fn(|k| low[k].min(p[k]));
            high = std::array::from_fn(|k| high[k].max(p[k]));
        }
        let half: [f64; 3] = std::array::from_fn(|k| 0.5 * (high[k] - low[k]));
        let centre = std::array::from_fn(|k| 0.5 * (high[k] + low[k]));
        let here = self.branches.len();
        self.branches.push(Branch { centre, half, kind: Kind::Leaf(first, end) });
        if end - first <= LEAF {
            return;
        }
        let axis = (0..3).fold(0, |best, k| if half[k] > half[best] { k } else { best });
        let middle = |t: &Triangle| t.corners.iter().map(|c| c[axis]).sum::<f64>();
        self.triangles[first..end].sort_by(|a, b| middle(a).total_cmp(&middle(b)));
        let split = first + (end - first) / 2;
        self.grow(first, split);
        self.branches[here].kind = Kind::Fork(self.branches.len());
        self.grow(split, end);
    }

    /// The lowest triangle above or below the point `at` (from the mesh's origin, world axes, m).
    pub fn lowest(&self, rotation: &Rotation, at: [f64; 2]) -> Option<Hit> {
        let mut best = None;
        // Halved ranges: no deeper than the bits of their length.
        let (mut stack, mut count) = ([0_usize; 65], usize::from(!self.branches.is_empty()));
        while count > 0 {
            count -= 1;
            let here = stack[count];
            let branch = &self.branches[here];
            if !branch.may_be_lower(rotation, at, best) {
                continue;
            }
            match branch.kind {
                Kind::Leaf(first, end) => {
                    let hits = self.triangles[first..end].iter().filter_map(|t| t.hit(rotation, at));
                    best = hits.fold(best, |best, hit| Some(lower(best, hit)));
                }
                Kind::Fork(other) => {
                    (stack[count], stack[count + 1]) = (other, here + 1);
                    count += 2;
                }
            }
        }
        best
    }
}

/// The lower one of two; on an edge the flatter one.
fn lower(best: Option<Hit>, hit: Hit) -> Hit {
    let Some(best) = best else { return hit };
    if (hit.z - best.z).abs() > EDGE {
        return if hit.z < best.z { hit } else { best };
    }
    let steep =
        |h: &Hit| (h.normal[0] * h.normal[0] + h.normal[1] * h.normal[1]) / (h.normal[2] * h.normal[2]);
    let normal = if steep(&hit) < steep(&best) { hit.normal } else { best.normal };
    Hit { z: hit.z.min(best.z), normal }
}

impl Branch {
    /// Whether the line at `at` meets the box lower than `best` or as low.
    fn may_be_lower(&self, rotation: &Rotation, at: [f64; 2], best: Option<Hit>) -> bool {
        let centre = rotation.to_world(self.centre);
        let half = |k: usize| -> f64 {
            let reach: f64 = (0..3).map(|c| rotation.0[c][k].abs() * self.half[c]).sum();
            reach + 1e-12 * (1.0 + centre[k].abs())
        };
        (centre[0] - at[0]).abs() <= half(0)
            && (centre[1] - at[1]).abs() <= half(1)
            && best.is_none_or(|b| centre[2] - half(2) <= b.z + EDGE)
    }
}

impl Triangle {
    /// Intersection with the line at `at`. Lines through a common edge meet at least one of its two triangles: both
    /// reckon it with the same numbers.
    fn hit(&self, rotation: &Rotation, at: [f64; 2]) -> Option<Hit> {
        let normal = rotation.to_world(self.normal);
        if normal[2].abs() <= WALL * dot(normal, normal).sqrt() {
            return None;
        }
        let p = self.corners.map(|c| {
            let w = rotation.to_world(c);
            [w[0] - at[0], w[1] - at[1], w[2]]
        });
        let turn = |a: [f64; 3], b: [f64; 3]| a[0] * b[1] - a[1] * b[0];
        let share = [turn(p[1], p[2]), turn(p[2], p[0]), turn(p[0], p[1])];
        let inside = share.iter().all(|s| *s >= 0.0) || share.iter().all(|s| *s <= 0.0);
        let whole = share[0] + share[1] + share[2];
        (inside && whole != 0.0).then(|| {
            let z = (share[0] * p[0][2] + share[1] * p[1][2] + share[2] * p[2][2]) / whole;
            Hit { z, normal: if normal[2] > 0.0 { scaled(normal, -1.0) } else { normal } }
        })
    }
}
