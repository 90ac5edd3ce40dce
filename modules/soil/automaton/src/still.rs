//! Which ground no rule can move, by bounds: the slopes of all faces of a strip and of those around it lie in a range
//! that neither rule minds. Ground that fails is checked node by node.
//!
//! With dx, dy the differences over faces along x and y: a flux needs g² = g_n² + g_t² > thr², and g_n is one of the
//! dx, g_t a mean of four dy, or the reverse. A straight triple bends by the difference of two dx (or two dy), a
//! diagonal one by the difference of two dx and that of two dy.

use crate::feet::Foot;
use crate::window::{Limits, Rectangle};
use terraglue_ground::{Lattice, TILE_EDGE};
use terraglue_soil_contact::Ground;

const EDGE: usize = TILE_EDGE as usize;
/// Rows of a strip.
const STRIP: usize = 16;
/// Strips of a tile.
const STRIPS: usize = EDGE / STRIP;

/// Smallest and largest difference over the faces along x and along y, units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    least: [i32; 2],
    most: [i32; 2],
}

impl Bounds {
    const NONE: Self = Self { least: [i32::MAX; 2], most: [i32::MIN; 2] };
    const ANY: Self = Self { least: [i32::MIN; 2], most: [i32::MAX; 2] };

    fn add(&mut self, k: usize, difference: i32) {
        self.least[k] = self.least[k].min(difference);
        self.most[k] = self.most[k].max(difference);
    }

    fn hull(self, other: Self) -> Self {
        Self {
            least: [0, 1].map(|k| self.least[k].min(other.least[k])),
            most: [0, 1].map(|k| self.most[k].max(other.most[k])),
        }
    }

    /// Whether neither rule would move a node between such faces.
    fn still(&self, limits: &Limits) -> bool {
        let steepest = [0, 1].map(|k| f64::from(self.least[k]).abs().max(f64::from(self.most[k]).abs()));
        let thr = f64::from(limits.least_repose);
        // a little less than the threshold, since the rule computes in single precision
        let flat = steepest[0] * steepest[0] + steepest[1] * steepest[1] <= thr * thr * (1.0 - 1e-6);
        let [x, y] = [0, 1].map(|k| i64::from(self.most[k]) - i64::from(self.least[k]));
        let straight = limits.curvature.is_none_or(|[straight, diagonal]| {
            x.max(y) <= i64::from(straight) && x + y <= i64::from(diagonal)
        });
        flat && straight
    }
}

/// The bounds of every strip of the ground.
pub struct Still {
    lattice: Lattice,
    strips: Vec<Bounds>,
}

/// Gathers the bounds with the widest vectors that the processor has.
struct Gather<'a> {
    ground: &'a Ground,
    strips: &'a mut [Bounds],
}

impl pulp::NullaryFnOnce for Gather<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let [nx, ny] = self.ground.heights.lattice().tiles();
        let mut level = [[0; EDGE * EDGE]; 3];
        for (tile, out) in self.strips.chunks_exact_mut(STRIPS).enumerate() {
            let (a, b) = (tile as u32 % nx, tile as u32 / nx);
            let at = |a: u32, b: u32| (a < nx && b < ny).then(|| (b * nx + a) as usize);
            tile_bounds(self.ground, tile, [at(a + 1, b), at(a, b + 1)], &mut level, out);
        }
    }
}

impl Still {
    /// Looks at the whole ground; strips below feet may move.
    pub fn new(ground: &Ground, feet: &[Foot]) -> Self {
        let lattice = *ground.heights.lattice();
        let mut strips = vec![Bounds::NONE; lattice.tile_count() * STRIPS];
        pulp::Arch::new().dispatch(Gather { ground, strips: &mut strips });
        for foot in feet {
            let (tile, k) = lattice.locate(foot.node[0] as u32, foot.node[1] as u32);
            strips[tile * STRIPS + k / EDGE / STRIP] = Bounds::ANY;
        }
        Self { lattice, strips }
    }

    /// The smallest rectangle with all nodes of tiles `first` … `end` − 1 that may move.
    pub fn unstable(&self, first: [u32; 2], end: [u32; 2], limits: &Limits) -> Option<Rectangle> {
        let mut found: Option<Rectangle> = None;
        for (b, a) in (first[1]..end[1]).flat_map(|b| (first[0]..end[0]).map(move |a| (b, a))) {
            for s in (0..STRIPS).filter(|s| !self.rests([a, b], *s, limits)) {
                let low = [a * TILE_EDGE, b * TILE_EDGE + (s * STRIP) as u32].map(|k| k as i32);
                let high = [low[0] + EDGE as i32, low[1] + STRIP as i32];
                let last = [0, 1].map(|k| high[k].min(self.lattice.size[k] as i32) - 1);
                if last[1] >= low[1] {
                    let strip = Rectangle { first: low, last };
                    found = Some(found.map_or(strip, |other| other.hull(&strip)));
                }
            }
        }
        found
    }

    /// Whether strip s of the tile (a, b) can neither flow nor bend.
    fn rests(&self, [a, b]: [u32; 2], s: usize, limits: &Limits) -> bool {
        let [nx, ny] = self.lattice.tiles();
        let row = b as usize * STRIPS + s;
        let mut all = Bounds::NONE;
        for row in row.saturating_sub(1)..=(row + 1).min(ny as usize * STRIPS - 1) {
            for a in a.saturating_sub(1)..=(a + 1).min(nx - 1) {
                let tile = (row / STRIPS) * nx as usize + a as usize;
                all = all.hull(self.strips[tile * STRIPS + row % STRIPS]);
            }
        }
        let ends = |k: usize, at: u32, n: u32| (at == 0 || at + 1 == n).then_some(k);
        // beyond the lattice the outermost node repeats itself
        for k in [ends(0, a, nx), ends(1, b, ny)].into_iter().flatten() {
            all.add(k, 0);
        }
        all.still(limits)
    }
}

/// Bounds of the strips of a tile, with the faces to its right and upper neighbours.
#[inline(always)]
fn tile_bounds(
    ground: &Ground,
    tile: usize,
    [right, up]: [Option<usize>; 2],
    level: &mut [[i32; EDGE * EDGE]; 3],
    out: &mut [Bounds],
) {
    let heights = &ground.heights;
    let (_, nodes) = heights.lattice().tile_nodes(tile);
    if nodes != [TILE_EDGE; 2] {
        // cut by the end of the lattice
        out.fill(Bounds::ANY);
        return;
    }
    let here = heights.tile(tile);
    let (right, up) = (right.map(|t| heights.tile(t)), up.map(|t| heights.tile(t)));
    let same = |other: &Option<Result<&[i32], i32>>| match (here, other) {
        (_, None) => true,
        (Err(a), Some(Err(b))) => a == *b,
        _ => false,
    };
    if here.is_err() && same(&right) && same(&up) {
        out.fill(Bounds { least: [0; 2], most: [0; 2] });
        return;
    }
    let [own, beside, above] = level;
    let here = units(here, own);
    let (right, up) = (right.map(|t| units(t, beside)), up.map(|t| units(t, above)));
    for (s, out) in out.iter_mut().enumerate() {
        *out = strip_bounds(here, right, up, s * STRIP);
    }
}

/// The heights of a tile; a level one lends them from `level`.
#[inline(always)]
fn units<'a>(tile: Result<&'a [i32], i32>, level: &'a mut [i32]) -> &'a [i32] {
    tile.unwrap_or_else(|units| {
        level.fill(units);
        level
    })
}

/// Widens the running ranges `least` … `most` by the differences to − from (slices of one length).
#[inline(always)]
fn widen(from: &[i32], to: &[i32], least: &mut [i32], most: &mut [i32]) {
    for (((from, to), least), most) in from.iter().zip(to).zip(least).zip(most) {
        let difference = to.wrapping_sub(*from);
        *least = difference.min(*least);
        *most = difference.max(*most);
    }
}

#[inline(always)]
fn strip_bounds(here: &[i32], right: Option<&[i32]>, up: Option<&[i32]>, first: usize) -> Bounds {
    // a running range for every column
    let (mut least, mut most) = ([[i32::MAX; EDGE]; 2], [[i32::MIN; EDGE]; 2]);
    for y in first..first + STRIP {
        let row = &here[y * EDGE..][..EDGE];
        // the right neighbour of the last column is in another tile
        widen(&row[..EDGE - 1], &row[1..], &mut least[0][..EDGE - 1], &mut most[0][..EDGE - 1]);
        let next = here.get((y + 1) * EDGE..(y + 2) * EDGE).or(up.map(|up| &up[..EDGE]));
        if let Some(next) = next {
            widen(row, next, &mut least[1], &mut most[1]);
        }
    }
    let mut bounds = Bounds::NONE;
    for k in 0..2 {
        bounds.least[k] = least[k].iter().fold(i32::MAX, |a, b| a.min(*b));
        bounds.most[k] = most[k].iter().fold(i32::MIN, |a, b| a.max(*b));
    }
    if let Some(right) = right {
        for at in (first..first + STRIP).map(|y| y * EDGE) {
            bounds.add(0, right[at].wrapping_sub(here[at + EDGE - 1]));
        }
    }
    bounds
}
