//! The nodes that are active, as one bit per node in the tiles of the ground: nothing else is visited.
//!
//! A node's next change is a function of the heights around it: the eight neighbours for the rule of repose, the
//! ends of triples two nodes away as well for the rule of curvature. A node sleeps for a rule when nothing there has
//! changed since the rule visited it; sweeping the active nodes gives the result of sweeping the whole field.

use terraglue_ground::{Lattice, TILE_EDGE};

const EDGE: i32 = TILE_EDGE as i32;

/// Bits of the nodes of a tile: a word per row, and which rows have any.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileBits {
    /// Bit x of row y.
    pub rows: [u32; TILE_EDGE as usize],
    /// Bit y: row y has a bit.
    pub any: u32,
}

/// A set of nodes of a ground.
#[derive(Clone, Debug)]
pub struct Marks {
    lattice: Lattice,
    bits: Vec<TileBits>,
    /// Tiles with nodes of the set, in the order in which they got the first.
    pub tiles: Vec<u32>,
}

impl Marks {
    /// Empty.
    pub fn new(lattice: Lattice) -> Self {
        let count = lattice.tile_count();
        Self { lattice, bits: vec![TileBits::default(); count], tiles: Vec::with_capacity(count) }
    }

    /// The nodes in a tile.
    pub fn tile(&self, tile: u32) -> &TileBits {
        &self.bits[tile as usize]
    }

    /// Whether a node of the lattice is in it.
    #[inline]
    pub fn has(&self, [i, j]: [i32; 2]) -> bool {
        let (tile, k) = self.lattice.locate(i as u32, j as u32);
        self.bits[tile].rows[k / TILE_EDGE as usize] >> (k % TILE_EDGE as usize) & 1 == 1
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.tiles.iter().flat_map(|t| &self.bits[*t as usize].rows).map(|r| r.count_ones() as usize).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.tiles.is_empty()
    }

    /// Takes all out.
    pub fn clear(&mut self) {
        for tile in self.tiles.drain(..) {
            self.bits[tile as usize] = TileBits::default();
        }
    }

    /// Adds a node of the lattice.
    #[inline]
    pub fn mark(&mut self, [i, j]: [i32; 2]) {
        let (tile, k) = self.lattice.locate(i as u32, j as u32);
        self.mark_at(tile, k);
    }

    /// Adds node k of a tile.
    #[inline]
    pub fn mark_at(&mut self, tile: usize, k: usize) {
        let (row, column) = (k / TILE_EDGE as usize, k % TILE_EDGE as usize);
        let bits = &mut self.bits[tile];
        if bits.any == 0 {
            self.tiles.push(tile as u32);
        }
        bits.any |= 1 << row;
        bits.rows[row] |= 1 << column;
    }

    /// Adds the nodes i0 … i1 − 1 of row j.
    pub fn mark_row(&mut self, i0: i32, i1: i32, j: i32) {
        let mut i = i0;
        while i < i1 {
            let (a, x) = (i / EDGE, i % EDGE);
            let n = (EDGE - x).min(i1 - i);
            self.set(a, j, (u32::MAX >> (EDGE - n)) << x);
            i += n;
        }
    }

    /// Adds all nodes within `reach` rows and columns of those of `other`.
    pub fn mark_around(&mut self, other: &Self, reach: i32) {
        let nx = self.lattice.tiles()[0];
        for tile in &other.tiles {
            let (a, b) = ((tile % nx) as i32, (tile / nx) as i32);
            let bits = other.bits[*tile as usize];
            let mut any = bits.any;
            while any != 0 {
                let y = any.trailing_zeros();
                any &= any - 1;
                // bit b of the word is column b − 2 of the tile
                let mut word = u64::from(bits.rows[y as usize]) << 2;
                for _ in 0..reach {
                    word |= word << 1 | word >> 1;
                }
                let row = b * EDGE + y as i32;
                for row in (row - reach).max(0)..=(row + reach).min(self.lattice.size[1] as i32 - 1) {
                    self.set(a, row, (word >> 2) as u32);
                    if word & 3 != 0 {
                        self.set(a - 1, row, ((word & 3) as u32) << (EDGE - 2));
                    }
                    if word >> (EDGE + 2) != 0 {
                        self.set(a + 1, row, (word >> (EDGE + 2)) as u32);
                    }
                }
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

    /// Copies the set into `out`.
    pub fn save(&self, out: &mut Vec<(u32, TileBits)>) {
        out.clear();
        out.extend(self.tiles.iter().map(|t| (*t, self.bits[*t as usize])));
    }

    /// Whether a saved set lies in this lattice.
    pub fn fits(&self, saved: &[(u32, TileBits)]) -> bool {
        saved.iter().all(|(tile, _)| (*tile as usize) < self.bits.len())
    }

    /// Back to a saved set.
    pub fn restore(&mut self, saved: &[(u32, TileBits)]) {
        self.clear();
        for (tile, bits) in saved {
            self.tiles.push(*tile);
            self.bits[*tile as usize] = *bits;
        }
    }
}

terraglue_subsystem::persist!(TileBits { rows, any });

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LATTICE: Lattice = Lattice { origin: [0.0; 2], spacing: 1.0, size: [70, 70] };

    proptest! {
        #[test]
        fn what_is_marked_around_is_near_and_nothing_else(
            nodes in prop::collection::vec((0..70i32, 0..70i32), 1..6), reach in 1..3i32,
        ) {
            let (mut changed, mut set) = (Marks::new(LATTICE), Marks::new(LATTICE));
            nodes.iter().for_each(|(i, j)| changed.mark([*i, *j]));
            set.mark_around(&changed, reach);
            let mut count = 0;
            for y in 0..70 {
                for x in 0..70 {
                    let near = nodes.iter().any(|(i, j)| (x - i).abs().max((y - j).abs()) <= reach);
                    count += usize::from(near);
                    prop_assert_eq!(set.has([x, y]), near);
                }
            }
            prop_assert_eq!(set.len(), count);
        }

        #[test]
        fn a_marked_row_ends_where_it_should(i0 in 0..69i32, n in 1..70i32, j in 0..70i32) {
            let mut set = Marks::new(LATTICE);
            let i1 = (i0 + n).min(70);
            set.mark_row(i0, i1, j);
            prop_assert_eq!(set.len() as i32, i1 - i0);
            prop_assert!(set.has([i0, j]) && set.has([i1 - 1, j]));
        }
    }
}
