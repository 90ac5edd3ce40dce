//! Reads the ESRI ASCII grid: six lines of header, then rows of heights from north to south.

use super::check_declared;
use super::resample::Raster;
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_scenario::InputError;

/// Reads a grid. Values that mark missing data become `fill` (m). `spacing` (m): that of the ground made of it, where one is.
///
/// # Errors
/// [`Error::File`] when it cannot be read; [`Error::Input`] with file and line when it is not a whole grid,
/// is too large, or has missing data and no `fill`.
pub fn read_esri_ascii(path: &Path, fill: Option<f64>, spacing: Option<f64>) -> Result<Raster> {
    let text = terraglue_subsystem::files::read_large_text(path).map_err(|e| unreadable(path, e))?;
    let file = File { path, text: &text };
    let (header, first_line) = read_header(&file)?;
    check_declared(path, header.size, [header.cell; 2], spacing)?;
    let mut heights = Vec::with_capacity(header.count());
    let mut last_line = first_line;
    for (number, line) in file.lines().skip_while(|(n, _)| *n < first_line) {
        for word in line.split_whitespace() {
            heights.push(read_height(&file, &header, number, word, fill)?);
            last_line = number;
        }
    }
    let (expected, found) = (header.count(), heights.len());
    if expected != found {
        let [nx, ny] = header.size;
        let message = format!("expected {expected} values ({nx} × {ny}), found {found}");
        return Err(file.error(last_line, message, Some(truncated(expected, found))));
    }
    let rows: Vec<f64> = heights.chunks_exact(header.size[0]).rev().flatten().copied().collect();
    Ok(Raster { size: header.size, step: [header.cell; 2], corner: header.corner, heights: rows })
}

/// Keys of the header.
const KEYS: &str = "ncols, nrows, xllcorner, yllcorner, cellsize and NODATA_value";

fn truncated(expected: usize, found: usize) -> String {
    if found < expected {
        "the file was cut off, or ncols or nrows is wrong"
    } else {
        "ncols or nrows is wrong"
    }
    .to_owned()
}

pub(super) fn unreadable(path: &Path, error: std::io::Error) -> Error {
    if error.kind() == std::io::ErrorKind::InvalidData {
        let help = "an ESRI grid is text; `kind = \"geotiff\"` and `kind = \"png\"` read pictures".to_owned();
        return InputError::plain(format!("{}: not a text file", path.display()), Some(help)).into();
    }
    let message = format!("{}: {error}", path.display());
    InputError::plain(message, Some("the path is relative to the scenario's folder".into())).into()
}

struct File<'a> {
    path: &'a Path,
    text: &'a str,
}

impl<'a> File<'a> {
    /// Lines with their numbers from 1.
    fn lines(&self) -> impl Iterator<Item = (usize, &'a str)> + use<'a> {
        self.text.lines().enumerate().map(|(n, line)| (n + 1, line))
    }

    /// An error at a line; the line is shown only where it is short enough to be read.
    fn error(&self, line: usize, message: String, help: Option<String>) -> Error {
        let shown = self.text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
        let message = format!("{}:{line}: {message}", self.path.display());
        let help =
            help.or_else(|| Some(format!("first {KEYS}, each with a number; then the heights, row by row")));
        if self.text.len() > 100_000 || shown.len() > 200 {
            return InputError::plain(message, help).into();
        }
        let mut error = InputError::in_file(self.path, self.text, line, message);
        error.help = help;
        error.into()
    }
}

struct Header {
    size: [usize; 2],
    cell: f64,
    /// x, y of the south-west node.
    corner: [f64; 2],
    missing: Option<f64>,
}

impl Header {
    fn count(&self) -> usize {
        self.size[0].saturating_mul(self.size[1])
    }

    /// Whether all keys are there; what is not stated is 0 (`cellsize`: not a number).
    fn check(&self, file: &File, cell_line: usize, end: usize) -> Result {
        let missing = |key: &str| Err(file.error(end, format!("the header has no `{key}`"), None));
        match (self.size, self.cell) {
            ([0, _], _) => missing("ncols"),
            ([_, 0], _) => missing("nrows"),
            (_, cell) if cell.is_nan() => missing("cellsize"),
            (_, cell) if cell <= 0.0 => {
                Err(file.error(cell_line, format!("`cellsize` = {cell} is not positive"), None))
            }
            _ => Ok(()),
        }
    }
}

/// The header and the number of the first line after it.
fn read_header(file: &File) -> Result<(Header, usize)> {
    let mut header = Header { size: [0; 2], cell: f64::NAN, corner: [0.0; 2], missing: None };
    let mut corner_of_cell = [false; 2];
    let mut cell_line = 1;
    let mut end = 1;
    for (number, line) in file.lines() {
        let mut words = line.split_whitespace();
        let Some(key) = words.next().map(str::to_ascii_lowercase) else { continue };
        // `nan` starts with a letter but is a value.
        if !key.starts_with(|c: char| c.is_ascii_alphabetic()) || key.parse::<f64>().is_ok() {
            end = number;
            break;
        }
        let value = words.next().and_then(|w| w.parse::<f64>().ok());
        let value = value.filter(|v| v.is_finite() || key == "nodata_value");
        let value = value.ok_or_else(|| file.error(number, format!("`{key}` has no number"), None))?;
        match key.as_str() {
            "ncols" => header.size[0] = count(file, number, &key, value)?,
            "nrows" => header.size[1] = count(file, number, &key, value)?,
            "cellsize" => (header.cell, cell_line) = (value, number),
            "xllcorner" => (header.corner[0], corner_of_cell[0]) = (value, true),
            "yllcorner" => (header.corner[1], corner_of_cell[1]) = (value, true),
            "xllcenter" => header.corner[0] = value,
            "yllcenter" => header.corner[1] = value,
            "nodata_value" => header.missing = Some(value),
            _ => return Err(unknown_key(file, number, &key)),
        }
        end = number + 1;
    }
    header.check(file, cell_line, end)?;
    for (corner, at_corner) in header.corner.iter_mut().zip(corner_of_cell) {
        *corner += if at_corner { 0.5 * header.cell } else { 0.0 };
    }
    Ok((header, end))
}

fn unknown_key(file: &File, line: usize, key: &str) -> Error {
    file.error(line, format!("unknown key `{key}` in the header"), Some(KEYS.to_owned()))
}

fn count(file: &File, line: usize, key: &str, value: f64) -> Result<usize> {
    if value.fract() == 0.0 && (1.0..=1e6).contains(&value) {
        Ok(value as usize)
    } else {
        Err(file.error(line, format!("`{key}` = {value} is not a whole number from 1 to 1000000"), None))
    }
}

fn read_height(file: &File, header: &Header, line: usize, word: &str, fill: Option<f64>) -> Result<f64> {
    let value: f64 = word.parse().map_err(|_| file.error(line, format!("`{word}` is not a number"), None))?;
    let missing = !value.is_finite() || value == header.missing.unwrap_or(-9999.0);
    match (missing, fill) {
        (false, _) => Ok(value),
        (true, Some(fill)) => Ok(fill),
        (true, None) => {
            let help = "give `fill_m`, the height that replaces missing data".to_owned();
            Err(file.error(line, format!("missing data ({word})"), Some(help)))
        }
    }
}
