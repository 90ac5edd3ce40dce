//! Heights with load, as the rules read them: a copy in tiles that is filled where something happens.

use terraglue_ground::{HeightField, Lattice, TILE_EDGE, TileMap, TileMapSnapshot};

/// Nodes along the edge of a neighbourhood.
pub const EDGE: usize = 5;
/// Position of the middle of a neighbourhood.
pub const MIDDLE: usize = 12;

/// Levels of the 5 × 5 nodes around a node, x fastest.
pub type Neighbourhood = [i32; EDGE * EDGE];

/// Height plus force-equivalent height of every node, units. A tile that is absent has no load.
#[derive(Clone, Debug)]
pub struct Levels {
    tiles: TileMap<i32>,
}

impl Levels {
    /// All absent.
    pub fn new(lattice: Lattice, reserve: usize) -> Self {
        Self { tiles: TileMap::new(lattice, 0, reserve) }
    }

    /// Makes the tile of a node present.
    pub fn ensure(&mut self, [i, j]: [i32; 2], heights: &HeightField) {
        let (i, j) = heights.lattice().clamp(i, j);
        let (tile, _) = heights.lattice().locate(i, j);
        if self.tiles.tile(tile).is_none() {
            match heights.tile(tile) {
                Ok(units) => self.tiles.tile_mut(tile).copy_from_slice(units),
                Err(units) => self.tiles.tile_mut(tile).fill(units),
            }
        }
    }

    /// The height or the load of a node has changed by `change`.
    #[inline]
    pub fn add(&mut self, i: i32, j: i32, change: i32) {
        let lattice = self.tiles.lattice();
        if !lattice.has(i, j) {
            return;
        }
        let (tile, k) = lattice.locate(i as u32, j as u32);
        if self.tiles.tile(tile).is_some() {
            self.tiles.tile_mut(tile)[k] += change;
        }
    }

    #[inline]
    fn level(&self, i: i32, j: i32, heights: &HeightField) -> i32 {
        let (i, j) = heights.lattice().clamp(i, j);
        let (tile, k) = heights.lattice().locate(i, j);
        match self.tiles.tile(tile) {
            Some(levels) => levels[k],
            None => heights.units(i as i32, j as i32),
        }
    }

    /// The neighbourhood of a node of the lattice; beyond the edge it repeats the nearest node.
    #[inline]
    pub fn around(&self, i: i32, j: i32, heights: &HeightField) -> Neighbourhood {
        let mut out = [0; EDGE * EDGE];
        let edge = TILE_EDGE as i32;
        let (x, y) = (i % edge, j % edge);
        let lattice = heights.lattice();
        let inner = x >= 2 && y >= 2 && x < edge - 2 && y < edge - 2 && lattice.has(i + 2, j + 2);
        let (tile, k) = lattice.locate(i as u32, j as u32);
        if let (true, Some(levels)) = (inner, self.tiles.tile(tile)) {
            let first = k - 2 * TILE_EDGE as usize - 2;
            let rows = levels[first..first + 4 * TILE_EDGE as usize + EDGE].chunks(TILE_EDGE as usize);
            for (row, out) in rows.zip(out.as_chunks_mut::<EDGE>().0) {
                if let Some(five) = row.first_chunk::<EDGE>() {
                    *out = *five;
                }
            }
            return out;
        }
        for (row, out) in out.chunks_exact_mut(EDGE).enumerate() {
            for (column, out) in out.iter_mut().enumerate() {
                *out = self.level(i + column as i32 - 2, j + row as i32 - 2, heights);
            }
        }
        out
    }

    /// Copies the tiles into `out`.
    pub fn save(&self, out: &mut TileMapSnapshot<i32>) {
        self.tiles.save(out);
    }

    /// Back to saved tiles.
    pub fn restore(&mut self, saved: &TileMapSnapshot<i32>) {
        self.tiles.restore(saved);
    }
}
