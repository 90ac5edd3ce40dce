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
        let reach = radius / self.lattice.spacing;
        let last = self.lattice.size.map(|n| f64::from(n) - 2.0);
        let mut open = vec![(self.top(), [0_u32; 2])];
        while let Some((level, at)) = open.pop() {
            let apart = (0..2).any(|k| {
                let (low, size) = (f64::from(at[k] << level), f64::from(1_u32 << level));
                u[k] + reach < low || u[k] - reach > low + size || low > last[k]
            });
            // what is wholly below the sphere, or no ground
            if apart || !(f64::from(self.range(level, at).high) >= centre[2] - radius) {
                continue;
            }
            if level > 0 {
                let halves = [0, 1].map(|b| [0, 1].map(|a| [2 * at[0] + a, 2 * at[1] + b]));
                open.extend(halves.as_flattened().iter().map(|at| (level - 1, *at)));
                continue;
            }
            let spacing = self.lattice.spacing;
            let point = [u[0] * spacing, u[1] * spacing, centre[2]];
            let near = |t: &[[f64; 3]; 3]| {
                let corners = t.map(|[x, y, z]| [x * spacing, y * spacing, z]);
                distance_squared(&corners, point) <= radius * radius
            };
            if triangles(at, &self.cell(at)).iter().any(near) {
                return true;
            }
        }
        false
    }
}
