//! Worlds and rays drawn at random, and the hits of rays, found by looking at every shape: the reference for the fast
//! answers of `terraglue-world` in tests and figures.
//!
//! Nothing here shares a formula with the crate that it judges. A shape with a closed form is convex, so how far a point of a
//! ray is outside it falls and then rises along the ray: a search by thirds finds the deepest point, bisection where the
//! ray comes in and where it leaves. Triangles are met by Cramer's rule.

mod build;
mod draw;
mod naive;
mod random;
mod stand;

pub use build::drawn;
pub use draw::{Piece, rays, scenes};
pub use naive::{Candidate, Heights, is_right, naive, tolerance};
pub use random::Random;
pub use stand::{Stand, sweep};

use terraglue_subsystem::{BodyState, FieldInfo, FieldTile, TileValues};

/// Time at the start of the step of all drawn worlds, and its length, s.
pub const STEP: [f64; 2] = [2.0, 2.01];

impl Piece {
    /// One flag for each body: whether it stands still for ever.
    pub fn is_fixed(&self) -> Vec<bool> {
        vec![!self.moves; self.scene.bodies.len()]
    }

    /// States at the start and at the end of the step.
    pub fn states(&self) -> (&[BodyState], &[BodyState]) {
        (&self.before, &self.after)
    }
}

impl Heights {
    /// The field that shows these heights, in tiles of 32 × 32 nodes.
    pub fn info(&self) -> FieldInfo {
        FieldInfo {
            name: "height".into(),
            unit: "m".into(),
            origin: self.origin,
            spacing: self.spacing,
            size: self.size,
            tile_edge: 32,
        }
    }

    /// Tile (a, b): its 32 × 32 heights, padded with 0.
    pub fn tile(&self, a: u32, b: u32) -> Vec<f64> {
        let node = |k: u32| (32 * a + k % 32, 32 * b + k / 32);
        let inside = |(i, j): (u32, u32)| i < self.size[0] && j < self.size[1];
        (0..1024).map(node).map(|at| if inside(at) { self.at(at.0, at.1) } else { 0.0 }).collect()
    }

    /// All tiles, x fastest, to be lent by [`lend`].
    pub fn tiles(&self) -> Vec<Vec<f64>> {
        let [nx, ny] = self.size.map(|n| n.div_ceil(32));
        (0..nx * ny).map(|k| self.tile(k % nx, k / nx)).collect()
    }
}

/// Tile (a, b) of a list of tiles, as a field shows it.
pub fn lend<'a>(
    tiles: &'a [Vec<f64>],
    heights: &Heights,
    generation: u64,
) -> impl Fn(u32, u32) -> Option<FieldTile<'a>> {
    let columns = heights.size[0].div_ceil(32);
    move |a, b| {
        let values = TileValues::F64(tiles.get((b * columns + a) as usize)?);
        Some(FieldTile { generation, values })
    }
}
