//! The ground as rays see it: a copy of a field of heights, tile by tile, and the bounds of its tiles.
//!
//! The surface is that of contact detection, the heights at the nodes, with two flat triangles in each cell between four of them;
//! they share the diagonal from (i + 1, j) to (i, j + 1). Only tiles whose generation changed are copied again.

mod march;
mod pyramid;
mod sample;
mod tile;

use pyramid::{Pyramid, Range};
use terraglue_ground::{Lattice, TILE_EDGE};
use terraglue_subsystem::{FieldInfo, FieldTile};
use tile::Tile;

pub(crate) use march::Path;

/// log₂ of the cells along the edge of a tile.
const TILE_LEVEL: u32 = TILE_EDGE.trailing_zeros();

/// Heights of a ground.
#[derive(Debug)]
pub(crate) struct Ground {
    lattice: Lattice,
    /// Nodes along the edge of a tile of the source.
    source_edge: u32,
    /// Of the source's tiles; none: not copied yet.
    generations: Vec<Option<u64>>,
    /// Tiles along x and y of the copy.
    count: [u32; 2],
    tiles: Vec<Tile>,
    /// Tiles whose bounds are out of date.
    stale: Vec<u32>,
    above: Pyramid,
}

impl Ground {
    /// Ground on the lattice of a field, without heights so far; none: the field has no lattice.
    pub fn new(info: &FieldInfo) -> Option<Self> {
        let lattice = Lattice { origin: info.origin, spacing: info.spacing, size: info.size };
        let finite = info.origin.iter().all(|x| x.is_finite()) && info.spacing.is_finite();
        if info.tile_edge == 0 || lattice.node_count() == 0 || !(finite && info.spacing > 0.0) {
            return None;
        }
        let sources = info.size.map(|n| n.div_ceil(info.tile_edge) as usize);
        let count = lattice.tiles();
        Some(Self {
            lattice,
            source_edge: info.tile_edge,
            generations: vec![None; sources[0] * sources[1]],
            count,
            tiles: vec![Tile::default(); lattice.tile_count()],
            stale: Vec::with_capacity(lattice.tile_count()),
            above: Pyramid::new(count),
        })
    }

    /// Copies the tiles that changed. `read` answers tile (a, b) of the field, none where it cannot be read: that is no ground.
    pub fn update<'a>(&mut self, mut read: impl FnMut(u32, u32) -> Option<FieldTile<'a>>) {
        let [columns, rows] = self.lattice.size.map(|n| n.div_ceil(self.source_edge));
        for b in 0..rows {
            for a in 0..columns {
                let tile = read(a, b);
                let known = &mut self.generations[(b * columns + a) as usize];
                let generation = tile.as_ref().map(|t| t.generation);
                if generation.is_some() && *known == generation {
                    continue;
                }
                *known = generation;
                self.copy([a, b], tile);
            }
        }
        self.refresh();
    }

    /// Copies a tile of the source into those tiles of the copy that hold its nodes.
    fn copy(&mut self, at: [u32; 2], tile: Option<FieldTile>) {
        let edge = self.source_edge;
        let first = at.map(|k| k * edge);
        let end: [u32; 2] = std::array::from_fn(|k| (first[k] + edge).min(self.lattice.size[k]));
        let (low, high) = (first.map(|k| k / TILE_EDGE), end.map(|k| (k - 1) / TILE_EDGE));
        for b in low[1]..=high[1] {
            for a in low[0]..=high[0] {
                let corner = [a * TILE_EDGE, b * TILE_EDGE];
                let from: [u32; 2] = std::array::from_fn(|k| first[k].max(corner[k]));
                let to: [u32; 2] = std::array::from_fn(|k| end[k].min(corner[k] + TILE_EDGE));
                let own = &mut self.tiles[(b * self.count[0] + a) as usize];
                let borders =
                    own.write(from.map(|k| k % TILE_EDGE), [to[0] - from[0], to[1] - from[1]], |i, j| {
                        let place = (from[1] + j - first[1]) * edge + from[0] + i - first[0];
                        tile.as_ref().map_or(f64::NAN, |t| t.values.at(place as usize))
                    });
                self.mark([a, b], borders);
            }
        }
    }

    /// A tile changed; where its first column or row did, so did the rim of the tile before it.
    fn mark(&mut self, [a, b]: [u32; 2], [column, row]: [bool; 2]) {
        self.stale.push(b * self.count[0] + a);
        for (i, j, changed) in [(1, 0, column), (0, 1, row), (1, 1, column || row)] {
            if changed && a >= i && b >= j {
                self.stale.push((b - j) * self.count[0] + a - i);
            }
        }
    }

    /// Takes rims from the neighbours and measures bounds anew.
    fn refresh(&mut self) {
        let mut stale = std::mem::take(&mut self.stale);
        stale.sort_unstable();
        stale.dedup();
        for number in &stale {
            let [a, b] = [number % self.count[0], number / self.count[0]];
            let mut rim = [f64::NAN; 2 * TILE_EDGE as usize + 1];
            for (k, height) in rim.iter_mut().enumerate() {
                *height = self.node(rim_node([a, b], k as u32));
            }
            let bounds = self.tiles[*number as usize].measure(&rim);
            self.above.set([a, b], bounds);
        }
        self.above.join();
        stale.clear();
        self.stale = stale;
    }

    /// Height of a node, m; NaN outside.
    fn node(&self, [i, j]: [u32; 2]) -> f64 {
        if i >= self.lattice.size[0] || j >= self.lattice.size[1] {
            return f64::NAN;
        }
        let tile = &self.tiles[(j / TILE_EDGE * self.count[0] + i / TILE_EDGE) as usize];
        tile.height(i % TILE_EDGE, j % TILE_EDGE)
    }

    /// Heights at the corners of a cell: (i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1).
    #[inline]
    fn cell(&self, [i, j]: [u32; 2]) -> [f64; 4] {
        let tile = &self.tiles[(j / TILE_EDGE * self.count[0] + i / TILE_EDGE) as usize];
        tile.cell(i % TILE_EDGE, j % TILE_EDGE)
    }

    /// Bounds of a block of 2^level cells along an edge.
    #[inline]
    fn range(&self, level: u32, at: [u32; 2]) -> Range {
        if level >= TILE_LEVEL {
            return self.above.range(level - TILE_LEVEL, at);
        }
        let down = TILE_LEVEL - level;
        let tile = &self.tiles[((at[1] >> down) * self.count[0] + (at[0] >> down)) as usize];
        tile.range(level, at.map(|k| k & ((1 << down) - 1)))
    }

    /// Level of the block that holds everything.
    fn top(&self) -> u32 {
        TILE_LEVEL + self.above.top()
    }
}

/// Node number k on the rim of a tile: the column behind it from below, then the row behind it, without the corner.
fn rim_node([a, b]: [u32; 2], k: u32) -> [u32; 2] {
    let (i, j) = (a * TILE_EDGE, b * TILE_EDGE);
    if k <= TILE_EDGE { [i + TILE_EDGE, j + k] } else { [i + k - TILE_EDGE - 1, j + TILE_EDGE] }
}
