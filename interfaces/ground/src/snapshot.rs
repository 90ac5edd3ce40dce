//! Exact copies of a height field's changes, for saving and rewinding. Saving again and going back touch only the tiles
//! that were written in between.

use crate::height_field::HeightField;
use crate::identity::Origin;
use crate::lattice::TILE_NODES;

/// Number of entries at the start that two lists of tiles have in common.
pub(crate) fn common(a: &[u32], b: &[u32]) -> usize {
    a.iter().zip(b).take_while(|(a, b)| a == b).count()
}

/// Changes since the start: the sinkage of every touched tile. Refilled without allocation once it was large enough.
#[derive(Clone, Debug, Default)]
pub struct HeightSnapshot {
    touched: Vec<u32>,
    sinkage: Vec<i32>,
    origin: Origin,
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
            self.origin = Origin::default();
            self.touched.push(tile);
            self.sinkage.extend_from_slice(sinkage);
        }
        right
    }
}

impl HeightField {
    /// Copies the changes since the start into `out`; what `out` holds already of them is left as it is.
    pub fn save(&self, out: &mut HeightSnapshot) {
        out.origin.set(&self.identity);
        let same = common(&self.touched, &out.touched);
        out.origin.truncate(same);
        out.touched.truncate(same);
        out.touched.extend_from_slice(&self.touched[same..]);
        out.sinkage.resize(self.touched.len() * TILE_NODES, 0);
        let places = out.sinkage.chunks_exact_mut(TILE_NODES);
        for (k, (tile, place)) in self.touched.iter().zip(places).enumerate() {
            let tile = &self.tiles[*tile as usize];
            if !out.origin.holds(k, tile.generation) {
                place.copy_from_slice(self.pool.tile(tile.sinkage));
                out.origin.note(k, tile.generation);
            }
        }
    }

    /// Back to a state saved from this field or from one made of the same terrain. A tile that comes back has the
    /// generation that it had when it was saved from this field.
    pub fn restore(&mut self, snapshot: &HeightSnapshot) {
        let own = snapshot.origin.is(&self.identity);
        let same = common(&self.touched, &snapshot.touched);
        while self.touched.len() > same {
            if let Some(tile) = self.touched.pop() {
                self.revert(tile as usize);
            }
        }
        let count = self.tiles.len();
        for (k, (tile, saved)) in snapshot.tiles().enumerate().filter(|(_, (t, _))| (*t as usize) < count) {
            let tile = tile as usize;
            if own && k < same && snapshot.origin.holds(k, self.tiles[tile].generation) {
                continue;
            }
            self.put_sinkage(tile, saved);
            if let Some(generation) = snapshot.origin.generation(k).filter(|_| own) {
                self.tiles[tile].generation = generation;
            }
        }
    }
}

impl terraglue_subsystem::bytes::Persist for HeightSnapshot {
    fn write(&self, out: &mut Vec<u8>) {
        self.touched.write(out);
        self.sinkage.iter().for_each(|s| s.write(out));
    }
    fn read(from: &mut &[u8]) -> terraglue_subsystem::Result<Self> {
        let (touched, sinkage) = read_tiles(from)?;
        Ok(Self { touched, sinkage, origin: Origin::default() })
    }
}

/// Numbers of tiles and the values of their nodes, as a snapshot writes them.
pub(crate) fn read_tiles<T: terraglue_subsystem::bytes::Persist>(
    from: &mut &[u8],
) -> terraglue_subsystem::Result<(Vec<u32>, Vec<T>)> {
    use terraglue_subsystem::bytes::{Persist, wrong};
    let touched = Vec::<u32>::read(from)?;
    let count = touched.len() * TILE_NODES;
    if count > from.len() {
        return Err(wrong("they end too early"));
    }
    let values = (0..count).map(|_| T::read(from)).collect::<terraglue_subsystem::Result<_>>()?;
    Ok((touched, values))
}
