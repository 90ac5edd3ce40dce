//! Arrays of NumPy in an archive: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>, as much of it as the
//! files of `TERRAGLUE_FOREST_DATA` use.

use crate::process::Outcome;
use std::io::Read;
use std::path::Path;

/// The numbers of an array of 32-bit floats or integers, or 64-bit floats, row by row.
pub fn array(path: &Path, name: &str) -> Outcome<Vec<f64>> {
    let told = |e: &dyn std::fmt::Display| format!("{}: {name}: {e}", path.display());
    let file = std::fs::File::open(path).map_err(|e| told(&e))?;
    let mut archive = zip::ZipArchive::new(file).map_err(|e| told(&e))?;
    let mut bytes = Vec::new();
    let mut entry = archive.by_name(&format!("{name}.npy")).map_err(|e| told(&e))?;
    entry.read_to_end(&mut bytes).map_err(|e| told(&e))?;
    let length = match bytes.get(6..12) {
        Some([1, _, a, b, ..]) => Some(10 + usize::from(u16::from_le_bytes([*a, *b]))),
        Some([_, _, a, b, c, d]) => Some(12 + u32::from_le_bytes([*a, *b, *c, *d]) as usize),
        _ => None,
    };
    let length = length.filter(|n| *n <= bytes.len()).ok_or_else(|| told(&"no array of NumPy"))?;
    let head = String::from_utf8_lossy(&bytes[..length]).into_owned();
    let values = &bytes[length..];
    let (four, _) = values.as_chunks::<4>();
    let (eight, _) = values.as_chunks::<8>();
    match () {
        () if head.contains("'<f4'") => Ok(four.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect()),
        () if head.contains("'<i4'") => Ok(four.iter().map(|b| f64::from(i32::from_le_bytes(*b))).collect()),
        () if head.contains("'<f8'") => Ok(eight.iter().map(|b| f64::from_le_bytes(*b)).collect()),
        () => Err(told(&format!("numbers of another kind: {head}"))),
    }
}
