//! Stage 3b: stems: arcs one above the other on a nearly upright line, with no rays that go through.
//!
//! Nothing here is a number of points: of the beams that must meet a stem at that distance, the share that does decides, so
//! the same rule serves a scanner with 16 beams far away and one with 128 nearby.

use crate::arcs::Arc;
use crate::rings::Rings;
use nalgebra::{Matrix2, Vector2};

/// A stem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stem {
    /// Middle at breast height, 1.3 m above the ground, m.
    pub place: [f64; 2],
    /// Deviation of the place along each axis, m.
    pub deviation: f64,
    /// Diameter at breast height, m.
    pub diameter: f64,
    /// Deviation of the diameter, m.
    pub diameter_deviation: f64,
    /// Slope of the axis along x and y, m/m.
    pub lean: [f64; 2],
    /// Height of the ground below, m.
    pub ground: f64,
    /// Beams that met it.
    pub met: u32,
    /// Of the beams that must meet it and that nothing hides, the share that did.
    pub share: f64,
}

/// A turn in the search for stems: its rings, where its scanner stood and how it was turned.
#[derive(Clone, Debug)]
pub struct Revolution {
    /// Its points, beam by beam.
    pub rings: Rings,
    /// Where the scanner stood in the frame of the map, m.
    pub eye: [f64; 3],
    /// By how much the frame of its points is turned about the vertical, rad.
    pub yaw: f64,
}

/// Criteria of a stem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StemRules {
    /// Heights above the ground that are searched, m.
    pub heights_m: [f64; 2],
    /// Fewest beams.
    pub fewest: u32,
    /// Smallest height over which they spread, m.
    pub spread_m: f64,
    /// Smallest share of the beams that must meet it.
    pub share: f64,
}

impl Default for StemRules {
    fn default() -> Self {
        Self { heights_m: [0.4, 6.0], fewest: 3, spread_m: 0.9, share: 0.6 }
    }
}

/// Height at which a tree is mapped, m.
const BREAST_HEIGHT: f64 = 1.3;
/// Deviation of the lean before anything was seen, m/m.
const LEAN: f64 = 0.03;
/// Share of its diameter at breast height that a stem loses with each metre: the mean taper of the lower third of stems.
const TAPER: f64 = 0.03;

/// The stems that arcs indicate, strongest evidence first; `arcs` are in the frame of the map.
pub(crate) fn stems(arcs: &[Arc], turns: &[Revolution], rules: &StemRules) -> Vec<Stem> {
    let [low, high] = rules.heights_m;
    let used: Vec<Arc> = arcs.iter().filter(|a| (low..high).contains(&a.height)).copied().collect();
    let neighbours = Neighbours::of(&used);
    let mut votes: Vec<(u32, u32)> =
        (0..).zip(&used).map(|(k, a)| (neighbours.company(&used, a), k)).collect();
    votes.sort_unstable_by_key(|(company, k)| (u32::MAX - company, *k));
    let mut is_taken = vec![false; used.len()];
    let mut found: Vec<Stem> = Vec::new();
    for (company, k) in votes {
        if company < rules.fewest {
            break;
        }
        if is_taken[k as usize] {
            continue;
        }
        let Some((stem, members)) = grown(&used, &neighbours, &is_taken, k, rules) else { continue };
        let sure = if turns.is_empty() {
            stacked(stem, &used, &members, rules)
        } else {
            confirmed(stem, turns, rules)
        };
        let Some(stem) = sure else { continue };
        let near = |other: &Stem| {
            let gap = Vector2::from(other.place) - Vector2::from(stem.place);
            gap.norm() < 0.3_f64.max(0.5 * (stem.diameter + other.diameter))
        };
        members.into_iter().for_each(|m| is_taken[m as usize] = true);
        if !found.iter().any(near) {
            found.push(stem);
        }
    }
    found
}

/// Edge of the cells that arcs are sorted into, m: nothing of one stem is farther aside.
const CELL: f64 = 0.5;

/// Arcs by cells.
struct Neighbours {
    low: [f64; 2],
    size: [i64; 2],
    cells: Vec<Vec<u32>>,
}

impl Neighbours {
    fn of(arcs: &[Arc]) -> Self {
        let low = [0, 1].map(|k| arcs.iter().map(|a| a.centre[k]).fold(f64::INFINITY, f64::min));
        let high = [0, 1].map(|k| arcs.iter().map(|a| a.centre[k]).fold(f64::NEG_INFINITY, f64::max));
        let size = [0, 1].map(|k| if arcs.is_empty() { 0 } else { ((high[k] - low[k]) / CELL) as i64 + 1 });
        let mut cells = vec![Vec::new(); (size[0] * size[1]) as usize];
        for (k, arc) in (0..).zip(arcs) {
            let [i, j] = [0, 1].map(|k| ((arc.centre[k] - low[k]) / CELL) as i64);
            cells[(j * size[0] + i) as usize].push(k);
        }
        Self { low, size, cells }
    }

    /// Arcs in the cell of a place and those around.
    fn near(&self, at: [f64; 3]) -> impl Iterator<Item = u32> + '_ {
        let [i, j] = [0, 1].map(|k| ((at[k] - self.low[k]) / CELL).floor() as i64);
        let inside = |(i, j): &(i64, i64)| *i >= 0 && *j >= 0 && *i < self.size[0] && *j < self.size[1];
        let around = (-1..=1).flat_map(move |b| (-1..=1).map(move |a| (i + a, j + b)));
        around.filter(inside).flat_map(|(i, j)| self.cells[(j * self.size[0] + i) as usize].iter().copied())
    }

    /// Different beams whose arcs stand above or below an arc.
    fn company(&self, arcs: &[Arc], arc: &Arc) -> u32 {
        let mut beams = [0_u64; 4];
        for k in self.near(arc.centre) {
            let other = &arcs[k as usize];
            if agrees(arc, other) {
                let beam = (other.ring + 37 * other.turn) % 256;
                beams[(beam / 64) as usize] |= 1 << (beam % 64);
            }
        }
        beams.iter().map(|b| b.count_ones()).sum()
    }
}

/// Whether two arcs may lie on one stem.
fn agrees(a: &Arc, b: &Arc) -> bool {
    let apart = (a.centre[2] - b.centre[2]).abs();
    let (x, y) = (a.centre[0] - b.centre[0], a.centre[1] - b.centre[1]);
    let reach = 0.05 + 1.5 * (a.deviation + b.deviation) + 2.0 * LEAN * apart;
    let width = a.diameter_deviation + b.diameter_deviation;
    x * x + y * y < reach * reach
        && (!(a.is_whole && b.is_whole)
            || (a.diameter - b.diameter).abs() < 0.05 + 1.5 * width + 0.25 * a.diameter.max(b.diameter))
}

/// A line through arcs: place at the height of the first one, and lean.
#[derive(Clone, Copy)]
struct Axis {
    z: f64,
    at: Vector2<f64>,
    lean: Vector2<f64>,
    /// Deviation at breast height.
    deviation: f64,
}

impl Axis {
    fn place(&self, z: f64) -> Vector2<f64> {
        self.at + (z - self.z) * self.lean
    }

    /// Least squares through arcs, with a lean that is small unless they show otherwise.
    fn fit(arcs: &[&Arc], breast: f64) -> Self {
        let z = arcs.iter().map(|a| a.centre[2]).sum::<f64>() / arcs.len() as f64;
        let (mut left, mut right) = (Matrix2::zeros(), [Vector2::zeros(); 2]);
        for arc in arcs {
            let weight = 1.0 / (arc.deviation * arc.deviation);
            let row = Vector2::new(1.0, arc.centre[2] - z);
            left += weight * row * row.transpose();
            (0..2).for_each(|k| right[k] += weight * arc.centre[k] * row);
        }
        left[(1, 1)] += 1.0 / (LEAN * LEAN);
        let inverse = left.try_inverse().unwrap_or_else(Matrix2::zeros);
        let [x, y] = right.map(|r| inverse * r);
        let row = Vector2::new(1.0, breast - z);
        let deviation = row.dot(&(inverse * row)).max(0.0).sqrt();
        Self { z, at: Vector2::new(x[0], y[0]), lean: Vector2::new(x[1], y[1]), deviation }
    }
}

/// The stem around an arc, and the arcs that it takes.
fn grown(
    arcs: &[Arc],
    neighbours: &Neighbours,
    is_taken: &[bool],
    seed: u32,
    rules: &StemRules,
) -> Option<(Stem, Vec<u32>)> {
    let first = &arcs[seed as usize];
    let free = |k: &u32| !is_taken[*k as usize];
    let mut members: Vec<u32> =
        neighbours.near(first.centre).filter(free).filter(|k| agrees(first, &arcs[*k as usize])).collect();
    let ground = first.centre[2] - first.height;
    let breast = ground + BREAST_HEIGHT;
    let of = |members: &[u32]| members.iter().map(|k| &arcs[*k as usize]).collect::<Vec<_>>();
    let mut axis = Axis::fit(&of(&members), breast);
    let mut diameter = (first.diameter, first.diameter_deviation);
    for _ in 0..2 {
        diameter = thickness(&of(&members)).unwrap_or(diameter);
        let fits = |k: &u32| {
            let arc = &arcs[*k as usize];
            let gap = (Vector2::new(arc.centre[0], arc.centre[1]) - axis.place(arc.centre[2])).norm();
            gap < 0.04 + 2.0 * arc.deviation + 0.15 * diameter.0
        };
        members = neighbours.near(first.centre).filter(free).filter(fits).collect();
        if members.is_empty() {
            return None;
        }
        axis = Axis::fit(&of(&members), breast);
    }
    let all = of(&members);
    let heights = || all.iter().map(|a| a.height);
    let spread = heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min);
    if spread < rules.spread_m || axis.lean.norm() > 0.25 || !is_even(&all, diameter.0) {
        return None;
    }
    let place = axis.place(breast);
    let deviation = libm::hypot(axis.deviation, 0.02 + 0.25 * diameter.1);
    let stem = Stem {
        place: [place.x, place.y],
        deviation,
        diameter: diameter.0,
        diameter_deviation: diameter.1,
        lean: [axis.lean.x, axis.lean.y],
        ground,
        met: 0,
        share: 0.0,
    };
    Some((stem, members))
}

/// Diameter at breast height and its deviation: the median of the arcs whose sides are both seen, brought there by the taper.
fn thickness(arcs: &[&Arc]) -> Option<(f64, f64)> {
    let at_breast = |a: &&&Arc| a.diameter / (1.0 - TAPER * (a.height - BREAST_HEIGHT)).max(0.5);
    let mut whole: Vec<f64> = arcs.iter().filter(|a| a.is_whole).map(|a| at_breast(&a)).collect();
    if 3 * whole.len() < arcs.len() {
        // hidden on one side nearly everywhere: at least as thick as most pieces
        let mut all: Vec<f64> = arcs.iter().map(|a| at_breast(&a)).collect();
        all.sort_unstable_by(f64::total_cmp);
        let thick = all.get(all.len() * 9 / 10).copied()?;
        return Some((thick, 0.5 * thick + 0.05));
    }
    whole.sort_unstable_by(f64::total_cmp);
    // the mean of the middle half: rounding to steps of the scanner averages out, branches do not count
    let (from, to) = (whole.len() / 4, whole.len() - whole.len() / 4);
    let part = &whole[from..to];
    let mean = part.iter().sum::<f64>() / part.len() as f64;
    // beams share their azimuths, so their rounding is not independent
    let deviation = arcs.iter().map(|a| a.diameter_deviation).fold(f64::MAX, f64::min);
    Some((mean, libm::hypot(deviation, 0.01)))
}

/// Whether widths stay about the same: those of bushes do not.
fn is_even(arcs: &[&Arc], diameter: f64) -> bool {
    let whole: Vec<&&Arc> = arcs.iter().filter(|a| a.is_whole).collect();
    let even =
        |a: &&&&Arc| (a.diameter - diameter).abs() < 0.04 + 1.5 * a.diameter_deviation + 0.25 * diameter;
    whole.len() < 3 || 10 * whole.iter().filter(even).count() >= 6 * whole.len()
}

/// A stem of a cloud without beams with the slices that show it: enough of those between its lowest and its highest one must.
fn stacked(stem: Stem, arcs: &[Arc], members: &[u32], rules: &StemRules) -> Option<Stem> {
    let mut slices: Vec<u32> = members.iter().map(|k| arcs[*k as usize].ring).collect();
    slices.sort_unstable();
    slices.dedup();
    let (met, all) = (slices.len() as u32, slices.last()? - slices.first()? + 1);
    let share = f64::from(met) / f64::from(all);
    (met >= rules.fewest && share >= rules.share).then_some(Stem { met, share, ..stem })
}

/// A stem with the beams that met it and those that went through; none: too many did, or too few met it.
fn confirmed(stem: Stem, turns: &[Revolution], rules: &StemRules) -> Option<Stem> {
    let (mut met, mut through, mut beams) = (0_u32, 0_u32, 0_u32);
    let mut heights = [f64::MAX, f64::MIN];
    for turn in turns {
        let (sine, cosine) = (libm::sin(turn.yaw), libm::cos(turn.yaw));
        for ring in &turn.rings.rings {
            let (x, y) = (stem.place[0] - turn.eye[0], stem.place[1] - turn.eye[1]);
            let level = libm::hypot(x, y);
            let seen_at = |x: f64, y: f64| libm::atan2(-sine * x + cosine * y, cosine * x + sine * y);
            let height = turn.eye[2] + ring.slope(seen_at(x, y)) * level - stem.ground;
            if !(rules.heights_m[0]..rules.heights_m[1]).contains(&height) || level < stem.diameter {
                continue;
            }
            // where the leaning axis passes this beam
            let [x, y] =
                [x + stem.lean[0] * (height - BREAST_HEIGHT), y + stem.lean[1] * (height - BREAST_HEIGHT)];
            let azimuth = seen_at(x, y);
            let half = (0.35 * stem.diameter / level).max(0.75 * turn.rings.step);
            let [mut on, mut before, mut behind] = [0_u32; 3];
            for r in ring.within(azimuth, half) {
                match r.distance - level {
                    d if d < -0.5 * stem.diameter - 0.25 => before += 1,
                    d if d > 0.5 * stem.diameter + 0.25 => behind += 1,
                    _ => on += 1,
                }
            }
            match () {
                () if on > 0 && on >= behind => {
                    met += 1;
                    beams += 1;
                    heights = [heights[0].min(height), heights[1].max(height)];
                }
                () if before > 0 => {}
                // nothing behind is the sky, or a ray that was lost
                () => through += 1,
            }
        }
    }
    let share = f64::from(met) / f64::from((met + through).max(1));
    let enough = beams >= rules.fewest && heights[1] - heights[0] >= rules.spread_m && share >= rules.share;
    enough.then_some(Stem { met, share, ..stem })
}
