//! The underside of a body within the cell of a node: how high it lies in the mean, how far it spreads about it, which way it looks.
//!
//! A node knows the underside at one point and its slope there. Under an edge, a narrow strip or a round body that is not much
//! broader than a cell this misrepresents the contact: of a wedge that comes down edge first a single node would see all of its
//! depth or none. So the underside is put together from the tangent planes of the node and its neighbours, whose upper envelope it
//! is where the body is convex: exactly for flat faces that meet in an edge; and bent by the change of the slopes where it is
//! round.

use crate::fold::{Fold, Underside};
use crate::patch_nodes::{Facing, PatchNodes, Plane};
use crate::rows::Rows;
use crate::spread::Spread;
use terraglue_ground::STEEPEST_SLOPE;
use terraglue_subsystem::Port;

/// An edge nearer to the border of the cell than this part of it leaves the cell flat.
const NEAR_BORDER: f64 = 0.02;
/// Slopes are cut where a height field no longer resolves a side, and do not show there how it goes on: they count less from here to
/// the cut.
const STEEP: f64 = 0.5 * STEEPEST_SLOPE;
/// Slopes that differ by less are alike.
const ALIKE: f64 = 1e-9;
/// √3 times the standard deviation of z = κx²/2 over a cell of side Δ, over κΔ²: 1/√240.
const BENT: f64 = 0.064_549_722_436_790_28;

/// The same of z = κxy: √3/12.
const TWISTED: f64 = 0.144_337_567_297_406_44;

impl Plane {
    /// That of a neighbour at `steps` cells of `spacing`, as seen from the node.
    fn seen(self, steps: [i32; 2], spacing: f64) -> Self {
        let at = steps.map(|s| f64::from(s) * spacing);
        let height = self.height - self.slope[0] * at[0] - self.slope[1] * at[1];
        Self { height, slope: self.slope }
    }

    /// Weight of its slope.
    fn weight(&self) -> f64 {
        let [a, b] = self.slope;
        ((STEEPEST_SLOPE - (a * a + b * b).sqrt()) / (STEEPEST_SLOPE - STEEP)).clamp(0.0, 1.0)
    }
}

/// Underside at a neighbour.
struct Neighbour {
    /// Its plane as seen from the node.
    plane: Plane,
    /// Weight of the slopes of both.
    weight: f64,
    edge: Option<Edge>,
}

/// Intersection of the plane of a neighbour with that of the node within its cell.
struct Edge {
    plane: Plane,
    /// Distance from the border of the cell towards its node, 0 … 1.
    depth: f64,
}

const BESIDE: [[i32; 2]; 4] = [[1, 0], [-1, 0], [0, 1], [0, -1]];
const ACROSS: [[i32; 2]; 4] = [[1, 1], [-1, 1], [1, -1], [-1, -1]];

impl PatchNodes {
    /// Depth of the surface that the contact met at node k when it began, m.
    #[inline]
    pub fn top(&self, k: usize) -> f64 {
        self.bed[k] - self.loose[k]
    }

    /// Takes the undersides of the nodes in `range`, which lie below `port` on a lattice of `spacing` (m), as they are in the mean over
    /// their cells. Flat ones stay as they are. `rows` lists them.
    pub fn fill_cells(&mut self, port: &Port, range: std::ops::Range<usize>, spacing: f64, rows: &mut Rows) {
        let n = port.direction(0);
        let ground = [-n[0] / n[2], -n[1] / n[2]];
        let level = |s: [f64; 2]| (s[0] - ground[0]).abs() + (s[1] - ground[1]).abs() < ALIKE;
        if range.clone().all(|k| level(self.plane[k].slope)) {
            return;
        }
        rows.weights.clear();
        rows.weights.extend(self.plane[range.clone()].iter().map(Plane::weight));
        // nothing of a body lies lower than its lowest point
        let lowest = range.clone().fold(0.0, |low: f64, k| low.min(self.arm[k][0]));
        for k in range {
            let level = (self.depth[k] - self.top(k)) / n[2];
            let cell = self.underside(k, spacing, ground, level, rows);
            // of a cell that is covered in part the underside takes that part of the range
            let part = (self.area[k] * n[2] / (spacing * spacing)).min(1.0);
            let (half, below) = (part * (3.0 * cell.variance).sqrt() * n[2], cell.rise * n[2]);
            let print = (self.spread[k].print - self.loose[k]).max(0.0);
            self.spread[k] = Spread::new(half, self.arm[k][0] + below - lowest, print);
            (self.spread[k].whole, self.spread[k].below) = (half / n[2], below);
            self.depth[k] -= below;
            if self.stamp[k] == 0 {
                self.permanent[k] -= self.spread[k].above(self.depth[k], self.top(k));
            }
            for c in 0..3 {
                self.arm[k][c] += cell.rise * port.direction(c)[2];
            }
            if cell.slope != self.plane[k].slope {
                self.facing[k] = Facing::new(port, cell.slope);
            }
            self.facing[k].stretch *= cell.steeper;
        }
    }

    /// By how much the underside lies lower between node k, the lowest of those in `range`, and its neighbours along the axes, than at
    /// the node, over ground with the normal `n` on a lattice of `spacing` (m), m. Round bodies bend evenly from slope to slope; no convex
    /// one lies lower than where the tangent planes meet.
    pub fn dip(&self, k: usize, range: std::ops::Range<usize>, n: [f64; 3], spacing: f64) -> f64 {
        let own = self.plane[k];
        let along = |axis: usize| {
            let ground = -n[axis] / n[2];
            let tilt = own.slope[axis] - ground;
            // down the slope
            let step = -tilt.signum();
            let mut at = self.index[k];
            at[axis] += step as i32;
            let Some(next) = self.index[range.clone()].iter().position(|index| *index == at) else {
                return 0.0;
            };
            let other = self.plane[range.start + next];
            let (falls, rises) = (tilt.abs(), step * (other.slope[axis] - ground));
            if falls == 0.0 || rises <= 0.0 {
                return 0.0;
            }
            let over = other.height - own.height - step * ground * spacing;
            let bent = falls * falls * spacing / (2.0 * (falls + rises));
            let meet = falls * (rises * spacing - over) / (falls + rises);
            bent.min(meet).max(0.0)
        };
        along(0) + along(1)
    }

    /// `level`: height of the soil above the underside at node k when the contact began, m.
    fn underside(&self, k: usize, spacing: f64, ground: [f64; 2], level: f64, rows: &Rows) -> Underside {
        let own = self.plane[k];
        let (at, weight) = (rows.cell(self.index[k]), rows.weight(k));
        let seen = |steps: [i32; 2]| {
            let next = rows.beside(at, steps)?;
            let (plane, others) = (self.plane[next].seen(steps, spacing), rows.weight(next));
            let edge = over_border(&own, &plane, others, spacing);
            Some(Neighbour { plane, weight: weight * others, edge })
        };
        // written out, since `map` copies
        let mut beside = [const { None }; 4];
        for (side, steps) in beside.iter_mut().zip(BESIDE) {
            *side = seen(steps);
        }
        // change of slope number `of` along an axis where the underside bends, on both sides of the node alike
        let bend = |of: usize, axis: usize| {
            let side = |number: usize, sign: f64| {
                let Neighbour { plane, weight, edge } = beside[2 * axis + number].as_ref()?;
                let bend = weight * (plane.slope[of] - own.slope[of]);
                Some((sign * bend / spacing, edge.is_some()))
            };
            match (side(0, 1.0), side(1, -1.0)) {
                (Some((a, _)), Some((b, _))) if a * b > 0.0 => a.signum() * a.abs().min(b.abs()),
                (Some((a, false)), None) | (None, Some((a, false))) => a,
                _ => 0.0,
            }
        };
        // where tangent planes cut the corners of the cell, the bend has that less to do
        let deepest = beside
            .iter()
            .flatten()
            .filter_map(|side| side.edge.as_ref())
            .fold(0.0, |most: f64, edge| most.max(edge.depth));
        let left = 1.0 - deepest;
        let (bends, twist) = ([left * bend(0, 0), left * bend(1, 1)], 0.5 * left * (bend(0, 1) + bend(1, 0)));
        let cell = spacing * spacing;
        let [a, b, c] = [BENT * bends[0], BENT * bends[1], TWISTED * twist];
        let mut folded = if deepest > 0.0 {
            let mut fold = Fold::new(own, spacing, ground);
            let edges = beside.iter().flatten().filter_map(|side| side.edge.as_ref());
            edges.for_each(|edge| fold.add(edge.plane));
            let across = ACROSS.into_iter().filter_map(|steps| seen(steps)?.edge);
            across.for_each(|edge| fold.add(edge.plane));
            fold.underside(level)
        } else {
            Underside::of(&own, spacing, ground)
        };
        folded.rise += cell / 24.0 * (bends[0] + bends[1]);
        folded.variance += cell * cell / 3.0 * (a * a + b * b + c * c);
        folded
    }
}

/// The plane of a neighbour that with the plane of the node bounds a convex body whose edge crosses the cell of the node. It comes in
/// where the edge crosses the border of the cell, not all at once. `weight`: that of the neighbour's slope; a face reaches into the
/// cell of a side beside it, however steep that is.
fn over_border(own: &Plane, other: &Plane, weight: f64, spacing: f64) -> Option<Edge> {
    let change = [0, 1].map(|c| (other.slope[c] - own.slope[c]).abs());
    let most = spacing * (change[0] + change[1]);
    let height = other.height - (NEAR_BORDER + 0.5 * (1.0 - weight)) * most;
    let there = height - own.height;
    let depth = 1.0 + there / (0.5 * most);
    (there <= 0.0 && most > ALIKE * spacing && depth > 0.0)
        .then_some(Edge { plane: Plane { height, slope: other.slope }, depth })
}
