//! Stage 2: the height of the ground below every place.
//!
//! The lowest point of each cell is ground unless another lowest point is farther below it than a slope allows (the slope filter of
//! G. Vosselman, "Slope based filtering of laser altimetry data", 2000). Between them lies a plane fitted to the samples around,
//! in which samples above count less than those below (after K. Kraus and N. Pfeifer, "Determination of terrain models in wooded
//! areas with airborne laser scanner data", 1998).

use crate::scan::Point;
use nalgebra::{Matrix3, Vector3};

/// Height of the ground on a lattice of nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    low: [f64; 2],
    size: [usize; 2],
    heights: Vec<f64>,
}

/// A lowest point.
#[derive(Clone, Copy, Debug)]
struct Sample {
    at: [f64; 2],
    z: f64,
}

/// Edge of the cells whose lowest point counts, m.
const CELL: f64 = 1.0;
/// Distance of the nodes, m.
const NODE: f64 = 3.0;
/// Steepest ground, m/m, and height that a lowest point may have above it, m.
const STEEPEST: f64 = 0.6;
const ABOVE: f64 = 0.2;
/// Cells around one whose lowest points can refute it.
const AROUND: i64 = 4;
/// Residual of a sample above the plane at which it counts half, m.
const HALF: f64 = 0.15;
/// Largest number of cells along an edge.
const MOST_CELLS: f64 = 2000.0;

impl Ground {
    /// The ground below points; none where there are too few of them (three samples in different places).
    pub fn below(points: &[Point]) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points {
            for k in 0..2 {
                low[k] = low[k].min(p.position[k]);
                high[k] = high[k].max(p.position[k]);
            }
        }
        let extent = [0, 1].map(|k| high[k] - low[k]);
        if points.len() < 3 || !extent.iter().all(|e| (0.0..MOST_CELLS * CELL).contains(e)) {
            return None;
        }
        let cells = Cells::of(points, low, extent);
        let samples = cells.accepted();
        if samples.len() < 3 {
            return None;
        }
        let size = extent.map(|e| (e / NODE) as usize + 2);
        let node = |k: usize| [low[0] + NODE * (k % size[0]) as f64, low[1] + NODE * (k / size[0]) as f64];
        let bins = Bins::of(&samples, low, extent);
        let heights = (0..size[0] * size[1]).map(|k| bins.height(node(k))).collect();
        Some(Self { low, size, heights })
    }

    /// Height at a place, m; outside of the points that of their border.
    pub fn height(&self, at: [f64; 2]) -> f64 {
        let [u, v] =
            [0, 1].map(|k| ((at[k] - self.low[k]) / NODE).clamp(0.0, (self.size[k] - 1) as f64 - 1e-9));
        let (i, j) = (u as usize, v as usize);
        let (a, b) = (u - i as f64, v - j as f64);
        let of = |i: usize, j: usize| self.heights[j * self.size[0] + i];
        (1.0 - b) * ((1.0 - a) * of(i, j) + a * of(i + 1, j))
            + b * ((1.0 - a) * of(i, j + 1) + a * of(i + 1, j + 1))
    }
}

/// Lowest point of each cell.
struct Cells {
    size: [i64; 2],
    lowest: Vec<Option<Sample>>,
}

impl Cells {
    fn of(points: &[Point], low: [f64; 2], extent: [f64; 2]) -> Self {
        let size = extent.map(|e| (e / CELL) as i64 + 1);
        let mut lowest: Vec<Option<Sample>> = vec![None; (size[0] * size[1]) as usize];
        for p in points {
            let [x, y, z] = p.position;
            let (i, j) = (((x - low[0]) / CELL) as i64, ((y - low[1]) / CELL) as i64);
            let cell = &mut lowest[(j * size[0] + i) as usize];
            if cell.is_none_or(|s| z < s.z) {
                *cell = Some(Sample { at: [x, y], z });
            }
        }
        Self { size, lowest }
    }

    /// Samples that no other one refutes.
    fn accepted(&self) -> Vec<Sample> {
        let around = |i: i64, j: i64| {
            (-AROUND..=AROUND).flat_map(move |b| (-AROUND..=AROUND).map(move |a| (i + a, j + b)))
        };
        let inside = |(i, j): &(i64, i64)| *i >= 0 && *j >= 0 && *i < self.size[0] && *j < self.size[1];
        let mut accepted = Vec::new();
        for (k, sample) in self.lowest.iter().enumerate() {
            let Some(sample) = sample else { continue };
            let (i, j) = (k as i64 % self.size[0], k as i64 / self.size[0]);
            let others =
                around(i, j).filter(inside).filter_map(|(i, j)| self.lowest[(j * self.size[0] + i) as usize]);
            let refuted = |other: Sample| {
                let (x, y) = (sample.at[0] - other.at[0], sample.at[1] - other.at[1]);
                sample.z - other.z > ABOVE + STEEPEST * (x * x + y * y).sqrt()
            };
            if !others.into_iter().any(refuted) {
                accepted.push(*sample);
            }
        }
        accepted
    }
}

/// Samples by cells, to find those around a place.
struct Bins<'a> {
    samples: &'a [Sample],
    low: [f64; 2],
    size: [i64; 2],
    cells: Vec<Vec<u32>>,
}

/// Edge of a bin, m.
const BIN: f64 = 4.0;

impl<'a> Bins<'a> {
    fn of(samples: &'a [Sample], low: [f64; 2], extent: [f64; 2]) -> Self {
        let size = extent.map(|e| (e / BIN) as i64 + 1);
        let mut cells = vec![Vec::new(); (size[0] * size[1]) as usize];
        for (k, s) in (0..).zip(samples) {
            let [i, j] = [0, 1].map(|k| ((s.at[k] - low[k]) / BIN) as i64);
            cells[(j * size[0] + i) as usize].push(k);
        }
        Self { samples, low, size, cells }
    }

    /// Samples of the bins within so many of a place.
    fn near(&self, at: [f64; 2], bins: i64) -> Vec<Sample> {
        let [i, j] = [0, 1].map(|k| (((at[k] - self.low[k]) / BIN) as i64).clamp(0, self.size[k] - 1));
        let range = |c: i64, n: i64| (c - bins).max(0)..=(c + bins).min(n - 1);
        let cells = range(j, self.size[1]).flat_map(|j| range(i, self.size[0]).map(move |i| (i, j)));
        cells
            .flat_map(|(i, j)| &self.cells[(j * self.size[0] + i) as usize])
            .map(|k| self.samples[*k as usize])
            .collect()
    }

    fn height(&self, at: [f64; 2]) -> f64 {
        let most = self.size[0].max(self.size[1]);
        let mut bins = 1;
        let mut near = self.near(at, bins);
        while near.len() < 8 && bins < most {
            bins *= 2;
            near = self.near(at, bins);
        }
        plane(&near, at, BIN * bins as f64)
    }
}

/// Height at a place of the plane through samples, which count less the farther and the higher they lie.
fn plane(samples: &[Sample], at: [f64; 2], reach: f64) -> f64 {
    let lowest = samples.iter().map(|s| s.z).fold(f64::INFINITY, f64::min);
    let mut fit = Vector3::new(samples.iter().map(|s| s.z).sum::<f64>() / samples.len() as f64, 0.0, 0.0);
    for round in 0..4 {
        let (mut left, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for s in samples {
            let row = Vector3::new(1.0, s.at[0] - at[0], s.at[1] - at[1]);
            let near = 1.0 / (0.1 + (row.y * row.y + row.z * row.z) / (reach * reach));
            let above = ((s.z - fit.dot(&row)) / HALF).max(0.0);
            let weight = if round == 0 { near } else { near / (1.0 + above * above) };
            left += weight * row * row.transpose();
            right += weight * row * s.z;
        }
        // level where the samples do not determine a slope
        let flat = 1e-3 * left[(0, 0)] * reach * reach;
        left[(1, 1)] += flat;
        left[(2, 2)] += flat;
        match left.cholesky() {
            Some(solved) => fit = solved.solve(&right),
            None => return lowest,
        }
    }
    fit.x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_is_found_below_things_that_stand_on_it() {
        let mut points = Vec::new();
        for k in 0..4000 {
            let (x, y) = (f64::from(k % 63) * 0.5 - 15.0, f64::from(k / 63) * 0.5 - 15.0);
            let z = 0.3 * x - 0.1 * y;
            // a wall of stems where no ground is seen
            let lift = if (4.0..5.5).contains(&x) { 0.5 + 0.1 * f64::from(k % 7) } else { 0.0 };
            points.push(Point::at([x, y, z + lift]));
        }
        let ground = Ground::below(&points).expect("ground");
        for at in [[0.0, 0.0], [-7.3, 9.1], [4.8, 3.0], [12.0, -12.0]] {
            let error = ground.height(at) - (0.3 * at[0] - 0.1 * at[1]);
            assert!(error.abs() < 0.1, "{at:?}: {error}");
        }
    }

    #[test]
    fn too_few_points_have_no_ground() {
        assert!(Ground::below(&[]).is_none());
        assert!(Ground::below(&[Point::at([0.0; 3]); 10]).is_none());
        assert!(
            Ground::below(&[Point::at([0.0; 3]), Point::at([1e9, 0.0, 0.0]), Point::at([2.0; 3])]).is_none()
        );
    }
}
