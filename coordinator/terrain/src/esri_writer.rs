//! Writes a field over the ground as an ESRI ASCII grid, which every geographic program opens.

use std::io::{BufWriter, Write};
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_subsystem::{FieldInfo, FieldTile};

/// Decimals of a height: 0.1 µm, finer than the fixed point of the ground.
const DECIMALS: usize = 7;
/// Of the last decimal in a metre.
const PER_METRE: f64 = 1e7;

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
        if i > 0 {
            out.write_all(b" ")?;
        }
        write_height(out, value)?;
    }
    out.write_all(b"\n")
}

/// A height to [`DECIMALS`] decimals, by whole numbers: the exact way of `fmt` takes ten times as long. No zero is negative.
fn write_height(out: &mut impl Write, value: f64) -> std::io::Result<()> {
    /// Above this fewer decimals are exact, and `fmt` finds them.
    const LARGEST: f64 = 1e14;
    let count = (value * PER_METRE).round();
    if !(count.abs() <= LARGEST) {
        return write!(out, "{:.DECIMALS$}", count / PER_METRE);
    }
    let mut text = [0; 24];
    let (mut left, mut first) = (count.abs() as u64, text.len());
    while left > 0 || first + DECIMALS >= text.len() {
        first -= 1;
        if text.len() - first == DECIMALS + 1 {
            text[first] = b'.';
            first -= 1;
        }
        text[first] = b'0' + (left % 10) as u8;
        left /= 10;
    }
    if count < 0.0 {
        first -= 1;
        text[first] = b'-';
    }
    out.write_all(&text[first..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    fn written(value: f64) -> String {
        let mut out = Vec::new();
        write_height(&mut out, value).expect("written");
        String::from_utf8(out).expect("text")
    }

    fn formatted(value: f64) -> String {
        format!("{:.DECIMALS$}", (value * PER_METRE).round() / PER_METRE + 0.0)
    }

    #[test]
    fn heights_at_the_edges_are_written_as_fmt_writes_them() {
        let edges =
            [0.0, -0.0, 4e-8, -4e-8, 5e-8, 1e-7, -1e-7, 0.9999999, 0.99999996, 1.0, -1.0, 9.5, -10.0, 511.0];
        for value in
            edges.into_iter().chain([1e6, -1e7, 1.1e7, 1e20, f64::NAN, f64::INFINITY, f64::NEG_INFINITY])
        {
            assert_eq!(written(value), formatted(value), "{value:e}");
        }
    }

    #[test]
    fn heights_are_written_as_fmt_writes_them() {
        let mut random = SplitMix64::new(7);
        for largest in [1e-6, 1e-3, 1.0, 600.0, 9e6] {
            for _ in 0..2000 {
                let value = largest * (2.0 * random.unit() - 1.0);
                assert_eq!(written(value), formatted(value), "{value:e}");
            }
        }
    }
}
