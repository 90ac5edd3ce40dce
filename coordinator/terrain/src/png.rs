//! Reads a greyscale PNG image as heights: black is the lowest, white the highest.

use super::check_declared;
use super::esri_ascii::unreadable;
use super::resample::Raster;
use png::{BitDepth, ColorType, Decoder, DecodingError, Transformations};
use std::io::{BufReader, ErrorKind};
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_scenario::{Greys, InputError};

const CURE: &str = "write it again as a greyscale PNG of 8 or 16 bits";

/// Reads an image of 8 or 16 bits of grey (fewer are spread over 8); its upper row is the one of the largest y. Pixels that
/// are wholly transparent are missing data and become `fill` (m). `spacing` (m): that of the ground made of it, where one is.
///
/// # Errors
/// [`Error::Input`] when it is no greyscale image, is too large, was cut off, or has missing data and no `fill`.
pub fn read_png(path: &Path, greys: Greys, fill: Option<f64>, spacing: Option<f64>) -> Result<Raster> {
    let file = terraglue_subsystem::files::open(path).map_err(|e| unreadable(path, e))?;
    let mut decoder = Decoder::new(BufReader::new(file));
    decoder.set_transformations(Transformations::EXPAND);
    let wrong = |message: String| input(path, message, Some(CURE));
    let mut reader = decoder.read_info().map_err(|e| wrong(format!("not a PNG image: {}", fault(&e))))?;
    let declared = [reader.info().width as usize, reader.info().height as usize];
    check_declared(path, declared, [greys.pixel_m; 2], spacing)?;
    let size = reader.output_buffer_size().ok_or_else(|| wrong("too large".into()))?;
    let mut bytes = vec![0; size];
    let frame =
        reader.next_frame(&mut bytes).map_err(|e| wrong(format!("cannot be read whole: {}", fault(&e))))?;
    let [width, height] = [frame.width as usize, frame.height as usize];
    let channels = match frame.color_type {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        _ => {
            let help = "convert it to greyscale; 16 bits keep small differences of height";
            return Err(input(path, "a coloured image contains no heights".into(), Some(help)));
        }
    };
    let wide = frame.bit_depth == BitDepth::Sixteen;
    let pixel = channels * if wide { 2 } else { 1 };
    let mut heights = Vec::with_capacity(width * height);
    for row in bytes.chunks_exact(frame.line_size).take(height).rev() {
        for pixel in row.chunks_exact(pixel).take(width) {
            let missing = channels == 2 && share(pixel, 1, wide) == 0.0;
            heights.push(match (missing, fill) {
                (false, _) => greys.low_m + share(pixel, 0, wide) * (greys.high_m - greys.low_m),
                (true, Some(fill)) => fill,
                (true, None) => {
                    let help = "give `fill_m`, the height that replaces missing data";
                    return Err(input(path, "missing data (transparent pixels)".into(), Some(help)));
                }
            });
        }
    }
    Ok(Raster { size: [width, height], step: [greys.pixel_m; 2], corner: [0.0; 2], heights })
}

/// Description of a defect of an image: the decoder's own messages show its data structures.
fn fault(error: &DecodingError) -> String {
    match error {
        DecodingError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => "it is cut off".into(),
        DecodingError::IoError(e) => e.to_string(),
        DecodingError::LimitsExceeded => "it needs more memory than an image may".into(),
        DecodingError::Parameter(_) => "its structure is damaged".into(),
        DecodingError::Format(e) => match e.to_string() {
            text if text.starts_with("CRC error") => "a checksum is wrong, so it is damaged".into(),
            text if text.starts_with("Corrupt deflate") => "its compressed data are damaged".into(),
            text if text.contains('{') || text.contains("Some(") => "its structure is damaged".into(),
            text => text.trim_end_matches('.').to_owned(),
        },
    }
}

/// Channel k of a pixel, 0 … 1.
fn share(pixel: &[u8], k: usize, wide: bool) -> f64 {
    if wide {
        f64::from(u16::from_be_bytes([pixel[2 * k], pixel[2 * k + 1]])) / f64::from(u16::MAX)
    } else {
        f64::from(pixel[k]) / f64::from(u8::MAX)
    }
}

fn input(path: &Path, message: String, help: Option<&str>) -> Error {
    InputError::plain(format!("{}: {message}", path.display()), help.map(Into::into)).into()
}
