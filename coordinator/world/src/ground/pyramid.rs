//! Lowest and highest heights of square blocks, level by level, the four parts of a block together.

use glam::Vec4;

/// Lowest and highest heights of the parts (0, 0), (1, 0), (0, 1), (1, 1) of a block, m, rounded to single precision; what is no
/// ground has its lowest above its highest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quarters {
    pub low: Vec4,
    pub high: Vec4,
}

impl Quarters {
    pub const EMPTY: Self = Self { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY };

    /// Lowest and highest of all four.
    pub fn whole(&self) -> [f32; 2] {
        [self.low.min_element(), self.high.max_element()]
    }

    #[inline]
    pub fn set(&mut self, part: usize, [low, high]: [f32; 2]) {
        (self.low[part], self.high[part]) = (low, high);
    }
}

/// Blocks of one size, x fastest.
#[derive(Clone, Debug)]
struct Level {
    size: [u32; 2],
    blocks: Vec<Quarters>,
}

/// From blocks of 2 × 2 tiles up to one that holds all.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    levels: Vec<Level>,
}

impl Pyramid {
    /// At least one level, even over a single tile.
    pub fn new(tiles: [u32; 2]) -> Self {
        let (mut levels, mut size) = (Vec::new(), tiles);
        while levels.is_empty() || size[0].max(size[1]) > 1 {
            size = size.map(|n| n.div_ceil(2));
            let count = size[0] as usize * size[1] as usize;
            levels.push(Level { size, blocks: vec![Quarters::EMPTY; count] });
        }
        Self { levels }
    }

    /// Heights of a tile, carried up to the top.
    pub fn set(&mut self, tile: [u32; 2], range: [f32; 2]) {
        let (mut at, mut range) = (tile, range);
        for level in &mut self.levels {
            let part = (at[0] & 1 | (at[1] & 1) << 1) as usize;
            at = at.map(|k| k >> 1);
            let block = &mut level.blocks[(at[1] * level.size[0] + at[0]) as usize];
            block.set(part, range);
            range = block.whole();
        }
    }

    /// A block of 2^(level + 1) tiles along an edge.
    #[inline]
    pub fn block(&self, level: u32, at: [u32; 2]) -> &Quarters {
        let level = &self.levels[level as usize];
        &level.blocks[(at[1] * level.size[0] + at[0]) as usize]
    }

    /// Number of the level of the block that holds all.
    pub fn top(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// Lowest and highest of everything.
    pub fn whole(&self) -> [f32; 2] {
        self.block(self.top(), [0, 0]).whole()
    }
}
