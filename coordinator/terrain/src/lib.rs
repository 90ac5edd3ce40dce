//! Where ground comes from: procedural shapes and elevation files, handed to the soil as a
//! [`Terrain`].
//!
//! Every terrain is centred on the world's origin and has size/spacing + 1 nodes. Files keep their own lattice
//! unless a spacing is asked for; their coordinates are dropped, their heights kept.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod analytic;
mod crater;
mod esri_ascii;
mod esri_writer;
mod geotiff;
mod grid;
mod labels;
mod mask;
mod png;
mod random;
mod resample;
mod undulating;

pub use crater::Profile;
pub use esri_ascii::read_esri_ascii;
pub use esri_writer::write_esri_ascii;
pub use geotiff::read_geotiff;
pub use grid::Grid;
pub use labels::Labels;
pub use mask::resolve as resolve_mask;
pub use png::read_png;
pub use random::SplitMix64;

use analytic::Analytic;
use resample::{Raster, resample};
use std::path::Path;
use terraglue_diagnostics::error::Result;
use terraglue_ground::Lattice;
use terraglue_scenario::{InputError, SMALLER, TerrainKind, TerrainSpec, too_many};
use terraglue_subsystem::Terrain;

/// Builds the terrain of a scenario. `seed` is that of the world, used where the terrain has none of its own.
///
/// # Errors
/// Numbers that no terrain fits, and files that cannot be used: [`terraglue_diagnostics::Error::Input`].
pub fn build(spec: &TerrainSpec, seed: u64) -> Result<Box<dyn Terrain>> {
    let lattice = || centred_lattice(spec);
    Ok(match &spec.kind {
        TerrainKind::Flat { height_m } => {
            let height = *height_m;
            Box::new(Analytic::new(lattice()?, move |_, _| height))
        }
        TerrainKind::Slope { angle_rad, heading_rad } => {
            if angle_rad.abs() >= 1.5 {
                let message = format!("`angle_rad` = {angle_rad} rad is a wall");
                return Err(InputError::plain(message, Some("slopes go up to 1.5 rad".into())).into());
            }
            let rise = libm::tan(*angle_rad);
            let (gx, gy) = (rise * libm::cos(*heading_rad), rise * libm::sin(*heading_rad));
            Box::new(Analytic::new(lattice()?, move |x, y| gx * x + gy * y))
        }
        TerrainKind::Undulating { rms_m, wavelengths_m, seed: own, flat_radius_m } => {
            let seed = own.unwrap_or(seed);
            Box::new(undulating::build(lattice()?, *rms_m, *wavelengths_m, seed, *flat_radius_m)?)
        }
        TerrainKind::Crater { diameter_m, depth_m, rim_height_m, max_slope_rad, centre_m } => {
            let profile = Profile::new(*diameter_m, *depth_m, *rim_height_m, *max_slope_rad)?;
            let [cx, cy] = *centre_m;
            Box::new(Analytic::new(lattice()?, move |x, y| {
                profile.height(((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt())
            }))
        }
        TerrainKind::EsriAscii { file, fill_m } => {
            let raster = read_esri_ascii(file, *fill_m, Some(spec.spacing_m))?;
            from_file(&file.display().to_string(), raster, spec.spacing_m)?
        }
        TerrainKind::Geotiff { file, fill_m } => {
            let raster = read_geotiff(file, *fill_m, Some(spec.spacing_m))?;
            from_file(&file.display().to_string(), raster, spec.spacing_m)?
        }
        TerrainKind::Png { file, greys, fill_m } => {
            let raster = read_png(file, *greys, *fill_m, Some(spec.spacing_m))?;
            from_file(&file.display().to_string(), raster, spec.spacing_m)?
        }
    })
}

/// Most points of an elevation file or mask: two gigabytes while it is read, most of them as numbers of 8 bytes.
const MOST_POINTS: f64 = 1e8;

/// Whether the points that a file declares fit into memory, and the nodes of the ground that is made of them, `spacing` (m)
/// apart: asked before it is read whole. 0: they are the points; none: no ground is made of it.
fn check_declared(path: &Path, size: [usize; 2], step: [f64; 2], spacing: Option<f64>) -> Result {
    let path = path.display();
    let [width, height] = size.map(|n| n as f64);
    if width * height > MOST_POINTS {
        let message =
            format!("{path}: {width} × {height} points are too many: at most {MOST_POINTS:.0e} are read");
        let help = "cut a part out of it or make it coarser, e.g. with gdalwarp -tr".to_owned();
        return Err(InputError::plain(message, Some(help)).into());
    }
    let Some(spacing) = spacing else { return Ok(()) };
    let spacing = if spacing > 0.0 { spacing } else { step[0].min(step[1]) };
    let extent = [(width - 1.0) * step[0], (height - 1.0) * step[1]];
    let Some(refused) = too_many(extent, spacing) else { return Ok(()) };
    let message = format!("{path}: {} m by {} m make {}", extent[0], extent[1], refused.what);
    Err(InputError::plain(message, Some(refused.help("cut a part out of the file"))).into())
}

/// Largest height that a height field takes, m.
const HIGHEST_M: f64 = 500.0;

/// A file's raster as terrain. Heights beyond the range of the ground are lowered together so that the middle
/// lies at 0, and the log says by how much.
fn from_file(path: &str, mut raster: Raster, spacing: f64) -> Result<Box<dyn Terrain>> {
    let [width, height] = raster.size;
    if width < 2 || height < 2 {
        let message = format!("{path}: {width} × {height} heights are no ground");
        return Err(InputError::plain(message, Some("at least 2 × 2 are needed".to_owned())).into());
    }
    if raster.heights.iter().any(|h| h.abs() > HIGHEST_M) {
        let middle = raster.heights[raster.size[0] * (raster.size[1] / 2) + raster.size[0] / 2].round();
        raster.heights.iter_mut().for_each(|h| *h -= middle);
        log::warn!("{path}: heights are taken relative to {middle} m, that of the middle");
        if let Some(h) = raster.heights.iter().find(|h| h.abs() > HIGHEST_M) {
            let message = format!("{path}: heights differ by {h} m from the middle, more than {HIGHEST_M} m");
            let help = "cut a part out of the elevation model that is less high".to_owned();
            return Err(InputError::plain(message, Some(help)).into());
        }
    }
    Ok(Box::new(resample(path, raster, spacing)?))
}

/// The lattice of a procedural terrain.
fn centred_lattice(spec: &TerrainSpec) -> Result<Lattice> {
    let cells = spec.size_m.map(|size| (size / spec.spacing_m).round());
    let sound = spec.spacing_m > 0.0 && cells.iter().all(|n| *n >= 1.0);
    let help = match too_many(spec.size_m, spec.spacing_m) {
        _ if !sound => "both are positive".to_owned(),
        Some(refused) => refused.help(SMALLER),
        None => return Ok(lattice_of(cells.map(|n| n as u32 + 1), spec.spacing_m)),
    };
    let message =
        format!("size_m = {:?} and spacing_m = {} do not make a lattice", spec.size_m, spec.spacing_m);
    Err(InputError::plain(message, Some(help)).into())
}

/// A lattice of so many nodes with its middle at the world's origin.
fn lattice_of(size: [u32; 2], spacing: f64) -> Lattice {
    Lattice { origin: size.map(|n| -0.5 * f64::from(n - 1) * spacing), spacing, size }
}

#[cfg(test)]
mod tests;
