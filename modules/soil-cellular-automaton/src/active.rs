//! The nodes that are awake, as one bit per node in the tiles of the ground: nothing else is visited.
//!
//! A node's next change is a function of the heights around it: the eight neighbours for the rule of repose, the
//! ends of triples two nodes away as well for the rule of curvature. A node is awake for a rule exactly as long
//! as something there changed since the rule visited it; sweeping the awake nodes gives what sweeping the whole
//! field would give.

use terraglue_ground::{Lattice, TILE_EDGE};

const EDGE: i32 = TILE_EDGE as i32;

/// Which nodes around a change one rule has to visit: per row from −2 to 2 the columns from −2 (bit 0) to 2.
pub type Reach = [u32; 5];
/// The eight neighbours.
pub const NEIGHBOURS: Reach = [0, 0b01110, 0b01110, 0b01110, 0];
/// The neighbours and the far ends of triples.
pub const TRIPLES: Reach = [0b10101, 0b01110, 0b11111, 0b01110, 0b10101];

/// Awake nodes of a tile: a word per row, and which rows have any.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileBits {
    /// Bit x of row y.
    pub rows: [u32; TILE_EDGE as usize],
    /// Bit y: row y has awake nodes.
    pub any: u32,
}

/// Awake nodes of a ground.
#[derive(Clone, Debug)]
pub struct ActiveSet {
    lattice: Lattice,
    bits: Vec<TileBits>,
    /// Tiles with awake nodes, in the order in which they woke up.
    pub tiles: Vec<u32>,
}

impl ActiveSet {
    /// Nobody is awake.
    pub fn new(lattice: Lattice) -> Self {
        let count = lattice.tile_count();
        Self { lattice, bits: vec![TileBits::default(); count], tiles: Vec::with_capacity(count) }
    }

    /// Awake nodes of a tile.
    pub fn tile(&self, tile: u32) -> &TileBits {
        &self.bits[tile as usize]
    }

    /// Number of awake nodes.
    pub fn len(&self) -> usize {
        self.tiles.iter().flat_map(|t| &self.bits[*t as usize].rows).map(|r| r.count_ones() as usize).sum()
    }

    /// Whether all sleep.
    pub fn is_empty(&self) -> bool {
        self.tiles.is_empty()
    }

    /// All go to sleep.
    pub fn clear(&mut self) {
        for tile in self.tiles.drain(..) {
            self.bits[tile as usize] = TileBits::default();
        }
    }

    /// Wakes the nodes that a change at node (i, j) of the lattice reaches.
    #[inline]
    pub fn wake(&mut self, i: i32, j: i32, reach: &Reach) {
        let (a, x) = (i / EDGE, i % EDGE);
        let rows = j - 2..=j + 2;
        for (row, pattern) in rows.zip(reach) {
            if *pattern == 0 || row < 0 || row >= self.lattice.size[1] as i32 {
                continue;
            }
            // bit b of the word is column b − 2 of the tile
            let word = u64::from(*pattern) << x;
            self.set(a, row, (word >> 2) as u32);
            if word & 3 != 0 {
                self.set(a - 1, row, ((word & 3) as u32) << (EDGE - 2));
            }
            if word >> (EDGE + 2) != 0 {
                self.set(a + 1, row, (word >> (EDGE + 2)) as u32);
            }
        }
    }

    #[inline]
    fn set(&mut self, a: i32, row: i32, columns: u32) {
        let [nx, _] = self.lattice.tiles();
        if a < 0 || a >= nx as i32 {
            return;
        }
        let inside = (self.lattice.size[0] as i32 - a * EDGE).min(EDGE) as u32;
        let columns = columns & (u32::MAX >> (TILE_EDGE - inside));
        let tile = (row / EDGE) as u32 * nx + a as u32;
        let bits = &mut self.bits[tile as usize];
        if columns == 0 {
            return;
        }
        if bits.any == 0 {
            self.tiles.push(tile);
        }
        bits.any |= 1 << (row % EDGE);
        bits.rows[(row % EDGE) as usize] |= columns;
    }

    /// Copies the awake tiles into `out`.
    pub fn save(&self, out: &mut Vec<(u32, TileBits)>) {
        out.clear();
        out.extend(self.tiles.iter().map(|t| (*t, self.bits[*t as usize])));
    }

    /// Back to saved tiles.
    pub fn restore(&mut self, saved: &[(u32, TileBits)]) {
        self.clear();
        for (tile, bits) in saved {
            self.tiles.push(*tile);
            self.bits[*tile as usize] = *bits;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn waking_finds_the_nodes_in_reach_and_no_others(i in 0..70i32, j in 0..70i32) {
            let lattice = Lattice { origin: [0.0; 2], spacing: 1.0, size: [70, 70] };
            let mut set = ActiveSet::new(lattice);
            set.wake(i, j, &TRIPLES);
            let mut expected = 0;
            for y in 0..70 {
                for x in 0..70 {
                    let (dx, dy) = ((x - i).abs(), (y - j).abs());
                    let far = dx.max(dy) == 2 && (dx == 0 || dy == 0 || dx == dy);
                    let reached = dx.max(dy) < 2 || far;
                    expected += usize::from(reached);
                    let (tile, k) = lattice.locate(x as u32, y as u32);
                    let awake = set.tile(tile as u32).rows[k / 32] >> (k % 32) & 1 == 1;
                    prop_assert_eq!(awake, reached);
                }
            }
            prop_assert_eq!(set.len(), expected);
        }
    }
}
