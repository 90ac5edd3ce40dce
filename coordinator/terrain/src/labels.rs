//! Reads a mask: a picture or a grid whose values are labels of regions, not heights.

use super::esri_ascii::read_esri_ascii;
use super::png::read_png;
use super::resample::Raster;
use std::path::Path;
use terraglue_diagnostics::error::Result;
use terraglue_scenario::{Greys, InputError};
use terraglue_subsystem::Terrain;

/// Label of missing data and of what lies outside the mask.
pub const NO_LABEL: u8 = 0;

/// Labels of cells around the world's origin.
pub struct Labels {
    raster: Raster,
}

impl Labels {
    /// Reads a grey PNG image (8 bits: the grey is the label) or an ESRI ASCII grid. Pixels are `pixel_m` (m) wide; without
    /// it the image covers the ground, whose cells reach half a spacing beyond the nodes at its edge.
    ///
    /// # Errors
    /// A file that cannot be read, a value that is no whole number from 0 to 255.
    pub fn read(path: &Path, pixel_m: Option<f64>, ground: &dyn Terrain) -> Result<Self> {
        let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        let raster = if is_png {
            let greys = Greys { pixel_m: pixel_m.unwrap_or(1.0), low_m: 0.0, high_m: 255.0 };
            let mut raster = read_png(path, greys, Some(f64::from(NO_LABEL)), None)?;
            if pixel_m.is_none() {
                let covered = |k: usize| f64::from(ground.size()[k]) * ground.spacing();
                raster.step = [0, 1].map(|k| covered(k) / raster.size[k] as f64);
            }
            // a grey of 8 bits comes back as a share of white
            raster.heights.iter_mut().for_each(|h| *h = snapped(*h));
            raster
        } else {
            read_esri_ascii(path, Some(f64::from(NO_LABEL)), None)?
        };
        let no_label = |v: &f64| !(v.fract() == 0.0 && (0.0..=255.0).contains(v));
        if let Some(k) = raster.heights.iter().position(no_label) {
            let place = place(&raster, k);
            let message = format!("{}: {} {place} is no label", path.display(), raster.heights[k]);
            let help = "labels are whole numbers from 0 to 255; an image needs 8 bits of grey".to_owned();
            return Err(InputError::plain(message, Some(help)).into());
        }
        Ok(Self { raster })
    }

    /// A label that is not `known`, and its first place.
    pub fn unknown(&self, known: impl Fn(u8) -> bool) -> Option<(u8, String)> {
        let labels = self.raster.heights.iter().map(|v| *v as u8).enumerate();
        let (k, label) = labels.into_iter().find(|(_, label)| *label != NO_LABEL && !known(*label))?;
        Some((label, place(&self.raster, k)))
    }

    /// The label of the cell in which a point lies; on the border of two cells, that on the side of larger x and y.
    pub fn at(&self, point: [f64; 2]) -> u8 {
        let [nx, ny] = self.raster.size;
        let cell = |k: usize, n: usize| (point[k] / self.raster.step[k] + 0.5 * n as f64).floor();
        let (i, j) = (cell(0, nx), cell(1, ny));
        let inside = i >= 0.0 && j >= 0.0 && i < nx as f64 && j < ny as f64;
        if inside { self.raster.heights[j as usize * nx + i as usize] as u8 } else { NO_LABEL }
    }
}

/// Rounds what differs from a whole number by rounding alone.
fn snapped(value: f64) -> f64 {
    let whole = value.round();
    if (value - whole).abs() < 1e-9 { whole } else { value }
}

/// Where value number k stands, as an editor counts: from the upper left corner.
fn place(raster: &Raster, k: usize) -> String {
    let [nx, ny] = raster.size;
    format!("in column {}, row {} from the top", k % nx + 1, ny - k / nx)
}
