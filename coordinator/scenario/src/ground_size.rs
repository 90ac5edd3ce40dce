//! How many nodes a ground may have, and what to do about one that has too many.

/// Most nodes of a terrain. A run holds about 45 bytes a node where its ground is largest, when it is recorded: 2.3 GB, which
/// most machines have, and a recording of 400 MB at the start and once more at the end.
const MOST_NODES: f64 = 5e7;
/// See [`MOST_NODES`].
const BYTES_PER_NODE: f64 = 45.0;

/// A ground with more nodes than fit.
pub struct TooMany {
    /// Its nodes and the memory that they need, in words.
    pub what: String,
    /// A spacing that fits, m.
    fits_m: f64,
}

impl TooMany {
    /// The way out, and another one.
    pub fn help(&self, other: &str) -> String {
        format!("`spacing_m` = {} fits this size; or {other}", self.fits_m)
    }
}

/// Whether a ground has more nodes than fit.
pub fn too_many(size_m: [f64; 2], spacing_m: f64) -> Option<TooMany> {
    let cells = size_m.map(|s| s / spacing_m);
    let nodes = (cells[0] + 1.0) * (cells[1] + 1.0);
    if nodes <= MOST_NODES && cells.iter().all(|n| *n < MOST_CELLS) {
        return None;
    }
    let fits = (size_m[0] * size_m[1] / MOST_NODES).sqrt().max(size_m[0].max(size_m[1]) / MOST_CELLS) * 1.001;
    let unit = 10_f64.powf(fits.log10().floor() - 1.0);
    let fits_m: f64 = format!("{:.1e}", (fits / unit).ceil() * unit).parse().unwrap_or(fits);
    let bytes = nodes * BYTES_PER_NODE;
    let what = format!(
        "{nodes:.2e} nodes, for which a run would need about {}; at most {MOST_NODES:.0e} are taken, and {MOST_CELLS:.0e} cells a side",
        if bytes < 1e12 {
            format!("{:.1} GB of memory", bytes * 1e-9)
        } else {
            format!("{:.1e} GB of memory", bytes * 1e-9)
        }
    );
    Some(TooMany { what, fits_m })
}

/// The way out where a scenario gives the size.
pub const SMALLER: &str = "make `size_m` smaller";

/// Most cells along a side.
const MOST_CELLS: f64 = 1e6;
