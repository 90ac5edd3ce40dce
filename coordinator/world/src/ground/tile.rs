//! Heights of 32 × 32 nodes with the rim of the next tiles, and the bounds of its blocks of cells.

use super::TILE_LEVEL;
use super::pyramid::Quarters;
use terraglue_ground::TILE_EDGE;

/// Nodes along an edge, the rim included.
const EDGE: usize = TILE_EDGE as usize + 1;
/// Blocks of 2, 4, … 32 cells along an edge.
const BLOCKS: usize = 16 * 16 + 8 * 8 + 4 * 4 + 2 * 2 + 1;
/// No ground.
pub(super) const NOTHING: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

/// A tile; without stored heights it is level, or absent.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    level: f64,
    heights: Vec<f64>,
    /// From the smallest on, each size x fastest; empty where heights are.
    blocks: Vec<Quarters>,
}

impl Default for Tile {
    fn default() -> Self {
        Self { level: f64::NAN, heights: Vec::new(), blocks: Vec::new() }
    }
}

impl Tile {
    /// The height of a tile that is level all over, its rim included.
    #[inline]
    pub fn level(&self) -> Option<f64> {
        self.heights.is_empty().then_some(self.level)
    }

    /// Height of one of the own nodes, m.
    #[inline]
    pub fn height(&self, i: u32, j: u32) -> f64 {
        if self.heights.is_empty() { self.level } else { self.heights[j as usize * EDGE + i as usize] }
    }

    /// Heights at the corners of a cell.
    #[inline]
    pub fn cell(&self, i: u32, j: u32) -> [f64; 4] {
        if self.heights.is_empty() {
            return [self.level; 4];
        }
        let k = j as usize * EDGE + i as usize;
        let h = &self.heights[k..k + EDGE + 2];
        [h[0], h[1], h[EDGE], h[EDGE + 1]]
    }

    /// A block of 2^level cells along an edge, 1 ≤ level, of a tile that is not level.
    #[inline]
    pub fn block(&self, level: u32, at: [u32; 2]) -> &Quarters {
        &self.blocks[first(level) + ((at[1] << (TILE_LEVEL - level)) + at[0]) as usize]
    }

    /// Writes a block of own nodes; whether one in the first column, one in the first row changed.
    pub fn write(&mut self, first: [u32; 2], size: [u32; 2], height: impl Fn(u32, u32) -> f64) -> [bool; 2] {
        self.store();
        let mut borders = [false; 2];
        for j in 0..size[1] {
            for i in 0..size[0] {
                let (x, y) = (first[0] + i, first[1] + j);
                let (old, new) = (&mut self.heights[y as usize * EDGE + x as usize], height(i, j));
                let changed = old.to_bits() != new.to_bits();
                borders = [borders[0] | (changed && x == 0), borders[1] | (changed && y == 0)];
                *old = new;
            }
        }
        borders
    }

    fn store(&mut self) {
        if self.heights.is_empty() {
            self.heights = vec![self.level; EDGE * EDGE];
        }
    }

    /// Takes the rim and measures the bounds; those of the whole.
    pub fn measure(&mut self, rim: &[f64; 2 * TILE_EDGE as usize + 1]) -> [f32; 2] {
        let same = |h: &f64| h.to_bits() == self.level.to_bits();
        if self.heights.is_empty() && rim.iter().all(same) {
            return range([self.level; 4]);
        }
        self.store();
        for (k, height) in rim.iter().enumerate() {
            let place = if k < EDGE { k * EDGE + EDGE - 1 } else { (EDGE - 1) * EDGE + k - EDGE };
            self.heights[place] = *height;
        }
        let first = self.heights[0];
        if self.heights.iter().all(|h| h.to_bits() == first.to_bits()) {
            *self = Self { level: first, heights: Vec::new(), blocks: Vec::new() };
            return range([first; 4]);
        }
        self.blocks.resize(BLOCKS, Quarters::EMPTY);
        self.measure_cells();
        self.join();
        self.blocks[BLOCKS - 1].whole()
    }

    /// Bounds of the smallest blocks.
    fn measure_cells(&mut self) {
        for j in 0..TILE_EDGE {
            for i in 0..TILE_EDGE {
                let of_cell = range(self.cell(i, j));
                let block = &mut self.blocks[(j / 2 * (TILE_EDGE / 2) + i / 2) as usize];
                block.set((i & 1 | (j & 1) << 1) as usize, of_cell);
            }
        }
    }

    /// Bounds of the others.
    fn join(&mut self) {
        for level in 2..=TILE_LEVEL {
            let (below, edge) = (first(level - 1), TILE_EDGE >> (level - 1));
            for k in 0..edge * edge {
                let (i, j) = (k % edge, k / edge);
                let part = self.blocks[below + k as usize].whole();
                let block = &mut self.blocks[first(level) + (j / 2 * (edge / 2) + i / 2) as usize];
                block.set((i & 1 | (j & 1) << 1) as usize, part);
            }
        }
    }
}

/// Place of the first block of 2^level cells along an edge.
#[inline]
const fn first(level: u32) -> usize {
    [0, 0, 256, 320, 336, 340][level as usize]
}

/// Lowest and highest corner of a cell; a cell without one of them is no ground.
#[inline]
fn range(corners: [f64; 4]) -> [f32; 2] {
    let h = corners.map(|h| h as f32);
    // what is not a number stays one in the sum
    if !(h[0] + h[1] + h[2] + h[3]).is_finite() {
        return NOTHING;
    }
    [h[0].min(h[1]).min(h[2].min(h[3])), h[0].max(h[1]).max(h[2].max(h[3]))]
}
