//! Terrain that is a table of heights.

use terraglue_ground::Lattice;
use terraglue_subsystem::{Terrain, TerrainTile};

/// Heights of all nodes of a lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Where the nodes lie.
    pub lattice: Lattice,
    /// Heights, m, row by row from the smallest y, x fastest.
    pub heights: Vec<f64>,
}

impl Grid {
    /// Height of node (i, j), m; indices outside read the nearest node of the edge.
    #[inline]
    pub fn height(&self, i: i64, j: i64) -> f64 {
        let limit = |k: i64, n: u32| k.clamp(0, i64::from(n) - 1) as usize;
        let [nx, ny] = self.lattice.size;
        self.heights[limit(j, ny) * nx as usize + limit(i, nx)]
    }
}

impl Terrain for Grid {
    fn origin(&self) -> [f64; 2] {
        self.lattice.origin
    }
    fn spacing(&self) -> f64 {
        self.lattice.spacing
    }
    fn size(&self) -> [u32; 2] {
        self.lattice.size
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        fill(i0, j0, ni, nj, out, |i, j| self.height(i, j))
    }
}

/// Fills a block of heights and says whether they are all the same.
pub(super) fn fill(
    i0: i64,
    j0: i64,
    ni: usize,
    nj: usize,
    out: &mut [f64],
    height: impl Fn(i64, i64) -> f64,
) -> TerrainTile {
    for (b, row) in out.chunks_exact_mut(ni.max(1)).take(nj).enumerate() {
        for (a, h) in row.iter_mut().enumerate() {
            *h = height(i0 + a as i64, j0 + b as i64);
        }
    }
    let block = &out[..ni * nj];
    match block.first() {
        Some(first) if block.iter().all(|h| h == first) => TerrainTile::Uniform(*first),
        _ => TerrainTile::Varied,
    }
}
