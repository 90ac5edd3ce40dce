//! Sweeps: the two rules on the awake nodes, each from its own snapshot.

use crate::active::{ActiveSet, TileBits};
use crate::awake::Awake;
use crate::cell::{Cell, OPEN};
use crate::levels::{Levels, MARGIN, STRIDE, Window};
use crate::rules::{curvature_flux, face_flux};
use terraglue_ground::{Lattice, TILE_EDGE, TileMap, UNIT_M};
use terraglue_soil_contact::Ground;

/// The four directions of triples; the last two are diagonal.
const TRIPLES: [[i32; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];
/// Changes of a pass that can be noted before memory is asked for.
const RESERVE_CHANGES: usize = 16_384;

/// What the last step did, and sums since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Visits of nodes in the last step.
    pub visited: u64,
    /// Sweeps of the last step.
    pub sweeps: u32,
    /// Units that left a node since the start.
    pub moved: i64,
    /// Sum of all changes since the start, units.
    pub gained: i64,
}

/// The rules in units of height on one lattice.
#[derive(Clone, Copy, Debug, Default)]
struct Limits {
    /// Δ·tan φ_r.
    repose: f64,
    /// κ_max·d² for straight and diagonal triples.
    curvature: [i32; 2],
}

/// One of the rules.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rule {
    Repose,
    Curvature,
}

/// Levels, cells and awake nodes of a ground, and the rules that act on them.
pub struct Sweeper {
    /// Load and room of the nodes.
    pub cells: TileMap<Cell>,
    /// Heights with load.
    pub levels: Levels,
    /// Awake nodes.
    pub awake: Awake,
    /// What was done.
    pub counts: Counts,
    limits: Limits,
    /// An empty set to exchange for the one that is being visited.
    spare: ActiveSet,
    changes: Vec<([i32; 2], i32)>,
    window: Box<Window>,
}

impl Sweeper {
    /// A sweeper for ground where nothing has happened; `reserve` tiles can be touched without asking for memory.
    pub fn new(lattice: Lattice, reserve: usize) -> Self {
        Self {
            cells: TileMap::new(lattice, Cell::default(), reserve),
            levels: Levels::new(lattice, reserve),
            awake: Awake::new(lattice),
            counts: Counts::default(),
            limits: Limits::default(),
            spare: ActiveSet::new(lattice),
            changes: Vec::with_capacity(RESERVE_CHANGES.min(lattice.node_count())),
            window: Box::new([0; STRIDE * STRIDE]),
        }
    }

    /// Sets the angle of repose (rad) and the largest curvature (1/m).
    pub fn set_limits(&mut self, repose: f64, curvature_max: f64) {
        let d = self.cells.lattice().spacing;
        let curvature = (curvature_max * d * d / UNIT_M).min(5e8) as i32;
        self.limits =
            Limits { repose: d * libm::tan(repose) / UNIT_M, curvature: [curvature, 2 * curvature] };
    }

    /// Puts load and room of a node; wakes what that reaches.
    pub fn put_cell(&mut self, ground: &Ground, [i, j]: [i32; 2], now: Cell) {
        self.levels.ensure([i, j], &ground.heights);
        let cell = self.cells.get_mut(i, j);
        let before = std::mem::replace(cell, now);
        self.levels.add(i, j, now.load - before.load);
        let seen = |c: &Cell| (c.load, c.inlet(), c.loaded());
        if seen(&now) != seen(&before) {
            self.awake.wake(i, j);
        }
    }

    /// Wakes every node that one of the rules would move. Tiles that are level with all tiles around are skipped.
    pub fn scan(&mut self, ground: &Ground) {
        let lattice = *ground.heights.lattice();
        let [nx, ny] = lattice.tiles();
        for tile in 0..lattice.tile_count() as u32 {
            let (a, b) = (tile % nx, tile / nx);
            let near = |k: u32, n: u32| k.saturating_sub(1)..=(k + 1).min(n - 1);
            let level = ground.heights.tile(tile as usize).err();
            let same = |t: u32| ground.heights.tile(t as usize).err() == level;
            if level.is_some() && near(b, ny).all(|b| near(a, nx).all(|a| same(b * nx + a))) {
                continue;
            }
            let (_, [columns, rows]) = lattice.tile_nodes(tile as usize);
            let mut bits = TileBits { any: u32::MAX >> (TILE_EDGE - rows), ..TileBits::default() };
            bits.rows[..rows as usize].fill(u32::MAX >> (TILE_EDGE - columns));
            for rule in [Rule::Repose, Rule::Curvature] {
                self.changes.clear();
                self.evaluate(ground, tile, &bits, rule);
                for ([i, j], _) in &self.changes {
                    self.awake.wake(*i, *j);
                }
            }
        }
    }

    /// One sweep: repose, and in the first, third, … of a step curvature, which has less to do. Returns the largest
    /// change of a node, units.
    pub fn sweep(&mut self, ground: &mut Ground) -> i32 {
        self.counts.sweeps += 1;
        std::mem::swap(&mut self.awake.repose, &mut self.spare);
        let first = self.pass(ground, Rule::Repose);
        if self.counts.sweeps.is_multiple_of(2) {
            return first;
        }
        std::mem::swap(&mut self.awake.curvature, &mut self.spare);
        let second = self.pass(ground, Rule::Curvature);
        first.max(second)
    }

    /// Evaluates a rule on the nodes of `spare`, then applies the changes and wakes what they reach.
    fn pass(&mut self, ground: &mut Ground, rule: Rule) -> i32 {
        self.changes.clear();
        for k in 0..self.spare.tiles.len() {
            let tile = self.spare.tiles[k];
            let bits = *self.spare.tile(tile);
            self.evaluate(ground, tile, &bits, rule);
        }
        self.spare.clear();
        let changes = std::mem::take(&mut self.changes);
        let mut largest = 0;
        for (node, change) in &changes {
            self.apply(ground, *node, *change);
            largest = largest.max(change.abs());
        }
        self.changes = changes;
        largest
    }

    /// Notes the changes that a rule makes to some nodes of a tile.
    fn evaluate(&mut self, ground: &Ground, tile: u32, bits: &TileBits, rule: Rule) {
        if bits.any == 0 {
            return;
        }
        let columns = bits.rows.iter().fold(0, |sum, row| sum | row);
        let rows = [bits.any.trailing_zeros() as usize, 31 - bits.any.leading_zeros() as usize];
        let sides = [columns & 0b11 != 0, columns >> (TILE_EDGE - 2) != 0];
        self.levels.window(tile, rows, sides, &ground.heights, &mut self.window);
        let nx = ground.heights.lattice().tiles()[0];
        let corner = [(tile % nx * TILE_EDGE) as i32, (tile / nx * TILE_EDGE) as i32];
        let too_curved = match rule {
            Rule::Repose => [u64::MAX; STRIDE],
            Rule::Curvature => self.too_curved(rows, columns),
        };
        for y in rows[0]..=rows[1] {
            self.counts.visited += u64::from(bits.rows[y].count_ones());
            let near = too_curved[y + 1] | too_curved[y + 2] | too_curved[y + 3];
            let mut row = bits.rows[y] & ((near << 1 | near | near >> 1) >> MARGIN) as u32;
            while row != 0 {
                let x = row.trailing_zeros() as usize;
                row &= row - 1;
                let node = [corner[0] + x as i32, corner[1] + y as i32];
                let at = (y + MARGIN) * STRIDE + x + MARGIN;
                let change = match rule {
                    Rule::Repose => self.repose_change(at, node),
                    Rule::Curvature => self.curvature_change(at, node),
                };
                if change != 0 {
                    self.changes.push((node, change));
                }
            }
        }
    }

    /// Per row of the window a bit for each node in the middle of a triple with too much curvature, among the rows
    /// `first` to `last` of the tile and the `columns`, one more on every side: only next to such a node does the rule
    /// do anything.
    fn too_curved(&self, [first, last]: [usize; 2], columns: u32) -> [u64; STRIDE] {
        let (left, right) = (columns.trailing_zeros() as usize, 31 - columns.leading_zeros() as usize);
        let [straight, diagonal] = self.limits.curvature;
        let mut bits = [0; STRIDE];
        for (y, bits) in bits.iter_mut().enumerate().skip(first + 1).take(last - first + 3) {
            let [below, here, above] = [y - 1, y, y + 1].map(|y| &self.window[y * STRIDE..(y + 1) * STRIDE]);
            for x in left + 1..=right + 3 {
                let twice = 2 * here[x];
                let along = (here[x - 1] + here[x + 1] - twice).abs();
                let across = (below[x] + above[x] - twice).abs();
                let rising = (below[x - 1] + above[x + 1] - twice).abs();
                let falling = (below[x + 1] + above[x - 1] - twice).abs();
                let too_much = along.max(across) > straight || rising.max(falling) > diagonal;
                *bits |= u64::from(too_much) << x;
            }
        }
        bits
    }

    fn apply(&mut self, ground: &mut Ground, [i, j]: [i32; 2], change: i32) {
        self.levels.ensure([i, j], &ground.heights);
        self.levels.add(i, j, change);
        ground.add_material(i, j, change);
        self.counts.gained += i64::from(change);
        self.counts.moved += i64::from(change.max(0));
        let cell = self.cells.get(i, j);
        if cell.room != OPEN && !cell.loaded() {
            self.cells.get_mut(i, j).room = (cell.room - change).max(1);
        }
        self.awake.wake(i, j);
    }

    /// The rule of repose: the fluxes over the four faces.
    fn repose_change(&self, at: usize, node: [i32; 2]) -> i32 {
        let block = &self.window[at - STRIDE - 1..at + STRIDE + 2];
        let h = |x: i32, y: i32| block[(STRIDE as i32 + 1 + y * STRIDE as i32 + x) as usize];
        let mut change = 0;
        for (a, b) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let across = h(b, a) - h(-b, -a) + h(a + b, b + a) - h(a - b, b - a);
            let flux = face_flux(h(0, 0) - h(a, b), across, self.limits.repose);
            if flux != 0 {
                change -= self.admitted(flux, node, [node[0] + a, node[1] + b]);
            }
        }
        change
    }

    /// A flux from `from` to `to` cut to what the receiver admits.
    fn admitted(&self, flux: i32, from: [i32; 2], to: [i32; 2]) -> i32 {
        if !self.cells.lattice().has(to[0], to[1]) {
            return 0;
        }
        let receiver = if flux > 0 { to } else { from };
        let inlet = self.cells.get(receiver[0], receiver[1]).inlet();
        flux.clamp(-inlet, inlet)
    }

    /// The rule of curvature: the node as the middle of four triples and the end of eight.
    fn curvature_change(&self, at: usize, node: [i32; 2]) -> i32 {
        let block = &self.window[at - 2 * STRIDE - 2..at + 2 * STRIDE + 3];
        let h = |x: usize, y: usize| block[y * STRIDE + x];
        let lines: [[i32; 5]; 4] = [
            std::array::from_fn(|s| h(s, 2)),
            std::array::from_fn(|s| h(2, s)),
            std::array::from_fn(|s| h(s, s)),
            std::array::from_fn(|s| h(s, 4 - s)),
        ];
        let mut change = 0;
        for (k, line) in lines.iter().enumerate() {
            let curvatures: [i32; 3] = std::array::from_fn(|m| line[m] - 2 * line[m + 1] + line[m + 2]);
            let limit = self.limits.curvature[k / 2];
            let [a, b, c] = curvatures.map(i32::abs);
            if a.max(b).max(c) > limit {
                change += self.line_change(&curvatures, limit, TRIPLES[k], node);
            }
        }
        change
    }

    /// What the three triples along one direction that hold the node add to it.
    fn line_change(&self, curvatures: &[i32; 3], limit: i32, [a, b]: [i32; 2], [i, j]: [i32; 2]) -> i32 {
        let mut change = 0;
        for (curvature, (middle, share)) in curvatures.iter().zip([(-1, -1), (0, 2), (1, -1)]) {
            let flux = curvature_flux(*curvature, limit);
            if flux != 0 {
                change += share * self.exchanged(flux, [i + middle * a, j + middle * b], [a, b]);
            }
        }
        change
    }

    /// What the middle of a triple receives from each end, cut to what the receivers admit; nothing where a foot
    /// stands or the ground ends.
    fn exchanged(&self, flux: i32, middle: [i32; 2], [a, b]: [i32; 2]) -> i32 {
        let ends = [[middle[0] - a, middle[1] - b], [middle[0] + a, middle[1] + b]];
        let all = [middle, ends[0], ends[1]];
        if all.iter().any(|n| !self.cells.lattice().has(n[0], n[1]) || self.cells.get(n[0], n[1]).loaded()) {
            return 0;
        }
        let inlet = |n: [i32; 2]| self.cells.get(n[0], n[1]).inlet();
        let inlet = if flux > 0 { inlet(middle) } else { inlet(ends[0]).min(inlet(ends[1])) };
        flux.clamp(-inlet, inlet)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use terraglue_subsystem::{Terrain, TerrainTile};

    /// Ground of 70 × 50 nodes with blocks of pseudo-random height.
    struct Rough(u64);

    impl Terrain for Rough {
        fn origin(&self) -> [f64; 2] {
            [0.0; 2]
        }
        fn spacing(&self) -> f64 {
            0.01
        }
        fn size(&self) -> [u32; 2] {
            [70, 50]
        }
        fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
            for (k, out) in out[..ni * nj].iter_mut().enumerate() {
                let (i, j) = ((i0 + (k % ni) as i64).min(69) / 7, (j0 + (k / ni) as i64).min(49) / 5);
                let mixed = ((i * 31 + j * 17 + 1) as u64).wrapping_mul(self.0 | 1);
                *out = ((mixed.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) % 64) as f64 * 1e-3;
            }
            TerrainTile::Varied
        }
    }

    fn heights(ground: &Ground) -> Vec<i32> {
        (0..50).flat_map(|j| (0..70).map(move |i| (i, j))).map(|(i, j)| ground.heights.units(i, j)).collect()
    }

    fn sweeper(ground: &Ground) -> Sweeper {
        let mut sweeper = Sweeper::new(*ground.heights.lattice(), 8);
        sweeper.set_limits(0.6, 40.0);
        sweeper.scan(ground);
        sweeper
    }

    fn wake_all(sweeper: &mut Sweeper, backwards: bool) {
        for k in 0..70 * 50 {
            let k = if backwards { 70 * 50 - 1 - k } else { k };
            sweeper.awake.wake(k % 70, k / 70);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn neither_order_nor_sleep_can_be_seen(seed in 0..u64::MAX, feet in prop::collection::vec(0..3500i32, 0..40)) {
            let mut grounds: [Ground; 3] = std::array::from_fn(|_| Ground::new(&Rough(seed)).expect("ground"));
            let mut sweepers = [0, 1, 2].map(|k| sweeper(&grounds[k]));
            for (sweeper, ground) in sweepers.iter_mut().zip(&grounds) {
                for (n, k) in feet.iter().enumerate() {
                    let room = [0, 700, 9000][n % 3];
                    let cell = Cell { room, load: if room == 0 { 20_480 } else { 0 }, covered: 1 };
                    sweeper.put_cell(ground, [k % 70, k / 70], cell);
                }
            }
            let before = grounds[0].heights.total_units();
            for round in 0..30 {
                wake_all(&mut sweepers[1], false);
                wake_all(&mut sweepers[2], true);
                for (sweeper, ground) in sweepers.iter_mut().zip(&mut grounds) {
                    // feet come, stand, hover and go
                    for (n, k) in feet.iter().enumerate() {
                        let room = [0, 100, OPEN, 9000][(n + round) % 4];
                        let cell = Cell { room, load: 512 * (round as i32 % 3), covered: 1 };
                        sweeper.put_cell(ground, [k % 70, k / 70], cell);
                    }
                    sweeper.sweep(ground);
                }
            }
            prop_assert!(heights(&grounds[0]) == heights(&grounds[1]), "sleep");
            prop_assert!(heights(&grounds[1]) == heights(&grounds[2]), "order");
            prop_assert_eq!(grounds[0].heights.total_units(), before);
            prop_assert_eq!(sweepers[0].counts.gained, 0);
            prop_assert!(sweepers[0].counts.visited <= sweepers[1].counts.visited);
        }

        #[test]
        fn nothing_flows_under_a_foot_that_stands(seed in 0..u64::MAX, foot in 0..3500i32) {
            let mut ground = Ground::new(&Rough(seed)).expect("ground");
            let mut sweeper = sweeper(&ground);
            let (standing, hovering) = ([foot % 70, foot / 70], [(foot + 35) % 70, foot / 70]);
            sweeper.put_cell(&ground, standing, Cell { room: 0, load: 0, covered: 1 });
            sweeper.put_cell(&ground, hovering, Cell { room: 5000, load: 0, covered: 1 });
            let start = [standing, hovering].map(|[i, j]| ground.heights.units(i, j));
            for _ in 0..100 {
                sweeper.sweep(&mut ground);
                prop_assert!(ground.heights.units(standing[0], standing[1]) <= start[0]);
                prop_assert!(ground.heights.units(hovering[0], hovering[1]) <= start[1] + 5000);
            }
        }
    }
}
