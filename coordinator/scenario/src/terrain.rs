//! `[terrain]`.

use super::choices::TerrainChoice;
use super::ground_size::{SMALLER, too_many};
use super::keys::READ;
use super::model::{Greys, TerrainKind, TerrainSpec};
use super::section::Section;
use terraglue_diagnostics::InputError;

/// Reads the checked table.
pub fn read(s: &Section) -> Result<TerrainSpec, Box<InputError>> {
    let kind = match TerrainChoice::named(&s.text("kind")).unwrap_or(TerrainChoice::Flat) {
        TerrainChoice::Slope => {
            TerrainKind::Slope { angle_rad: s.number("angle_rad"), heading_rad: s.number("heading_rad") }
        }
        TerrainChoice::Undulating => undulating(s)?,
        TerrainChoice::Crater => TerrainKind::Crater {
            diameter_m: s.number("diameter_m"),
            depth_m: s.number("depth_m"),
            rim_height_m: s.number("rim_height_m"),
            max_slope_rad: s.number("max_slope_rad"),
            centre_m: s.numbers("centre_m"),
        },
        TerrainChoice::EsriAscii => {
            TerrainKind::EsriAscii { file: s.file("file"), fill_m: s.optional_number("fill_m") }
        }
        TerrainChoice::Geotiff => {
            TerrainKind::Geotiff { file: s.file("file"), fill_m: s.optional_number("fill_m") }
        }
        TerrainChoice::Png => TerrainKind::Png {
            file: s.file("file"),
            greys: Greys {
                pixel_m: s.number("pixel_m"),
                low_m: s.number("low_m"),
                high_m: s.number("high_m"),
            },
            fill_m: s.optional_number("fill_m"),
        },
        TerrainChoice::Flat => TerrainKind::Flat { height_m: s.number("height_m") },
    };
    if s.optional_number("spacing_m").is_none() && !READ.contains(&s.text("kind").as_str()) {
        let help = Some("spacing_m: distance of lattice nodes, e.g. spacing_m = 0.01".into());
        return Err(s.error("", "`terrain` lacks `spacing_m`".into(), help));
    }
    let spec = TerrainSpec { size_m: s.numbers("size_m"), spacing_m: s.number("spacing_m"), kind };
    check_lattice(s, &spec)?;
    Ok(spec)
}

fn undulating(s: &Section) -> Result<TerrainKind, Box<InputError>> {
    let wavelengths_m: [f64; 2] = s.numbers("wavelengths_m");
    if wavelengths_m[0] > wavelengths_m[1] {
        let message = "`wavelengths_m` are the shortest and the longest, in this order".to_owned();
        let help = format!("wavelengths_m = [{}, {}]", wavelengths_m[1], wavelengths_m[0]);
        return Err(s.error("wavelengths_m", message, Some(help)));
    }
    Ok(TerrainKind::Undulating {
        rms_m: s.number("rms_m"),
        wavelengths_m,
        seed: s.optional_count("seed"),
        flat_radius_m: s.number("flat_radius_m"),
    })
}

/// The lattice must have a few nodes and not more than fit into memory.
fn check_lattice(s: &Section, spec: &TerrainSpec) -> Result<(), Box<InputError>> {
    let [nx, ny] = spec.size_m.map(|size| size / spec.spacing_m);
    if spec.spacing_m > 0.0 && (nx < 2.0 || ny < 2.0) {
        let message = format!("`spacing_m` = {} leaves fewer than two cells in `size_m`", spec.spacing_m);
        return Err(s.error(
            "spacing_m",
            message,
            Some("make the spacing smaller or the ground larger".into()),
        ));
    }
    if spec.spacing_m > 0.0
        && let Some(refused) = too_many(spec.size_m, spec.spacing_m)
    {
        let message = format!(
            "`size_m` = {:?} with `spacing_m` = {} makes {}",
            spec.size_m, spec.spacing_m, refused.what
        );
        return Err(s.error("spacing_m", message, Some(refused.help(SMALLER))));
    }
    Ok(())
}
