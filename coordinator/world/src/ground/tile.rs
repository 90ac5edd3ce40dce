//! Heights of 32 × 32 nodes with the rim of the next tiles, and the bounds of its blocks of cells.

use super::TILE_LEVEL;
use super::pyramid::{Level, Range};
use terraglue_ground::TILE_EDGE;

/// Nodes along an edge, the rim included.
const EDGE: usize = TILE_EDGE as usize + 1;

/// A tile; without stored heights it is level, or absent.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    level: f64,
    heights: Vec<f64>,
    /// Bounds of blocks of 2, 4, … 2^(`TILE_LEVEL` − 1) cells along an edge; empty where heights are.
    bounds: Vec<Level>,
    whole: Range,
}

impl Default for Tile {
    fn default() -> Self {
        Self { level: f64::NAN, heights: Vec::new(), bounds: Vec::new(), whole: Range::EMPTY }
    }
}

impl Tile {
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

    /// Bounds of a block of 2^level cells along an edge.
    #[inline]
    pub fn range(&self, level: u32, at: [u32; 2]) -> Range {
        match level {
            _ if self.heights.is_empty() => self.whole,
            0 => Range::of(&self.cell(at[0], at[1])),
            _ => self.bounds[level as usize - 1].range(at),
        }
    }

    /// Writes a block of own nodes; whether one in the first column, one in the first row changed.
    pub fn write(&mut self, first: [u32; 2], size: [u32; 2], height: impl Fn(u32, u32) -> f64) -> [bool; 2] {
        if self.heights.is_empty() {
            self.heights = vec![self.level; EDGE * EDGE];
        }
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

    /// Takes the rim and measures the bounds; those of the whole.
    pub fn measure(&mut self, rim: &[f64; 2 * TILE_EDGE as usize + 1]) -> Range {
        if self.heights.is_empty() {
            if rim.iter().all(|h| h.to_bits() == self.level.to_bits()) {
                return self.whole;
            }
            self.heights = vec![self.level; EDGE * EDGE];
        }
        for (k, height) in rim.iter().enumerate() {
            let place = if k < EDGE { k * EDGE + EDGE - 1 } else { (EDGE - 1) * EDGE + k - EDGE };
            self.heights[place] = *height;
        }
        let first = self.heights[0];
        if self.heights.iter().all(|h| h.to_bits() == first.to_bits()) {
            let whole = Range::of(&[first; 4]);
            *self = Self { level: first, heights: Vec::new(), bounds: Vec::new(), whole };
            return whole;
        }
        self.bounds.resize_with(TILE_LEVEL as usize - 1, Level::default);
        let cells = |[i, j]: [u32; 2]| {
            let k = j as usize * EDGE + i as usize;
            Range::of_rows(
                &self.heights[k..k + 3],
                &self.heights[k + EDGE..k + EDGE + 3],
                &self.heights[k + 2 * EDGE..k + 2 * EDGE + 3],
            )
        };
        self.bounds[0].fill(TILE_EDGE / 2, cells);
        for k in 1..self.bounds.len() {
            let (below, own) = self.bounds.split_at_mut(k);
            own[0].join(&below[k - 1]);
        }
        let last = &self.bounds[self.bounds.len() - 1];
        self.whole =
            [[0, 0], [1, 0], [0, 1], [1, 1]].iter().fold(Range::EMPTY, |r, at| r.joined(last.range(*at)));
        self.whole
    }
}
