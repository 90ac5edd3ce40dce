//! Memory for tiles: handed out by number, in blocks that never move, so that a step seldom allocates.

use crate::lattice::TILE_NODES;

const BLOCK_TILES: usize = 256;

/// Tiles by number. Blocks of 256 tiles come zeroed from the system, which backs them on first use.
#[derive(Clone, Debug)]
pub(crate) struct Pool<T> {
    blocks: Vec<Box<[T]>>,
    free: Vec<u32>,
    used: u32,
    default: T,
}

impl<T: Copy> Pool<T> {
    pub fn new(default: T) -> Self {
        Self { blocks: Vec::new(), free: Vec::new(), used: 0, default }
    }

    /// Room for so many tiles beyond those in use, so that taking them does not allocate.
    pub fn reserve(&mut self, tiles: usize) {
        let wanted = self.used as usize + tiles;
        while self.blocks.len() * BLOCK_TILES < wanted {
            self.blocks.push(vec![self.default; BLOCK_TILES * TILE_NODES].into_boxed_slice());
        }
        self.free.reserve(wanted.saturating_sub(self.free.len()));
    }

    /// Number of a free tile; its contents are old.
    pub fn take(&mut self) -> u32 {
        if let Some(tile) = self.free.pop() {
            return tile;
        }
        if self.blocks.len() * BLOCK_TILES <= self.used as usize {
            self.reserve(BLOCK_TILES);
        }
        self.used += 1;
        self.used - 1
    }

    /// Gives a tile back.
    pub fn release(&mut self, tile: u32) {
        self.free.push(tile);
    }

    #[inline]
    pub fn tile(&self, tile: u32) -> &[T] {
        let start = (tile as usize % BLOCK_TILES) * TILE_NODES;
        &self.blocks[tile as usize / BLOCK_TILES][start..start + TILE_NODES]
    }

    #[inline]
    pub fn tile_mut(&mut self, tile: u32) -> &mut [T] {
        let start = (tile as usize % BLOCK_TILES) * TILE_NODES;
        &mut self.blocks[tile as usize / BLOCK_TILES][start..start + TILE_NODES]
    }

    #[inline]
    pub fn value(&self, tile: u32, k: usize) -> T {
        self.blocks[tile as usize / BLOCK_TILES][(tile as usize % BLOCK_TILES) * TILE_NODES + k]
    }
}
