//! Heights with load, as the rules read them: a copy in tiles that is filled where something happens.

use terraglue_ground::{HeightField, Lattice, TILE_EDGE, TileMap, TileMapSnapshot};

const TILE: usize = TILE_EDGE as usize;
/// Nodes around a tile that a window shows.
pub const MARGIN: usize = 2;
/// Nodes along the edge of a window.
pub const STRIDE: usize = TILE + 2 * MARGIN;

/// Levels of a tile and of two nodes around it, x fastest; beyond the edge of the ground it repeats the nearest node.
pub type Window = [i32; STRIDE * STRIDE];

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

    /// Makes the tile of a node of the lattice present.
    #[inline]
    pub fn ensure(&mut self, [i, j]: [i32; 2], heights: &HeightField) {
        let (tile, _) = heights.lattice().locate(i as u32, j as u32);
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
        if change == 0 || !lattice.has(i, j) {
            return;
        }
        let (tile, k) = lattice.locate(i as u32, j as u32);
        if self.tiles.tile(tile).is_some() {
            self.tiles.tile_mut(tile)[k] += change;
        }
    }

    /// Reads the rows `first` to `last` of a tile, two more on either side, into `out`; left and right of the tile
    /// only where `sides` says so.
    pub fn window(
        &self,
        tile: u32,
        [first, last]: [usize; 2],
        sides: [bool; 2],
        heights: &HeightField,
        out: &mut Window,
    ) {
        let lattice = heights.lattice();
        let nx = lattice.tiles()[0];
        let (a, b) = (tile % nx, tile / nx);
        let inside = (lattice.size[0] - a * TILE_EDGE).min(TILE_EDGE) as usize;
        for y in first..=last + 2 * MARGIN {
            let j =
                ((b * TILE_EDGE) as i64 + y as i64 - MARGIN as i64).clamp(0, i64::from(lattice.size[1]) - 1);
            let row = &mut out[y * STRIDE..(y + 1) * STRIDE];
            self.row(a, j as u32, heights, &mut row[MARGIN..MARGIN + TILE]);
            let edge = row[MARGIN + inside - 1];
            row[MARGIN + inside..].fill(edge);
            if sides[0] {
                let left = (a > 0).then(|| self.pair(a - 1, j as u32, TILE - MARGIN, heights));
                let left = left.unwrap_or([row[MARGIN]; MARGIN]);
                row[..MARGIN].copy_from_slice(&left);
            }
            if sides[1] && a + 1 < nx {
                row[MARGIN + TILE..].copy_from_slice(&self.pair(a + 1, j as u32, 0, heights));
                if lattice.size[0] - (a + 1) * TILE_EDGE == 1 {
                    row[STRIDE - 1] = row[STRIDE - 2];
                }
            }
        }
    }

    #[inline]
    fn row(&self, a: u32, j: u32, heights: &HeightField, out: &mut [i32]) {
        let tile = (j / TILE_EDGE * heights.lattice().tiles()[0] + a) as usize;
        let first = (j % TILE_EDGE) as usize * TILE;
        match (self.tiles.tile(tile), heights.tile(tile)) {
            (Some(levels), _) => out.copy_from_slice(&levels[first..first + TILE]),
            (None, Ok(units)) => out.copy_from_slice(&units[first..first + TILE]),
            (None, Err(units)) => out.fill(units),
        }
    }

    #[inline]
    fn pair(&self, a: u32, j: u32, column: usize, heights: &HeightField) -> [i32; MARGIN] {
        let tile = (j / TILE_EDGE * heights.lattice().tiles()[0] + a) as usize;
        let first = (j % TILE_EDGE) as usize * TILE + column;
        match (self.tiles.tile(tile), heights.tile(tile)) {
            (Some(levels), _) => [levels[first], levels[first + 1]],
            (None, Ok(units)) => [units[first], units[first + 1]],
            (None, Err(units)) => [units; MARGIN],
        }
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
