//! Height of the ground at a point, and whether a sphere touches it.

use super::Ground;
use super::march::triangles;
use crate::triangle::distance_squared;

impl Ground {
    /// Height at a point x, y of the world, m; none outside.
    pub fn height(&self, at: [f64; 2]) -> Option<f64> {
        let u = self.lattice.coordinates(at[0], at[1]);
        let last = self.lattice.size.map(|n| f64::from(n) - 1.0);
        if !(0..2).all(|k| last[k] >= 1.0 && u[k] >= 0.0 && u[k] <= last[k]) {
            return None;
        }
        let cell: [f64; 2] = std::array::from_fn(|k| u[k].floor().min(last[k] - 1.0));
        let [p, q] = [0, 1].map(|k| u[k] - cell[k]);
        let [a, b, c, d] = self.cell(cell.map(|k| k as u32));
        let height = if p + q <= 1.0 {
            a + p * (b - a) + q * (c - a)
        } else {
            d + (1.0 - p) * (c - d) + (1.0 - q) * (b - d)
        };
        height.is_finite().then_some(height)
    }

    /// Whether a sphere touches the surface or lies below it.
    pub fn is_touched(&self, centre: [f64; 3], radius: f64) -> bool {
        if self.height([centre[0], centre[1]]).is_some_and(|h| centre[2] - radius <= h) {
            return true;
        }
        let u = self.lattice.coordinates(centre[0], centre[1]);
        let (spacing, cells) = (self.lattice.spacing, self.lattice.size.map(|n| f64::from(n) - 1.0));
        let reach = radius / spacing;
        let around = |k: usize| {
            let low = (u[k] - reach).floor().max(0.0);
            low as u32..(u[k] + reach).ceil().min(cells[k]).max(low) as u32
        };
        let point = [u[0] * spacing, u[1] * spacing, centre[2]];
        around(1).any(|j| {
            around(0).any(|i| {
                triangles([i, j], &self.cell([i, j])).iter().any(|t| {
                    let corners = t.map(|[x, y, z]| [x * spacing, y * spacing, z]);
                    distance_squared(&corners, point) <= radius * radius
                })
            })
        })
    }
}
