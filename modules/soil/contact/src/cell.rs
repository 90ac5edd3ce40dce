//! The underside of a body within the cell of a node: how high it lies in the mean, how far it spreads about it, which way it looks.
//!
//! A node knows the underside at one point and its slope there. Under an edge, a narrow strip or a round body that is not much
//! broader than a cell that is not what the soil of the cell meets: of a wedge that comes down edge first a single node would see
//! all of its depth or none. So the underside is put together from the tangent planes of the node and its neighbours, whose upper
//! envelope it is where the body is convex: exactly for flat faces that meet in an edge; and bent by the change of the slopes where
//! it is round.

use crate::patch_nodes::{Facing, PatchNodes, Plane};
use crate::rows::Rows;
use crate::spread::Spread;
use terraglue_ground::STEEPEST_SLOPE;
use terraglue_subsystem::Port;

/// Points along each side of a cell at which an underside with an edge is looked at.
const SAMPLES: usize = 4;
/// The standard deviation of evenly spaced mid-points is smaller than that of what they stand for.
const MIDPOINTS: f64 = 1.032_795_558_988_644;
/// An edge nearer to the border of the cell than this part of it leaves the cell flat.
const NEAR_BORDER: f64 = 0.02;
/// Weight of what is not in the soil, so that an underside looks somewhere before it touches.
const OUTSIDE: f64 = 1e-3;
/// Slopes are cut where a height field no longer resolves a side, and say nothing there of how it goes on: they count less from here to
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

    /// How far its slope is meant.
    fn weight(&self) -> f64 {
        let [a, b] = self.slope;
        ((STEEPEST_SLOPE - (a * a + b * b).sqrt()) / (STEEPEST_SLOPE - STEEP)).clamp(0.0, 1.0)
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        self.height + self.slope[0] * x + self.slope[1] * y
    }
}

/// Where the plane of a neighbour meets that of the node within its cell.
struct Edge {
    plane: Plane,
    /// How far from the border of the cell towards its node, 0 … 1.
    depth: f64,
}

/// What the underside is like in a cell, relative to its node; heights vertical.
struct Underside {
    /// Mean height above the node, m.
    rise: f64,
    /// Variance of the height above the plane of the ground, m².
    variance: f64,
    slope: [f64; 2],
    /// Mean of √(1 + slope²) over that of the mean slope.
    steeper: f64,
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
    /// their cells. Flat ones stay as they are.
    pub fn fill_cells(&mut self, port: &Port, range: std::ops::Range<usize>, spacing: f64, rows: &mut Rows) {
        let n = [port.frame[0], port.frame[1], port.frame[2]];
        let ground = [-n[0] / n[2], -n[1] / n[2]];
        let level = |s: [f64; 2]| (s[0] - ground[0]).abs() + (s[1] - ground[1]).abs() < ALIKE;
        if range.clone().all(|k| level(self.plane[k].slope)) {
            return;
        }
        rows.list(self, range.clone());
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
        let [i, j] = self.index[k];
        let seen = |steps: &[i32; 2]| {
            let next = rows.find(self, [i + steps[0], j + steps[1]])?;
            Some(self.plane[next].seen(*steps, spacing))
        };
        let beside = BESIDE.map(|steps| seen(&steps));
        let edges = beside.map(|plane| plane.and_then(|plane| over_border(&own, &plane, spacing)));
        // change of slope number `of` along an axis where the underside bends, on both sides of the node alike
        let bend = |of: usize, axis: usize| {
            let side = |number: usize, sign: f64| {
                let plane = beside[2 * axis + number].as_ref()?;
                let bend = plane.weight() * own.weight() * (plane.slope[of] - own.slope[of]);
                Some((sign * bend / spacing, edges[2 * axis + number].is_some()))
            };
            match (side(0, 1.0), side(1, -1.0)) {
                (Some((a, _)), Some((b, _))) if a * b > 0.0 => a.signum() * a.abs().min(b.abs()),
                (Some((a, false)), None) | (None, Some((a, false))) => a,
                _ => 0.0,
            }
        };
        // where tangent planes cut the corners of the cell, the bend has that less to do
        let left = 1.0 - edges.iter().flatten().fold(0.0, |most: f64, edge| most.max(edge.depth));
        let (bends, twist) = ([left * bend(0, 0), left * bend(1, 1)], 0.5 * left * (bend(0, 1) + bend(1, 0)));
        let cell = spacing * spacing;
        let [a, b, c] = [BENT * bends[0], BENT * bends[1], TWISTED * twist];
        let mut folded = if edges.iter().any(Option::is_some) {
            let mut faces = [own; 9];
            let mut count = 1;
            let across =
                ACROSS.map(|steps| seen(&steps).and_then(|plane| over_border(&own, &plane, spacing)));
            for edge in edges.into_iter().chain(across).flatten() {
                faces[count] = edge.plane;
                count += 1;
            }
            fold(&faces[..count], spacing, ground, level)
        } else {
            let tilt = [0, 1].map(|c| own.slope[c] - ground[c]);
            let variance = cell / 12.0 * (tilt[0] * tilt[0] + tilt[1] * tilt[1]);
            Underside { rise: 0.0, variance, slope: own.slope, steeper: 1.0 }
        };
        folded.rise += cell / 24.0 * (bends[0] + bends[1]);
        folded.variance += cell * cell / 3.0 * (a * a + b * b + c * c);
        folded
    }
}

/// The plane of a neighbour that with the plane of the node bounds a convex body whose edge crosses the cell of the node. It comes in
/// where the edge crosses the border of the cell, not all at once.
fn over_border(own: &Plane, other: &Plane, spacing: f64) -> Option<Edge> {
    let change = [0, 1].map(|c| (other.slope[c] - own.slope[c]).abs());
    let most = spacing * (change[0] + change[1]);
    let weight = own.weight() * other.weight();
    let height = other.height - (NEAR_BORDER + 0.5 * (1.0 - weight)) * most;
    let there = height - own.height;
    let depth = 1.0 + there / (0.5 * most);
    (there <= 0.0 && most > ALIKE * spacing && depth > 0.0)
        .then_some(Edge { plane: Plane { height, slope: other.slope }, depth })
}

/// The upper envelope of some planes over a cell of side `spacing`, the first of them that of its node. It looks where what lies in the
/// soil does: the faces of a wedge that are in the soil press it, not those above.
fn fold(faces: &[Plane], spacing: f64, ground: [f64; 2], level: f64) -> Underside {
    let own = &faces[0];
    let (mut sum, mut height, mut square, mut slope, mut stretch, mut weights) =
        (0.0, 0.0, 0.0, [0.0; 2], 0.0, 0.0);
    let place = |s: usize| ((s as f64 + 0.5) / SAMPLES as f64 - 0.5) * spacing;
    for s in 0..SAMPLES * SAMPLES {
        let (x, y) = (place(s % SAMPLES), place(s / SAMPLES));
        let mut top = (own.at(x, y), own);
        for face in &faces[1..] {
            let z = face.at(x, y);
            if z > top.0 {
                top = (z, face);
            }
        }
        let (z, [a, b]) = (top.0 - own.height, top.1.slope);
        let over = z - ground[0] * x - ground[1] * y;
        sum += over;
        height += z;
        square += over * over;
        let falls = ((a - ground[0]).abs() + (b - ground[1]).abs()) * spacing / SAMPLES as f64;
        let inside = if falls > 0.0 { (0.5 + (level - over) / falls).clamp(0.0, 1.0) } else { 1.0 };
        let weight = inside + OUTSIDE;
        slope = [slope[0] + weight * a, slope[1] + weight * b];
        stretch += weight * (1.0 + a * a + b * b).sqrt();
        weights += weight;
    }
    let count = (SAMPLES * SAMPLES) as f64;
    let mean = sum / count;
    let [a, b] = slope.map(|s| s / weights);
    let variance = (square / count - mean * mean).max(0.0) * MIDPOINTS * MIDPOINTS;
    let steeper = stretch / weights / (1.0 + a * a + b * b).sqrt();
    Underside { rise: height / count, variance, slope: [a, b], steeper }
}
