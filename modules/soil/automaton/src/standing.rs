//! Which steep slopes stand by cohesion: those whose whole steep run is no higher than the critical height.
//!
//! A vertical face of soil with cohesion c stands up to H_c = (4c/γ)·tan(45° + φ/2) (Rankine 1857; Terzaghi 1943). On a lattice
//! a face may lie between two nodes or be spread over several, so the height that counts is that of the run: of all faces one
//! behind the other along a row or a column that are steeper than the angle of repose and fall to the same side.
//!
//! Loose soil has c' = ⅔·c and tan φ' = ⅔·tan φ (Terzaghi 1943, art. 46) once it has come to rest, and stands on runs
//! up to the height H_c' of these; on higher ones, and while it moves, it slides down to the angle of repose.

use crate::span::Span;
use terraglue_soil_contact::Ground;

/// Soil that may flow over a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Face {
    /// Everything.
    #[default]
    Falls,
    /// Loose soil; cohesion holds the rest.
    Sheds,
    /// Moving soil: loose soil at rest has cohesion, too.
    Stands,
    /// Nothing: an adjacent node is not visited.
    Waits,
}

/// Limits the fluxes to those allowed over the faces; `free` returns how much of both nodes of a face cohesion does not hold
/// there, units. A node has four faces, and each takes a quarter of it at most.
#[inline(always)]
pub fn hold(flux: &mut [i32], faces: &[Face], free: impl Fn(usize, Face) -> [i32; 2]) {
    for (k, (q, face)) in flux.iter_mut().zip(faces).enumerate() {
        match face {
            Face::Falls => {}
            Face::Waits => *q = 0,
            Face::Sheds | Face::Stands if *q != 0 => {
                let [from, to] = free(k, *face);
                *q = (*q).max(-(to >> 2)).min(from >> 2);
            }
            Face::Sheds | Face::Stands => {}
        }
    }
}

/// Largest distance for which a run is followed outside a window, nodes.
const FARTHEST: i32 = 4096;

/// Levels of a window and the part that lies on the lattice.
pub struct Field<'a> {
    /// Row after row.
    pub levels: &'a [i32],
    /// Of the bed below loose soil, row after row.
    pub beds: &'a [i32],
    /// Of the soil at rest below moving soil, row after row.
    pub resting: &'a [i32],
    /// Numbers from a row to the next.
    pub stride: usize,
    /// Columns on the lattice.
    pub columns: Span,
    /// Rows on the lattice.
    pub rows: Span,
    /// Column of the first node of the window.
    pub left: usize,
    /// Smallest Δ·tan φ_r, units.
    pub least: f32,
    /// Units that each node admits, row after row; 0: it is closed. Empty: all are open.
    pub inlets: &'a [i32],
}

/// The faces that stand, and how the slopes at the border of a window go on outside.
#[derive(Clone, Debug, Default)]
pub struct Standing {
    /// By the node at whose right (upper) side the face lies; empty: nothing was looked for.
    along: Vec<Face>,
    across: Vec<Face>,
    /// Nodes next to the visited ones that a falling run reaches, per row.
    pub wake: Vec<Span>,
    /// Fall of the run that touches the border outside the window, units, positive towards larger indices: at the left
    /// and right of every row, below and above every column.
    beyond: [Vec<i32>; 4],
}

fn refill(out: &mut Vec<i32>, from: impl Iterator<Item = i32>) {
    out.clear();
    out.extend(from);
}

/// Faces one behind the other.
#[derive(Clone, Copy)]
struct Run {
    first: usize,
    step: usize,
    count: usize,
}

impl Field<'_> {
    /// Whether soil above the levels `held` on the higher of two nodes would slide by a unit or two at least; `aside` leads to
    /// their neighbours.
    fn sheds(&self, a: usize, b: usize, aside: usize, held: &[i32]) -> bool {
        let h = self.levels;
        if [a, b].iter().any(|k| self.inlets.get(*k) == Some(&0)) {
            return false;
        }
        let high = if h[a] > h[b] { a } else { b };
        let along = (f64::from(h[a]) - f64::from(h[b])).abs();
        let slope = |k: usize| f64::from(h[k + aside]) - f64::from(h[k - aside]);
        let steep = along.hypot(0.25 * (slope(a) + slope(b)));
        let flux = 0.25 * (steep - f64::from(self.least)) * along / steep.max(1.0);
        h[high] - held[high] >= 8 && flux >= 2.0
    }
}

impl Standing {
    /// Room for windows of `rows` rows with `stride` numbers each.
    pub fn with_capacity(rows: usize, stride: usize) -> Self {
        let faces = || Vec::with_capacity(rows * stride);
        let beyond = std::array::from_fn(|_| Vec::with_capacity(rows.max(stride)));
        Self { along: faces(), across: faces(), wake: Vec::with_capacity(rows), beyond }
    }

    /// Clears the marks of all faces.
    pub fn clear(&mut self) {
        self.along.clear();
        self.across.clear();
    }

    /// Whether the faces along a row stand, from place `at` on; `None`: they do not.
    pub fn along(&self, at: usize, count: usize) -> Option<&[Face]> {
        self.along.get(at..at + count)
    }

    /// The same of the faces to the next row.
    pub fn across(&self, at: usize, count: usize) -> Option<&[Face]> {
        self.across.get(at..at + count)
    }

    /// Follows the slopes at the border of the window whose first node is `origin` out of it.
    pub fn look_beyond(&mut self, ground: &Ground, origin: [i32; 2], size: [usize; 2], thr: i32) {
        let lattice = *ground.heights.lattice();
        let unit = |i: i32, j: i32| {
            let (i, j) = lattice.clamp(i, j);
            ground.heights.units(i as i32, j as i32)
        };
        let follow = |[i, j]: [i32; 2], [di, dj]: [i32; 2]| {
            let (mut fall, mut at) = (0, unit(i, j));
            for k in 1..FARTHEST {
                let next = unit(i + k * di, j + k * dj);
                let step = at - next;
                if step.abs() <= thr || fall != 0 && (step > 0) != (fall > 0) {
                    break;
                }
                (fall, at) = (fall + step, next);
            }
            fall
        };
        let last = [origin[0] + size[0] as i32 - 1, origin[1] + size[1] as i32 - 1];
        let rows = || (0..size[1] as i32).map(|y| origin[1] + y);
        let columns = || (0..size[0] as i32).map(|x| origin[0] + x);
        let [left, right, below, above] = &mut self.beyond;
        refill(left, rows().map(|j| -follow([origin[0], j], [-1, 0])));
        refill(right, rows().map(|j| follow([last[0], j], [1, 0])));
        refill(below, columns().map(|i| -follow([i, origin[1]], [0, -1])));
        refill(above, columns().map(|i| follow([i, last[1]], [0, 1])));
    }

    /// Marks the faces that stand; `thr`: Δ·tan φ_r at a place, units; `critical`: H_c and H_c', units. A run is longer than the part
    /// that its nodes see: over a face with a node that is not visited (`active`: columns by row) nothing flows yet, and the node is
    /// woken.
    pub fn find(&mut self, field: &Field, active: &[Span], thr: impl Fn(usize) -> f32, critical: [i32; 2]) {
        self.along.clear();
        self.along.resize(field.levels.len(), Face::Falls);
        self.across.clear();
        self.across.resize(field.levels.len(), Face::Falls);
        let (stride, left) = (field.stride, field.left);
        let [x, y] = [field.columns, field.rows];
        let outside = |side: usize, k: usize| self.beyond[side].get(k).copied().unwrap_or(0);
        for row in y.lo..y.hi {
            let run = Run { first: row * stride + x.lo, step: 1, count: x.len() };
            let ends = [outside(0, row), outside(1, row)];
            mark(field, run, stride, &thr, ends, critical, &mut self.along);
        }
        for column in x.lo..x.hi {
            let run = Run { first: y.lo * stride + column, step: stride, count: y.len() };
            let ends = [outside(2, column - left), outside(3, column - left)];
            mark(field, run, 1, &thr, ends, critical, &mut self.across);
        }
        self.wait_for_sleepers(field, active);
    }

    fn wait_for_sleepers(&mut self, field: &Field, active: &[Span]) {
        let Field { stride, columns, rows, .. } = *field;
        let is_active = |x: usize, y: usize| active[y].lo <= x && x < active[y].hi;
        self.wake.clear();
        self.wake.resize(active.len(), Span::NONE);
        for y in rows.lo..rows.hi {
            for x in columns.lo..columns.hi {
                let at = y * stride + x;
                for (stands, beside, aside) in
                    [(&mut self.along[at], [x + 1, y], stride), (&mut self.across[at], [x, y + 1], 1)]
                {
                    let [here, there] = [is_active(x, y), is_active(beside[0], beside[1])];
                    if here && there {
                        continue;
                    }
                    let before = std::mem::replace(stands, Face::Waits);
                    let inside = beside[0] < columns.hi && beside[1] < rows.hi;
                    let there_at = beside[1] * stride + beside[0];
                    let flows = match before {
                        Face::Falls => true,
                        Face::Sheds => field.sheds(at, there_at, aside, field.beds),
                        Face::Stands | Face::Waits => field.sheds(at, there_at, aside, field.resting),
                    };
                    if inside && flows && (here || there) {
                        let [x, y] = if here { beside } else { [x, y] };
                        self.wake[y] = self.wake[y].hull(Span { lo: x, hi: x + 1 });
                    }
                }
            }
        }
    }
}

/// Marks the standing faces of a row or column; `aside` leads to the adjacent nodes, `ends` fall outside at both ends.
fn mark(
    field: &Field,
    run: Run,
    aside: usize,
    thr: &impl Fn(usize) -> f32,
    ends: [i32; 2],
    critical: [i32; 2],
    stands: &mut [Face],
) {
    let h = field.levels;
    let face = |k: usize| run.first + k * run.step;
    // the fall over face k where it is steep, in whole units
    let fall = |k: usize| -> i64 {
        let (a, b) = (face(k), face(k + 1));
        let along = i64::from(h[a]) - i64::from(h[b]);
        let beside = i64::from(h[a + aside]) - i64::from(h[a - aside]) + i64::from(h[b + aside])
            - i64::from(h[b - aside]);
        let (n, t) = (along as f64, 0.25 * beside as f64);
        let thr = f64::from(thr(if along > 0 { a } else { b }));
        if n * n + t * t > thr * thr { along } else { 0 }
    };
    let faces = run.count.saturating_sub(1);
    let mut k = 0;
    while k < faces {
        let first = fall(k);
        if first == 0 {
            stands[face(k)] = Face::Stands;
            k += 1;
            continue;
        }
        let (begin, mut height) = (k, 0);
        while k < faces {
            let next = fall(k);
            if next == 0 || (next > 0) != (first > 0) {
                break;
            }
            height += next;
            k += 1;
        }
        for (touches, end) in [(begin == 0, ends[0]), (k == faces, ends[1])] {
            let end = i64::from(end);
            height += if touches && (end > 0) == (first > 0) { end } else { 0 };
        }
        let [firm, loose] = critical.map(|critical| height.abs() <= i64::from(critical));
        let state = match (firm, loose) {
            (true, true) => Face::Stands,
            (true, false) => Face::Sheds,
            _ => Face::Falls,
        };
        (begin..k).for_each(|k| stands[face(k)] = state);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A window of a wall of height `high` spread over `cells` faces, at the angle of repose of `thr` units a cell.
    fn wall(high: i32, cells: i32, critical: i32) -> (Vec<Face>, Vec<Face>) {
        let (stride, size) = (40, 40);
        let level = |x: i32| high * (x - 15).clamp(0, cells) / cells;
        let levels: Vec<i32> = (0..size).flat_map(|_| (0..stride).map(level)).collect();
        let span = Span { lo: 2, hi: 38 };
        let (beds, resting, least) = (&levels, &levels, 50.0);
        let field = Field {
            levels: &levels,
            beds,
            resting,
            stride: 40,
            columns: span,
            rows: span,
            left: 2,
            least,
            inlets: &[],
        };
        let mut standing = Standing::default();
        standing.find(&field, &[span; 40], |_| 50.0, [critical, critical / 2]);
        let row = standing.along(20 * 40 + 14, cells as usize + 2).map(<[Face]>::to_vec);
        (row.unwrap_or_default(), standing.across.clone())
    }

    #[test]
    fn a_wall_stands_up_to_the_critical_height_however_it_lies_on_the_lattice() {
        for cells in [1, 2, 3, 5] {
            // the level faces next to the wall stand
            let count =
                |high: i32, state: Face| wall(high, cells, 1000).0.iter().filter(|s| **s == state).count();
            assert_eq!(count(990, Face::Falls), 0, "{cells}");
            assert_eq!(count(2000, Face::Falls), cells as usize, "{cells}");
            // loose soil stands as long as it has not to stand as high as the bed
            assert_eq!(count(990, Face::Sheds), cells as usize, "{cells}");
            assert_eq!(count(490, Face::Sheds), 0, "{cells}");
        }
    }
}
