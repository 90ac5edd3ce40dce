//! Long slopes come to rest first on a lattice of twice the spacing, then on their own.
//!
//! Near rest the rule of repose is a diffusion: a slope of n nodes takes about n² sweeps. On blocks of 2 × 2 nodes it
//! takes a quarter of them, each over a quarter of the nodes. The gain of a block is spread over its nodes and those
//! around them, in whole units, so nothing is lost. Material that has slid too far never climbs back, so the coarse
//! lattice must not flatten: there a slope rests when it is still [`STEEPER`] times as steep, and the rest is left to
//! the fine rule. With the same threshold on both the cone of a column has flanks of 34.4 to 35.1 degrees instead of
//! 35.03 to 35.08; with this one it is indistinguishable from that of the fine rule alone.

use crate::sweep::Sweeper;
use terraglue_ground::{Lattice, UNIT_M};
use terraglue_soil_contact::Ground;
use terraglue_subsystem::{Result, Terrain, TerrainTile};

/// Factor by which slopes may be steeper on the coarse lattice.
const STEEPER: f32 = 1.05;
/// A ground is at rest when a sweep changes no node by more, units (1 µm).
const AT_REST: i32 = 4;
/// The same on the coarse lattice, where waiting longer moves nothing that the fine one would not.
const NEARLY_AT_REST: i32 = 40;
/// Lattices with fewer nodes along a side have no coarse one.
const LEAST_SIDE: u32 = 16;
/// Sweeps between two looks at the largest change.
const SWEEPS: u32 = 8;

/// Heights as the ground of a soil.
struct Heights {
    lattice: Lattice,
    /// Units, x fastest.
    units: Vec<i32>,
}

impl Heights {
    fn new(lattice: Lattice, unit: impl Fn(i32, i32) -> i32) -> Self {
        let [nx, ny] = lattice.size.map(|n| n as i32);
        let places = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
        Self { lattice, units: places.map(|(i, j)| unit(i, j)).collect() }
    }

    /// Means of blocks of 2 × 2 nodes; a last odd row or column is left out.
    fn of_blocks(ground: &Ground) -> Self {
        let fine = ground.heights.lattice();
        let mean = |a: i32, b: i32| {
            let nodes = [[0, 0], [1, 0], [0, 1], [1, 1]];
            let sum: i64 =
                nodes.iter().map(|[i, j]| i64::from(ground.heights.units(2 * a + i, 2 * b + j))).sum();
            sum.div_euclid(4) as i32
        };
        let size = fine.size.map(|n| n / 2);
        Self::new(Lattice { origin: fine.origin, spacing: 2.0 * fine.spacing, size }, mean)
    }

    fn at(&self, a: i32, b: i32) -> i32 {
        let (a, b) = self.lattice.clamp(a, b);
        self.units[b as usize * self.lattice.size[0] as usize + a as usize]
    }
}

impl Terrain for Heights {
    fn origin(&self) -> [f64; 2] {
        self.lattice.origin
    }
    fn spacing(&self) -> f64 {
        self.lattice.spacing
    }
    fn size(&self) -> [u32; 2] {
        self.lattice.size
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        for (b, row) in (j0..).zip(out.chunks_exact_mut(ni)).take(nj) {
            for (a, height) in (i0..).zip(row) {
                *height = f64::from(self.at(a as i32, b as i32)) * UNIT_M;
            }
        }
        TerrainTile::Varied
    }
}

/// Shares of a block's change by 4 nodes: nine sixteenths stay with each of its own nodes, three go to each of the
/// eight that share an edge with it, one to each of the four at its corners (bilinear interpolation, turned round).
fn spread(change: i32, lattice: &Lattice, [a, b]: [i32; 2], mut add: impl FnMut(i32, i32, i32)) {
    let (edge, corner) = (i64::from(change) * 3 / 16, i64::from(change) / 16);
    let mut own = 4 * i64::from(change);
    for y in -1..3 {
        for x in -1..3 {
            let outside = [x, y].map(|k| !(0..2).contains(&k));
            let share = match outside {
                [false, false] => continue,
                [true, true] => corner,
                _ => edge,
            };
            let (i, j) = (2 * a + x, 2 * b + y);
            if lattice.has(i, j) {
                own -= share;
                add(i, j, share as i32);
            }
        }
    }
    for k in 0..4 {
        // the remainder of a division by four goes to the first nodes
        let share = own.div_euclid(4) + i64::from(own.rem_euclid(4) > i64::from(k));
        add(2 * a + k % 2, 2 * b + k / 2, share as i32);
    }
}

/// Brings ground without feet to rest, at most `most` sweeps on each lattice. Returns the sweeps on both.
///
/// # Errors
/// The ground leaves the range of heights.
pub fn relax(sweeper: &mut Sweeper, ground: &mut Ground, most: u32) -> Result<[u32; 2]> {
    let mut coarse = 0;
    if ground.heights.lattice().size.iter().all(|n| *n >= LEAST_SIDE) && !sweeper.sleeps() {
        coarse = relax_blocks(sweeper, ground, most)?;
    }
    Ok([coarse, rest(sweeper, ground, AT_REST, most)])
}

/// The same ground as one that has always been so: nothing has sunk, nothing lies loose.
///
/// # Errors
/// The heights are out of range.
pub(crate) fn as_found(ground: &mut Ground) -> Result {
    let now = Heights::new(*ground.heights.lattice(), |i, j| ground.heights.units(i, j));
    let Ground { heights, nodes, .. } = Ground::new(&now)?;
    (ground.heights, ground.nodes) = (heights, nodes);
    Ok(())
}

fn relax_blocks(sweeper: &mut Sweeper, ground: &mut Ground, most: u32) -> Result<u32> {
    let lattice = *ground.heights.lattice();
    let before = Heights::of_blocks(ground);
    let mut blocks = Ground::new(&before)?;
    let mut slides = sweeper.of_blocks(*blocks.heights.lattice(), STEEPER);
    slides.scan(&blocks);
    let sweeps = rest(&mut slides, &mut blocks, NEARLY_AT_REST, most);
    for b in 0..before.lattice.size[1] as i32 {
        for a in 0..before.lattice.size[0] as i32 {
            let change = blocks.heights.units(a, b) - before.at(a, b);
            if change != 0 {
                spread(change, &lattice, [a, b], |i, j, units| {
                    ground.add_material(i, j, units);
                    sweeper.changed.mark([i, j]);
                });
            }
        }
    }
    Ok(sweeps)
}

fn rest(sweeper: &mut Sweeper, ground: &mut Ground, largest: i32, most: u32) -> u32 {
    let start = sweeper.counts.sweeps;
    while sweeper.counts.sweeps - start < most && sweeper.sweep(ground, SWEEPS) > largest {}
    sweeper.counts.sweeps - start
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_block_gives_its_nodes_what_it_has_gained(change in -2_000_000..2_000_000i32, a in 0..8i32, b in 0..5i32) {
            let lattice = Lattice { origin: [0.0; 2], spacing: 1.0, size: [16, 11] };
            let (mut sum, mut most) = (0, 0.0_f64);
            spread(change, &lattice, [a, b], |i, j, units| {
                assert!(lattice.has(i, j));
                sum += i64::from(units);
                most = most.max(f64::from(units.abs()));
            });
            prop_assert_eq!(sum, 4 * i64::from(change));
            prop_assert!(most <= 1.0 * f64::from(change.abs()) + 4.0, "{}", most);
        }
    }
}
