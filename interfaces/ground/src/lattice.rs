//! The regular lattice of a ground and its division into tiles.

use terraglue_subsystem::{FieldInfo, Terrain};

/// Nodes along the edge of a tile.
pub const TILE_EDGE: u32 = 32;
/// Nodes of a tile.
pub const TILE_NODES: usize = (TILE_EDGE * TILE_EDGE) as usize;

/// Nodes (i, j), `0 ≤ i < size[0]`, `0 ≤ j < size[1]`, at `origin + (i, j)·spacing`.
///
/// Each node stands for the cell of side `spacing` around it. Tiles hold 32 × 32 nodes, x fastest; tile
/// (a, b) starts at node (32·a, 32·b) and has number `b·tiles[0] + a`.
///
/// ```
/// use terraglue_ground::Lattice;
///
/// let lattice = Lattice { origin: [-1.0, 0.0], spacing: 0.5, size: [5, 40] };
/// assert_eq!((lattice.node_count(), lattice.tiles()), (200, [1, 2]));
/// assert_eq!(lattice.position(2, 1), [0.0, 0.5]);
/// assert!(lattice.contains(0.9, 19.0) && !lattice.contains(1.6, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// World x, y of node (0, 0), m.
    pub origin: [f64; 2],
    /// Distance of neighbouring nodes, m.
    pub spacing: f64,
    /// Number of nodes along x and y.
    pub size: [u32; 2],
}

impl Lattice {
    /// The lattice of a terrain.
    pub fn of_terrain(terrain: &dyn Terrain) -> Self {
        Self { origin: terrain.origin(), spacing: terrain.spacing(), size: terrain.size() }
    }

    /// The lattice of a field; `None` when its tiles are not 32 × 32.
    pub fn of_field(info: &FieldInfo) -> Option<Self> {
        (info.tile_edge == TILE_EDGE).then_some(Self {
            origin: info.origin,
            spacing: info.spacing,
            size: info.size,
        })
    }

    /// Describes a field on this lattice.
    pub fn field_info(&self, name: &str, unit: &str) -> FieldInfo {
        FieldInfo {
            name: name.into(),
            unit: unit.into(),
            origin: self.origin,
            spacing: self.spacing,
            size: self.size,
            tile_edge: TILE_EDGE,
        }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Number of tiles along x and y.
    #[inline]
    pub const fn tiles(&self) -> [u32; 2] {
        [self.size[0].div_ceil(TILE_EDGE), self.size[1].div_ceil(TILE_EDGE)]
    }

    /// Number of tiles.
    pub const fn tile_count(&self) -> usize {
        let [a, b] = self.tiles();
        a as usize * b as usize
    }

    /// World x, y of a node, m; also of indices outside.
    #[inline]
    pub fn position(&self, i: i32, j: i32) -> [f64; 2] {
        [self.origin[0] + f64::from(i) * self.spacing, self.origin[1] + f64::from(j) * self.spacing]
    }

    /// Smallest and largest world x, y of the nodes, m.
    #[inline]
    pub fn extent(&self) -> [[f64; 2]; 2] {
        let last = |k: usize| f64::from(self.size[k].saturating_sub(1)) * self.spacing;
        [self.origin, [self.origin[0] + last(0), self.origin[1] + last(1)]]
    }

    /// Whether a world point lies between the first and the last nodes.
    #[inline]
    pub fn contains(&self, x: f64, y: f64) -> bool {
        let [low, high] = self.extent();
        x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1]
    }

    /// Whether (i, j) is a node.
    #[inline]
    pub fn has(&self, i: i32, j: i32) -> bool {
        i >= 0 && j >= 0 && (i as u32) < self.size[0] && (j as u32) < self.size[1]
    }

    /// The nearest node of the lattice to indices that may lie outside.
    #[inline]
    pub fn clamp(&self, i: i32, j: i32) -> (u32, u32) {
        let limit = |k: i32, n: u32| (k.max(0) as u32).min(n - 1);
        (limit(i, self.size[0]), limit(j, self.size[1]))
    }

    /// Node coordinates of a world point: node (i, j) has (i, j).
    #[inline]
    pub fn coordinates(&self, x: f64, y: f64) -> [f64; 2] {
        [(x - self.origin[0]) / self.spacing, (y - self.origin[1]) / self.spacing]
    }

    /// Smallest and largest index along axis k of the nodes whose cells meet the interval [low, high] (m);
    /// first > last when there are none.
    #[inline]
    pub fn cell_range(&self, k: usize, low: f64, high: f64) -> (i32, i32) {
        let index = |v: f64| (v - self.origin[k]) / self.spacing;
        let last = f64::from(self.size[k]) - 1.0;
        let first = (index(low) + 0.5).floor().max(0.0).min(last + 1.0);
        let end = (index(high) + 0.5).floor().min(last).max(-1.0);
        (first as i32, end as i32)
    }

    /// Number of the tile of node (i, j) and the position of the node in it.
    #[inline]
    pub fn locate(&self, i: u32, j: u32) -> (usize, usize) {
        let tile = (j / TILE_EDGE) as usize * self.tiles()[0] as usize + (i / TILE_EDGE) as usize;
        (tile, ((j % TILE_EDGE) * TILE_EDGE + i % TILE_EDGE) as usize)
    }

    /// First node of a tile and how many of its nodes along x and y lie inside the lattice.
    pub fn tile_nodes(&self, tile: usize) -> ([u32; 2], [u32; 2]) {
        let nx = self.tiles()[0].max(1) as usize;
        let first = [(tile % nx) as u32 * TILE_EDGE, (tile / nx) as u32 * TILE_EDGE];
        let inside = |k: usize| self.size[k].saturating_sub(first[k]).min(TILE_EDGE);
        (first, [inside(0), inside(1)])
    }
}
