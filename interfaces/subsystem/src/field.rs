//! Fields over the ground (height, sinkage, pressure, …), shown tile by tile without a copy.

/// Name, unit and lattice of a field. Nodes (i, j), 0 ≤ i < nx, at `origin + (i, j)·spacing`.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldInfo {
    /// Name; `height` is the surface that contact detection reads.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// World x, y of node (0, 0), m.
    pub origin: [f64; 2],
    /// Distance of neighbouring nodes, m.
    pub spacing: f64,
    /// Number of nodes along x and y.
    pub size: [u32; 2],
    /// Nodes along the edge of a tile; tile (a, b) holds nodes (a·edge …, b·edge …), row-major with x fastest.
    pub tile_edge: u32,
}

/// One tile of a field.
#[derive(Clone, Copy, Debug)]
pub struct FieldTile<'a> {
    /// Grows whenever a value in the tile changes.
    pub generation: u64,
    /// edge × edge values, x fastest; nodes beyond the field's size are padding.
    pub values: TileValues<'a>,
}

/// Values of a tile.
#[derive(Clone, Copy, Debug)]
pub enum TileValues<'a> {
    /// The same everywhere.
    Uniform(f64),
    /// As they are.
    F64(&'a [f64]),
    /// As they are.
    F32(&'a [f32]),
    /// Fixed point: value = data·unit.
    Fixed {
        /// Integers.
        data: &'a [i32],
        /// Value of one.
        unit: f64,
    },
}

impl TileValues<'_> {
    /// Value number k of the tile.
    #[inline]
    pub fn at(&self, k: usize) -> f64 {
        match self {
            Self::Uniform(v) => *v,
            Self::F64(d) => d[k],
            Self::F32(d) => f64::from(d[k]),
            Self::Fixed { data, unit } => f64::from(data[k]) * unit,
        }
    }
}
