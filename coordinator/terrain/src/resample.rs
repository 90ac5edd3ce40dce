//! From the raster of an elevation file to a lattice around the world's origin.

use super::grid::Grid;
use super::lattice_of;
use terraglue_diagnostics::error::Result;
use terraglue_scenario::InputError;

/// Content of an elevation file, rows from the smallest y.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Number of points along x and y.
    pub size: [usize; 2],
    /// Distance of neighbouring points along x and y, m.
    pub step: [f64; 2],
    /// The file's own x, y of the first point of the first row, m.
    pub corner: [f64; 2],
    /// Heights, m, x fastest.
    pub heights: Vec<f64>,
}

impl Raster {
    /// Bilinear interpolation at raster coordinates (u, v), clamped to the raster.
    fn at(&self, u: f64, v: f64) -> f64 {
        let [nx, ny] = self.size;
        let cell = |c: f64, n: usize| {
            let c = c.clamp(0.0, (n - 1) as f64);
            let k = (c as usize).min(n.saturating_sub(2));
            (k, c - k as f64, (k + 1).min(n - 1))
        };
        let ((i, a, i1), (j, b, j1)) = (cell(u, nx), cell(v, ny));
        let h = |i: usize, j: usize| self.heights[j * nx + i];
        let low = h(i, j) + a * (h(i1, j) - h(i, j));
        let high = h(i, j1) + a * (h(i1, j1) - h(i, j1));
        low + b * (high - low)
    }
}

/// The raster as a grid around the world's origin: as it is when `spacing` is 0 or that of the file, else
/// interpolated bilinearly at nodes `spacing` (m) apart, as many as fit.
pub fn resample(path: &str, raster: Raster, spacing: f64) -> Result<Grid> {
    let [dx, dy] = raster.step;
    let square = (dx - dy).abs() <= 1e-9 * dx;
    if spacing <= 0.0 && !square {
        let message = format!("{path}: cells of {dx} m by {dy} m are not square");
        return Err(InputError::plain(message, Some(format!("give spacing_m, e.g. {}", dx.min(dy)))).into());
    }
    if square && (spacing <= 0.0 || (spacing - dx).abs() <= 1e-9 * dx) {
        let lattice = lattice_of(raster.size.map(|n| n as u32), dx);
        return Ok(Grid { lattice, heights: raster.heights });
    }
    let extent = [0, 1].map(|k| (raster.size[k] - 1) as f64 * raster.step[k]);
    let size = extent.map(|e| (e / spacing * (1.0 + 1e-12)).floor() as u32 + 1);
    if size.iter().any(|n| *n < 2) {
        let message = format!("{path}: {} m by {} m do not fit spacing_m = {spacing}", extent[0], extent[1]);
        return Err(InputError::plain(message, Some(format!("the file's own is {dx}"))).into());
    }
    let lattice = lattice_of(size, spacing);
    let mut heights = Vec::with_capacity(lattice.node_count());
    for j in 0..size[1] {
        for i in 0..size[0] {
            let [x, y] = lattice.position(i as i32, j as i32);
            heights.push(raster.at((x + 0.5 * extent[0]) / dx, (y + 0.5 * extent[1]) / dy));
        }
    }
    Ok(Grid { lattice, heights })
}
