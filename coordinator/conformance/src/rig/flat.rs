//! Ground for a check: a plane.

use terraglue_subsystem::{Terrain, TerrainTile};

/// A square plane of a metre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flat {
    /// World x, y of its middle, m.
    pub middle: [f64; 2],
    /// Height of the middle, m.
    pub height: f64,
    /// Rise along x and y.
    pub rise: [f64; 2],
    /// Distance of the nodes, m.
    pub spacing: f64,
}

impl Flat {
    /// z = 0 around the origin, nodes 1 cm apart.
    pub const LEVEL: Self = Self { middle: [0.0; 2], height: 0.0, rise: [0.0; 2], spacing: 0.01 };

    /// Nodes along an edge.
    fn nodes(&self) -> u32 {
        (1.0 / self.spacing).round() as u32 + 1
    }

    /// Height at a point, m.
    pub fn at(&self, x: f64, y: f64) -> f64 {
        self.height + self.rise[0] * (x - self.middle[0]) + self.rise[1] * (y - self.middle[1])
    }
}

impl Terrain for Flat {
    fn origin(&self) -> [f64; 2] {
        self.middle.map(|m| m - 0.5 * self.spacing * f64::from(self.nodes() - 1))
    }

    fn spacing(&self) -> f64 {
        self.spacing
    }

    fn size(&self) -> [u32; 2] {
        [self.nodes(); 2]
    }

    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        let last = i64::from(self.nodes() - 1);
        let origin = self.origin();
        let place = |axis: usize, k: i64| origin[axis] + self.spacing * k.clamp(0, last) as f64;
        for j in 0..nj {
            for i in 0..ni {
                out[j * ni + i] = self.at(place(0, i0 + i as i64), place(1, j0 + j as i64));
            }
        }
        if self.rise == [0.0; 2] { TerrainTile::Uniform(self.height) } else { TerrainTile::Varied }
    }
}
