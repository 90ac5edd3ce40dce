//! State of a law per node: some doubles, owned by the soil, so that saving and going back need no code of the law.
//! They stay with the soil when a foot leaves.

use terraglue_ground::{Lattice, TileMap, TileMapSnapshot};

/// Tiles for which memory is allocated at the start, per double.
const RESERVE_TILES: usize = 64;

/// One map of the lattice per double.
#[derive(Clone, Debug, Default)]
pub struct LawMemory {
    maps: Vec<TileMap<f64>>,
}

/// Exact copy of a [`LawMemory`].
#[derive(Clone, Debug, Default)]
pub struct LawMemorySnapshot {
    maps: Vec<TileMapSnapshot<f64>>,
}

terraglue_subsystem::persist!(LawMemorySnapshot { maps });

impl LawMemorySnapshot {
    /// Whether it was made by a law with as many doubles per node.
    pub fn fits(&self, memory: &LawMemory) -> bool {
        self.maps.len() == memory.maps.len()
    }
}

impl LawMemory {
    /// `doubles` per node, all 0.
    pub fn new(lattice: Lattice, doubles: usize) -> Self {
        Self { maps: (0..doubles).map(|_| TileMap::new(lattice, 0.0, RESERVE_TILES)).collect() }
    }

    /// Doubles per node.
    #[inline]
    pub fn doubles(&self) -> usize {
        self.maps.len()
    }

    /// Appends the doubles of a node.
    #[inline]
    pub fn read(&self, [i, j]: [i32; 2], out: &mut Vec<f64>) {
        out.extend(self.maps.iter().map(|map| map.get(i, j)));
    }

    /// Replaces them.
    pub fn write(&mut self, [i, j]: [i32; 2], values: &[f64]) {
        self.maps.iter_mut().zip(values).for_each(|(map, value)| map.set(i, j, *value));
    }

    /// Copies all into `out`.
    pub fn save(&self, out: &mut LawMemorySnapshot) {
        out.maps.resize_with(self.maps.len(), TileMapSnapshot::default);
        self.maps.iter().zip(&mut out.maps).for_each(|(map, out)| map.save(out));
    }

    /// Back to a saved state.
    pub fn restore(&mut self, saved: &LawMemorySnapshot) {
        self.maps.iter_mut().zip(&saved.maps).for_each(|(map, saved)| map.restore(saved));
    }
}
