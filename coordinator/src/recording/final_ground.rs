//! The ground at the end of a run as ESRI ASCII grid, which every GIS and the scenario loader read.

use crate::error::Result;
use crate::recording::layout::at;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use terraglue_subsystem::FieldInfo;

/// Writes heights (m, row by row along x from the smallest y), northern row first as the format demands. Nodes
/// are centres of cells.
pub(crate) fn write(path: &Path, info: &FieldInfo, heights: &[f64]) -> Result {
    rows(path, info, heights).map_err(at(path))
}

fn rows(path: &Path, info: &FieldInfo, heights: &[f64]) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let [columns, lines] = info.size;
    writeln!(out, "ncols {columns}\nnrows {lines}")?;
    writeln!(out, "xllcenter {}\nyllcenter {}", info.origin[0], info.origin[1])?;
    writeln!(out, "cellsize {}\nNODATA_value -9999", info.spacing)?;
    for row in heights.chunks_exact(columns as usize).rev() {
        for (k, z) in row.iter().enumerate() {
            write!(out, "{}{z}", if k == 0 { "" } else { " " })?;
        }
        writeln!(out)?;
    }
    out.flush()
}
