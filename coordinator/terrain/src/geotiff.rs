//! Reads a GeoTIFF elevation model: one band of integers or floating-point numbers with its pixel scale.

use super::check_declared;
use super::esri_ascii::unreadable;
use super::resample::Raster;
use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_scenario::InputError;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;
use tiff::{TiffError, TiffFormatError};

type Tiff = Decoder<BufReader<File>>;

/// Key of the model type in the directory of geographic keys, and its value for degrees.
const MODEL_TYPE: u16 = 1024;
const GEOGRAPHIC: u16 = 2;

const CURE: &str = "write it again as one band, e.g. with gdal_translate -b 1 -ot Float32";

/// Reads the first image. Values that mark missing data become `fill` (m). `spacing` (m): that of the ground made of it,
/// where one is.
///
/// # Errors
/// [`Error::Input`] when it is not an elevation model in metres, is too large, was cut off, or has missing data and
/// no `fill`.
pub fn read_geotiff(path: &Path, fill: Option<f64>, spacing: Option<f64>) -> Result<Raster> {
    let file = terraglue_subsystem::files::open(path).map_err(|e| unreadable(path, e))?;
    let wrong = |message: String| input(path, message, Some(CURE));
    let mut tiff =
        Decoder::new(BufReader::new(file)).map_err(|e| wrong(format!("not a TIFF file: {}", fault(&e))))?;
    let (width, height) = tiff.dimensions().map_err(|e| wrong(fault(&e)))?;
    let step = pixel_scale(path, &mut tiff)?;
    check_declared(path, [width as usize, height as usize], step, spacing)?;
    let tie = tiff.get_tag_f64_vec(Tag::ModelTiepointTag).unwrap_or_default();
    let missing = tiff.get_tag_ascii_string(Tag::GdalNodata).ok();
    let missing = missing.and_then(|s| s.trim_matches(['\0', ' ']).parse::<f64>().ok());
    let values = tiff.read_image().map_err(|e| wrong(format!("cannot be read whole: {}", fault(&e))))?;
    let values =
        as_numbers(values).ok_or_else(|| wrong("pixels are of a type that is not supported".into()))?;
    let count = width as usize * height as usize;
    if values.len() != count {
        let bands = values.len() / count;
        return Err(input(path, format!("{bands} bands; an elevation model has one"), Some(CURE)));
    }
    let mut heights = Vec::with_capacity(count);
    for row in values.chunks_exact(width as usize).rev() {
        for value in row {
            heights.push(present(path, *value, missing, fill)?);
        }
    }
    Ok(Raster { size: [width as usize, height as usize], step, corner: corner(&tie, step, height), heights })
}

/// Description of a defect of a file: the decoder's own messages show its data structures.
fn fault(error: &TiffError) -> String {
    match error {
        TiffError::FormatError(
            TiffFormatError::TiffSignatureNotFound | TiffFormatError::TiffSignatureInvalid,
        ) => "it does not begin like one".into(),
        TiffError::FormatError(_) => "its structure is damaged".into(),
        TiffError::UnsupportedError(_) => "it is of a kind that is not supported".into(),
        TiffError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => "it is cut off".into(),
        TiffError::IoError(e) => e.to_string(),
        TiffError::LimitsExceeded => "it needs more memory than an image may".into(),
        _ => "its numbers make no sense".into(),
    }
}

fn input(path: &Path, message: String, help: Option<&str>) -> Error {
    InputError::plain(format!("{}: {message}", path.display()), help.map(Into::into)).into()
}

/// Width and height of a pixel, m.
fn pixel_scale(path: &Path, tiff: &mut Tiff) -> Result<[f64; 2]> {
    let keys = tiff.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap_or_default();
    if keys.chunks_exact(4).skip(1).any(|k| k[0] == MODEL_TYPE && k[1] == 0 && k[3] == GEOGRAPHIC) {
        let help = "project it to metres first, e.g. with gdalwarp -t_srs";
        return Err(input(path, "its coordinates are degrees".into(), Some(help)));
    }
    let scale = tiff.get_tag_f64_vec(Tag::ModelPixelScaleTag).unwrap_or_default();
    match scale.as_slice() {
        [dx, dy, ..] if *dx > 0.0 && *dy > 0.0 && dx.is_finite() && dy.is_finite() => Ok([*dx, *dy]),
        _ => Err(input(
            path,
            "no pixel scale (tag ModelPixelScale)".into(),
            Some("a rotated or plain TIFF image has none; convert it with gdalwarp"),
        )),
    }
}

/// The file's x, y of the south-west pixel, from the first tie point (raster i, j, k; model x, y, z).
fn corner(tie: &[f64], step: [f64; 2], height: u32) -> [f64; 2] {
    match tie {
        [i, j, _, x, y, ..] => [x - i * step[0], y - (f64::from(height) - 1.0 - j) * step[1]],
        _ => [0.0; 2],
    }
}

fn as_numbers(values: DecodingResult) -> Option<Vec<f64>> {
    Some(match values {
        DecodingResult::F64(v) => v,
        DecodingResult::F32(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::U8(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::U16(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::U32(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::I8(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::I16(v) => v.into_iter().map(f64::from).collect(),
        DecodingResult::I32(v) => v.into_iter().map(f64::from).collect(),
        _ => return None,
    })
}

fn present(path: &Path, value: f64, missing: Option<f64>, fill: Option<f64>) -> Result<f64> {
    // A marker such as −3.4e38 is written in decimal and loses digits against a 32-bit pixel.
    let marked = missing.is_some_and(|m| value == m || (value as f32) == (m as f32));
    match (marked || !value.is_finite(), fill) {
        (false, _) => Ok(value),
        (true, Some(fill)) => Ok(fill),
        (true, None) => Err(input(
            path,
            format!("missing data ({value})"),
            Some("give `fill_m`, the height that replaces missing data"),
        )),
    }
}
