//! Writes a field over the ground as an ESRI ASCII grid, which every geographic program opens.

use std::io::{BufWriter, Write};
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_subsystem::{FieldInfo, FieldTile};

/// Decimals of a height: 0.1 µm, finer than the fixed point of the ground.
const DECIMALS: usize = 7;

/// Writes a field; `tile(a, b)` gives its tiles (e.g. `Subsystem::field_tile`).
///
/// # Errors
/// [`Error::File`] when the file cannot be written, [`Error::Simulation`] when a tile cannot be had.
pub fn write_esri_ascii<'a>(
    path: &Path,
    info: &FieldInfo,
    tile: impl Fn(u32, u32) -> terraglue_subsystem::Result<FieldTile<'a>>,
) -> Result {
    let failed = |source| Error::File { path: path.display().to_string(), source };
    let mut out = BufWriter::new(std::fs::File::create(path).map_err(failed)?);
    write_header(&mut out, info).map_err(failed)?;
    let tiles_x = info.size[0].div_ceil(info.tile_edge);
    let mut row_tiles: Vec<FieldTile> = Vec::with_capacity(tiles_x as usize);
    let mut current = u32::MAX;
    for j in (0..info.size[1]).rev() {
        let b = j / info.tile_edge;
        if b != current {
            row_tiles.clear();
            for a in 0..tiles_x {
                row_tiles.push(tile(a, b).map_err(|e| unreadable(&info.name, &e))?);
            }
            current = b;
        }
        write_row(&mut out, info, &row_tiles, j).map_err(failed)?;
    }
    out.flush().map_err(failed)
}

fn unreadable(field: &str, error: &terraglue_subsystem::Error) -> Error {
    Error::Simulation { time_s: 0.0, message: format!("the field `{field}` cannot be read: {error}") }
}

fn write_header(out: &mut impl Write, info: &FieldInfo) -> std::io::Result<()> {
    let corner = info.origin.map(|o| o - 0.5 * info.spacing);
    writeln!(out, "ncols {}\nnrows {}", info.size[0], info.size[1])?;
    writeln!(out, "xllcorner {}\nyllcorner {}", corner[0], corner[1])?;
    writeln!(out, "cellsize {}\nNODATA_value -9999", info.spacing)
}

fn write_row(out: &mut impl Write, info: &FieldInfo, tiles: &[FieldTile], j: u32) -> std::io::Result<()> {
    let edge = info.tile_edge;
    for i in 0..info.size[0] {
        let value = tiles[(i / edge) as usize].values.at(((j % edge) * edge + i % edge) as usize);
        // Adding zero turns −0 into 0, which rounding makes of tiny negative heights.
        let rounded = (value * 1e7).round() / 1e7 + 0.0;
        let space = if i == 0 { "" } else { " " };
        write!(out, "{space}{rounded:.DECIMALS$}")?;
    }
    writeln!(out)
}
