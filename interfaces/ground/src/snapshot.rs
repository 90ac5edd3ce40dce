//! Exact copies of a height field's changes, for saving and rewinding; cost follows the touched tiles only.

use crate::height_field::HeightField;
use crate::lattice::TILE_NODES;

/// What was changed since the start: the sinkage of every touched tile. Refilled without allocation once it
/// was large enough.
#[derive(Clone, Debug, Default)]
pub struct HeightSnapshot {
    touched: Vec<u32>,
    sinkage: Vec<i32>,
}

impl HeightSnapshot {
    /// (number, initial − current height of the 32 × 32 nodes in units) of every tile, for serialisation.
    pub fn tiles(&self) -> impl Iterator<Item = (u32, &[i32])> {
        self.touched.iter().copied().zip(self.sinkage.chunks_exact(TILE_NODES))
    }

    /// Adds a tile, for deserialisation; `sinkage` are its 32 × 32 nodes. False when the length is wrong.
    pub fn push(&mut self, tile: u32, sinkage: &[i32]) -> bool {
        let right = sinkage.len() == TILE_NODES;
        if right {
            self.touched.push(tile);
            self.sinkage.extend_from_slice(sinkage);
        }
        right
    }
}

impl HeightField {
    /// Copies the changes since the start into `out`.
    pub fn save(&self, out: &mut HeightSnapshot) {
        out.touched.clear();
        out.sinkage.clear();
        out.touched.extend_from_slice(&self.touched);
        for tile in &self.touched {
            out.sinkage.extend_from_slice(self.pool.tile(self.tiles[*tile as usize].sinkage));
        }
    }

    /// Back to a state saved from this field or from one made of the same terrain.
    pub fn restore(&mut self, snapshot: &HeightSnapshot) {
        while let Some(tile) = self.touched.last().copied() {
            self.revert(tile as usize);
            self.touched.pop();
        }
        let count = self.tiles.len();
        for (tile, saved) in snapshot.tiles().filter(|(tile, _)| (*tile as usize) < count) {
            let (heights, sinkage) = self.touch(tile as usize);
            self.pool.tile_mut(heights).iter_mut().zip(saved).for_each(|(h, s)| *h -= s);
            self.pool.tile_mut(sinkage).copy_from_slice(saved);
        }
    }
}
