//! State per node in tiles: the memory of soils (sinkage, shear, yield) without cost for untouched ground.

use crate::identity::{Identity, Origin};
use crate::lattice::{Lattice, TILE_NODES};
use crate::pool::Pool;
use crate::snapshot::common;
use terraglue_subsystem::{FieldTile, TileValues};

const ABSENT: u32 = u32::MAX;

/// A value of type T for every node of a lattice. A tile exists from its first write on; a node of an absent
/// tile reads as the default. Reading and writing are O(1) by index, at any age.
#[derive(Clone, Debug)]
pub struct TileMap<T> {
    lattice: Lattice,
    tiles: Vec<u32>,
    generations: Vec<u64>,
    touched: Vec<u32>,
    pool: Pool<T>,
    default: T,
    /// Grows with every write and never goes back: the source of the tiles' generations.
    writes: u64,
    identity: Identity,
}

/// Exact copy of the tiles of a [`TileMap`] that exist; refilled without allocation once it was large enough, and without
/// reading tiles that are unchanged since.
#[derive(Clone, Debug)]
pub struct TileMapSnapshot<T> {
    touched: Vec<u32>,
    values: Vec<T>,
    origin: Origin,
}

impl<T> Default for TileMapSnapshot<T> {
    fn default() -> Self {
        Self { touched: Vec::new(), values: Vec::new(), origin: Origin::default() }
    }
}

impl<T: Copy> TileMap<T> {
    /// All nodes at `default`. `reserve` tiles can be touched before memory is allocated again.
    pub fn new(lattice: Lattice, default: T, reserve: usize) -> Self {
        let count = lattice.tile_count();
        let mut pool = Pool::new(default);
        pool.reserve(reserve.min(count));
        let touched = Vec::with_capacity(count);
        let (tiles, generations) = (vec![ABSENT; count], vec![0; count]);
        Self { lattice, tiles, generations, touched, pool, default, writes: 0, identity: Identity::default() }
    }

    /// Lattice of the nodes.
    #[inline]
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Value of node (i, j); indices outside read the nearest node of the edge.
    #[inline]
    pub fn get(&self, i: i32, j: i32) -> T {
        let (i, j) = self.lattice.clamp(i, j);
        let (tile, k) = self.lattice.locate(i, j);
        match self.tiles[tile] {
            ABSENT => self.default,
            slot => self.pool.value(slot, k),
        }
    }

    /// Node (i, j) for writing; its tile exists from now on. Indices outside mean the nearest node of the edge.
    #[inline]
    pub fn get_mut(&mut self, i: i32, j: i32) -> &mut T {
        let (i, j) = self.lattice.clamp(i, j);
        let (tile, k) = self.lattice.locate(i, j);
        &mut self.tile_mut(tile)[k]
    }

    /// Writes node (i, j).
    #[inline]
    pub fn set(&mut self, i: i32, j: i32, value: T) {
        *self.get_mut(i, j) = value;
    }

    /// The nodes of a tile, x fastest; `None` while all are at the default.
    #[inline]
    pub fn tile(&self, tile: usize) -> Option<&[T]> {
        match self.tiles[tile] {
            ABSENT => None,
            slot => Some(self.pool.tile(slot)),
        }
    }

    /// The nodes of a tile for writing; it exists from now on.
    #[inline]
    pub fn tile_mut(&mut self, tile: usize) -> &mut [T] {
        self.writes += 1;
        self.generations[tile] = self.writes;
        if self.tiles[tile] == ABSENT {
            let slot = self.pool.take();
            self.pool.tile_mut(slot).fill(self.default);
            self.tiles[tile] = slot;
            self.touched.push(tile as u32);
        }
        self.pool.tile_mut(self.tiles[tile])
    }

    /// Numbers of the tiles that exist, in the order of their first write.
    pub fn touched(&self) -> &[u32] {
        &self.touched
    }

    /// New with every write to the tile; equal numbers mean equal contents.
    pub fn generation(&self, tile: usize) -> u64 {
        self.generations[tile]
    }

    /// All nodes back to the default.
    pub fn clear(&mut self) {
        self.drop_tiles(0);
    }

    /// Copies all tiles that exist into `out`; what `out` holds already of them is left as it is.
    pub fn save(&self, out: &mut TileMapSnapshot<T>) {
        out.origin.set(&self.identity);
        let same = common(&self.touched, &out.touched);
        out.origin.truncate(same);
        out.touched.truncate(same);
        out.touched.extend_from_slice(&self.touched[same..]);
        out.values.resize(self.touched.len() * TILE_NODES, self.default);
        let places = out.values.chunks_exact_mut(TILE_NODES);
        for (k, (tile, place)) in self.touched.iter().zip(places).enumerate() {
            let tile = *tile as usize;
            if !out.origin.holds(k, self.generations[tile]) {
                place.copy_from_slice(self.pool.tile(self.tiles[tile]));
                out.origin.note(k, self.generations[tile]);
            }
        }
    }

    /// Back to a state made by [`TileMap::save`] of this map or of one on the same lattice. A tile that comes back has
    /// the generation that it had when it was saved from this map.
    pub fn restore(&mut self, snapshot: &TileMapSnapshot<T>) {
        let own = snapshot.origin.is(&self.identity);
        let same = common(&self.touched, &snapshot.touched);
        self.drop_tiles(same);
        let count = self.tiles.len();
        for (k, (tile, saved)) in snapshot.tiles().enumerate().filter(|(_, (t, _))| (*t as usize) < count) {
            let tile = tile as usize;
            if own && k < same && snapshot.origin.holds(k, self.generations[tile]) {
                continue;
            }
            self.tile_mut(tile).copy_from_slice(saved);
            if let Some(generation) = snapshot.origin.generation(k).filter(|_| own) {
                self.generations[tile] = generation;
            }
        }
    }

    /// Leaves only the first `count` tiles that exist.
    fn drop_tiles(&mut self, count: usize) {
        while self.touched.len() > count {
            let Some(tile) = self.touched.pop() else { return };
            self.pool.release(self.tiles[tile as usize]);
            self.tiles[tile as usize] = ABSENT;
            self.writes += 1;
            self.generations[tile as usize] = self.writes;
        }
    }
}

impl<T> TileMapSnapshot<T> {
    /// (number, values of the 32 × 32 nodes) of every tile, for serialisation.
    pub fn tiles(&self) -> impl Iterator<Item = (u32, &[T])> {
        self.touched.iter().copied().zip(self.values.chunks_exact(TILE_NODES))
    }

    /// Adds a tile, for deserialisation; `values` are its 32 × 32 nodes. False when the length is wrong.
    pub fn push(&mut self, tile: u32, values: impl IntoIterator<Item = T>) -> bool {
        let before = self.values.len();
        self.values.extend(values);
        let right = self.values.len() == before + TILE_NODES;
        self.origin = Origin::default();
        if right {
            self.touched.push(tile);
        } else {
            self.values.truncate(before);
        }
        right
    }
}

impl TileMap<f64> {
    /// Tile (a, b) as a field shows it.
    pub fn field_tile(&self, a: u32, b: u32) -> FieldTile<'_> {
        let tile = (b * self.lattice.tiles()[0] + a) as usize;
        let values = self.tile(tile).map_or(TileValues::Uniform(self.default), TileValues::F64);
        FieldTile { generation: self.generations[tile], values }
    }
}

impl TileMap<f32> {
    /// Tile (a, b) as a field shows it.
    pub fn field_tile(&self, a: u32, b: u32) -> FieldTile<'_> {
        let tile = (b * self.lattice.tiles()[0] + a) as usize;
        let values = self.tile(tile).map_or(TileValues::Uniform(f64::from(self.default)), TileValues::F32);
        FieldTile { generation: self.generations[tile], values }
    }
}

impl<T: terraglue_subsystem::bytes::Persist> terraglue_subsystem::bytes::Persist for TileMapSnapshot<T> {
    fn write(&self, out: &mut Vec<u8>) {
        self.touched.write(out);
        self.values.iter().for_each(|v| v.write(out));
    }
    fn read(from: &mut &[u8]) -> terraglue_subsystem::Result<Self> {
        let (touched, values) = crate::snapshot::read_tiles(from)?;
        Ok(Self { touched, values, origin: Origin::default() })
    }
}
