//! Terrain whose height is a function of x and y; it stores nothing.

use super::grid::fill;
use terraglue_ground::Lattice;
use terraglue_subsystem::{Terrain, TerrainTile};

/// A height function on a lattice.
pub struct Analytic<F> {
    lattice: Lattice,
    height: F,
}

impl<F: Fn(f64, f64) -> f64 + Send + Sync> Analytic<F> {
    /// `height` takes world x, y (m).
    pub fn new(lattice: Lattice, height: F) -> Self {
        Self { lattice, height }
    }
}

impl<F: Fn(f64, f64) -> f64 + Send + Sync> Terrain for Analytic<F> {
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
        let limit = |k: i64, n: u32| k.clamp(0, i64::from(n) - 1) as i32;
        let [nx, ny] = self.lattice.size;
        fill(i0, j0, ni, nj, out, |i, j| {
            let [x, y] = self.lattice.position(limit(i, nx), limit(j, ny));
            (self.height)(x, y)
        })
    }
}
