//! Heights of the ground's material in fixed point: material moves between nodes in whole units, so none is lost.

use crate::Surface;
use crate::identity::Identity;
use crate::lattice::{Lattice, TILE_EDGE, TILE_NODES};
use crate::pool::Pool;
use terraglue_subsystem::{FieldInfo, FieldTile, Terrain, TerrainTile, TileValues};

/// Height of one unit, m: 2⁻²² m (0.24 µm), so an i32 spans ±512 m.
pub const UNIT_M: f64 = 1.0 / 4_194_304.0;

/// Largest height that is accepted at the start, m; leaves a metre for piles and holes.
const LIMIT_M: f64 = 511.0;
/// Tiles that can be touched before memory is allocated again.
const RESERVE_TILES: usize = 1024;
const UNTOUCHED: u32 = u32::MAX;

/// Terrain that cannot become a height field.
#[derive(Clone, Debug, PartialEq)]
pub enum HeightError {
    /// A node is not a number or too high for the fixed point.
    OutOfRange {
        /// Node.
        node: [u32; 2],
        /// Its height, m.
        height: f64,
    },
    /// No nodes, or a spacing that is not positive.
    Empty,
}

impl std::fmt::Display for HeightError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::OutOfRange { node: [i, j], height } => {
                write!(f, "terrain: height {height} m at node ({i}, {j}) is outside ±{LIMIT_M} m")
            }
            Self::Empty => write!(f, "terrain: it has no nodes or no positive spacing"),
        }
    }
}

impl std::error::Error for HeightError {}

impl From<HeightError> for terraglue_subsystem::Error {
    fn from(error: HeightError) -> Self {
        Self::Failed(error.to_string())
    }
}

/// Storage of the heights of a tile.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Heights {
    Uniform(i32),
    Stored(u32),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile {
    pub heights: Heights,
    /// Pool tile of (initial − current) in units; [`UNTOUCHED`]: all zero.
    pub sinkage: u32,
    pub generation: u64,
}

/// Heights of all nodes in units of [`UNIT_M`], with the sinkage since the start.
///
/// A tile is either one number or 32 × 32 stored ones; the sinkage is stored from the first write on, so the
/// initial height is always current + sinkage and never kept twice.
///
/// ```
/// use terraglue_ground::{HeightField, Lattice, UNIT_M};
///
/// let lattice = Lattice { origin: [0.0, 0.0], spacing: 0.01, size: [64, 64] };
/// let mut field = HeightField::flat(lattice, 0.25)?;
/// let start = field.units(3, 4);
/// field.add_units(3, 4, -100);
/// assert_eq!((field.sinkage_units(3, 4), field.initial_units(3, 4)), (100, start));
/// assert!((field.height(3, 4) - (0.25 - 100.0 * UNIT_M)).abs() < UNIT_M);
/// # Ok::<(), terraglue_ground::HeightError>(())
/// ```
#[derive(Clone, Debug)]
pub struct HeightField {
    lattice: Lattice,
    pub(crate) tiles: Vec<Tile>,
    pub(crate) touched: Vec<u32>,
    pub(crate) pool: Pool<i32>,
    /// Grows with every write and never goes back: the source of the tiles' generations.
    writes: u64,
    pub(crate) identity: Identity,
}

impl HeightField {
    /// Flat ground, `height` rounded to a unit.
    ///
    /// # Errors
    /// [`HeightError`]: the lattice cannot be used, or the height is out of range.
    pub fn flat(lattice: Lattice, height: f64) -> Result<Self, HeightError> {
        check(&lattice)?;
        let heights = Heights::Uniform(to_units(height, [0, 0])?);
        let count = lattice.tile_count();
        let mut pool = Pool::new(0);
        pool.reserve(2 * RESERVE_TILES.min(count));
        let tiles = vec![Tile { heights, sinkage: UNTOUCHED, generation: 0 }; count];
        let touched = Vec::with_capacity(count);
        Ok(Self { lattice, tiles, touched, pool, writes: 0, identity: Identity::default() })
    }

    /// The ground of a scenario, each node rounded to the nearest unit.
    ///
    /// # Errors
    /// [`HeightError`]: the lattice cannot be used, or a height is out of range.
    pub fn from_terrain(terrain: &dyn Terrain) -> Result<Self, HeightError> {
        let mut field = Self::flat(Lattice::of_terrain(terrain), 0.0)?;
        let mut metres = vec![0.0; TILE_NODES];
        let mut units = vec![0; TILE_NODES];
        let edge = TILE_EDGE as usize;
        for tile in 0..field.tiles.len() {
            let (first, _) = field.lattice.tile_nodes(tile);
            let (i0, j0) = (i64::from(first[0]), i64::from(first[1]));
            if let TerrainTile::Uniform(h) = terrain.heights(i0, j0, edge, edge, &mut metres) {
                field.tiles[tile].heights = Heights::Uniform(to_units(h, first)?);
                continue;
            }
            for (k, (unit, metre)) in units.iter_mut().zip(&metres).enumerate() {
                let k = k as u32;
                *unit = to_units(*metre, [first[0] + k % TILE_EDGE, first[1] + k / TILE_EDGE])?;
            }
            field.tiles[tile].heights = field.store(&units);
        }
        field.pool.reserve(2 * RESERVE_TILES.min(field.tiles.len()));
        Ok(field)
    }

    fn store(&mut self, units: &[i32]) -> Heights {
        if units.iter().all(|u| *u == units[0]) {
            return Heights::Uniform(units[0]);
        }
        let slot = self.pool.take();
        self.pool.tile_mut(slot).copy_from_slice(units);
        Heights::Stored(slot)
    }

    /// Lattice of the nodes.
    #[inline]
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Height of node (i, j) in units; indices outside read the nearest node of the edge.
    #[inline]
    pub fn units(&self, i: i32, j: i32) -> i32 {
        let (i, j) = self.lattice.clamp(i, j);
        let (tile, k) = self.lattice.locate(i, j);
        self.units_at(tile, k)
    }

    /// Height of node k of a tile in units.
    #[inline]
    pub fn units_at(&self, tile: usize, k: usize) -> i32 {
        match self.tiles[tile].heights {
            Heights::Uniform(u) => u,
            Heights::Stored(slot) => self.pool.value(slot, k),
        }
    }

    /// Height of node (i, j), m; indices outside read the nearest node of the edge.
    #[inline]
    pub fn height(&self, i: i32, j: i32) -> f64 {
        f64::from(self.units(i, j)) * UNIT_M
    }

    /// Initial minus current height of node (i, j) in units, > 0 below the initial surface.
    #[inline]
    pub fn sinkage_units(&self, i: i32, j: i32) -> i32 {
        let (i, j) = self.lattice.clamp(i, j);
        let (tile, k) = self.lattice.locate(i, j);
        match self.tiles[tile].sinkage {
            UNTOUCHED => 0,
            slot => self.pool.value(slot, k),
        }
    }

    /// Height of node (i, j) at the start in units.
    #[inline]
    pub fn initial_units(&self, i: i32, j: i32) -> i32 {
        self.units(i, j) + self.sinkage_units(i, j)
    }

    /// Adds `change` units to node (i, j), which must be a node of the lattice (others are left alone).
    #[inline]
    pub fn add_units(&mut self, i: i32, j: i32, change: i32) {
        if change == 0 || !self.lattice.has(i, j) {
            return;
        }
        let (tile, k) = self.lattice.locate(i as u32, j as u32);
        self.add_units_at(tile, k, change);
    }

    /// Adds `change` units to node k of a tile; its new height in units.
    #[inline]
    pub fn add_units_at(&mut self, tile: usize, k: usize, change: i32) -> i32 {
        let (heights, sinkage) = self.touch(tile);
        self.pool.tile_mut(sinkage)[k] -= change;
        let height = &mut self.pool.tile_mut(heights)[k];
        *height += change;
        *height
    }

    /// Puts node (i, j) at `units`.
    #[inline]
    pub fn set_units(&mut self, i: i32, j: i32, units: i32) {
        self.add_units(i, j, units - self.units(i, j));
    }

    /// Puts the nodes `first` … of a tile, all in one row, at the heights `new` (units); `changes` receives the gain
    /// of each. False when none changed: then the tile stays untouched.
    #[inline]
    pub fn write_row(&mut self, tile: usize, first: usize, new: &[i32], changes: &mut [i32]) -> bool {
        let range = first..first + new.len();
        match self.tiles[tile].heights {
            Heights::Uniform(u) => new.iter().zip(&mut *changes).for_each(|(n, c)| *c = n.wrapping_sub(u)),
            Heights::Stored(slot) => {
                let old = &self.pool.tile(slot)[range.clone()];
                new.iter().zip(old).zip(&mut *changes).for_each(|((n, o), c)| *c = n.wrapping_sub(*o));
            }
        }
        if changes[..new.len()].iter().all(|c| *c == 0) {
            return false;
        }
        let (heights, sinkage) = self.touch(tile);
        self.pool.tile_mut(heights)[range.clone()].copy_from_slice(new);
        let sunk = &mut self.pool.tile_mut(sinkage)[range];
        sunk.iter_mut().zip(&*changes).for_each(|(s, c)| *s = s.wrapping_sub(*c));
        true
    }

    /// Makes a tile ready for writing: (pool tile of heights, pool tile of sinkage).
    #[inline]
    pub(crate) fn touch(&mut self, tile: usize) -> (u32, u32) {
        self.writes += 1;
        let t = &mut self.tiles[tile];
        t.generation = self.writes;
        if t.sinkage == UNTOUCHED {
            t.sinkage = self.pool.take();
            self.pool.tile_mut(t.sinkage).fill(0);
            self.touched.push(tile as u32);
        }
        let heights = match t.heights {
            Heights::Stored(slot) => slot,
            Heights::Uniform(u) => {
                let slot = self.pool.take();
                self.pool.tile_mut(slot).fill(u);
                t.heights = Heights::Stored(slot);
                slot
            }
        };
        (heights, t.sinkage)
    }

    /// The 32 × 32 heights of a tile in units, x fastest; `Err` with the height that all nodes share.
    ///
    /// # Errors
    /// The height that all nodes share: nothing is stored for such a tile.
    #[inline]
    pub fn tile(&self, tile: usize) -> Result<&[i32], i32> {
        match self.tiles[tile].heights {
            Heights::Uniform(u) => Err(u),
            Heights::Stored(slot) => Ok(self.pool.tile(slot)),
        }
    }

    /// New with every write to the tile; equal numbers mean equal contents.
    #[inline]
    pub fn generation(&self, tile: usize) -> u64 {
        self.tiles[tile].generation
    }

    /// Numbers of the tiles that were ever written, in the order of their first write.
    pub fn touched(&self) -> &[u32] {
        &self.touched
    }

    /// Sum of the heights of all nodes in units: volume / (spacing²·[`UNIT_M`]), exact.
    pub fn total_units(&self) -> i64 {
        (0..self.tiles.len()).map(|tile| self.tile_sum(tile)).sum()
    }

    fn tile_sum(&self, tile: usize) -> i64 {
        let (_, [nx, ny]) = self.lattice.tile_nodes(tile);
        match self.tile(tile) {
            Err(u) => i64::from(u) * i64::from(nx) * i64::from(ny),
            Ok(units) => rows(units, nx, ny).map(|u| i64::from(*u)).sum(),
        }
    }

    /// Units gained since the start over all nodes, exact; 0 as long as material is only moved. Looks at
    /// touched tiles only.
    pub fn gained_units(&self) -> i64 {
        let gained = |tile: &u32| -> i64 {
            let (_, [nx, ny]) = self.lattice.tile_nodes(*tile as usize);
            let sinkage = self.pool.tile(self.tiles[*tile as usize].sinkage);
            rows(sinkage, nx, ny).map(|s| -i64::from(*s)).sum()
        };
        self.touched.iter().map(gained).sum()
    }

    /// Lowest and highest node, units.
    pub fn bounds(&self) -> (i32, i32) {
        let of = |tile: usize| {
            let (_, [nx, ny]) = self.lattice.tile_nodes(tile);
            match self.tile(tile) {
                Err(u) => (u, u),
                Ok(units) => {
                    rows(units, nx, ny).fold((i32::MAX, i32::MIN), |(a, b), u| (a.min(*u), b.max(*u)))
                }
            }
        };
        (0..self.tiles.len()).map(of).fold((i32::MAX, i32::MIN), |(a, b), (c, d)| (a.min(c), b.max(d)))
    }

    /// Describes the field `height`.
    pub fn height_info(&self) -> FieldInfo {
        self.lattice.field_info("height", "m")
    }

    /// Describes the field `sinkage`: initial minus current height, > 0 downwards.
    pub fn sinkage_info(&self) -> FieldInfo {
        self.lattice.field_info("sinkage", "m")
    }

    /// Tile (a, b) of the field `height`.
    pub fn height_tile(&self, a: u32, b: u32) -> FieldTile<'_> {
        let tile = (b * self.lattice.tiles()[0] + a) as usize;
        let values = match self.tile(tile) {
            Ok(data) => TileValues::Fixed { data, unit: UNIT_M },
            Err(u) => TileValues::Uniform(f64::from(u) * UNIT_M),
        };
        FieldTile { generation: self.tiles[tile].generation, values }
    }

    /// Tile (a, b) of the field `sinkage`.
    pub fn sinkage_tile(&self, a: u32, b: u32) -> FieldTile<'_> {
        let tile = &self.tiles[(b * self.lattice.tiles()[0] + a) as usize];
        let values = match tile.sinkage {
            UNTOUCHED => TileValues::Uniform(0.0),
            slot => TileValues::Fixed { data: self.pool.tile(slot), unit: UNIT_M },
        };
        FieldTile { generation: tile.generation, values }
    }

    /// Undoes all writes to a tile; the caller takes it out of the list of touched ones.
    pub(crate) fn revert(&mut self, tile: usize) {
        let (heights, sinkage) = self.touch(tile);
        for k in 0..TILE_NODES {
            let sunk = std::mem::take(&mut self.pool.tile_mut(sinkage)[k]);
            self.pool.tile_mut(heights)[k] += sunk;
        }
        self.pool.release(sinkage);
        self.tiles[tile].sinkage = UNTOUCHED;
    }

    /// Moves a tile to where its nodes have sunk by `sunk` units since the start.
    pub(crate) fn put_sinkage(&mut self, tile: usize, sunk: &[i32]) {
        let (heights, sinkage) = self.touch(tile);
        for (k, sunk) in sunk.iter().enumerate() {
            let before = std::mem::replace(&mut self.pool.tile_mut(sinkage)[k], *sunk);
            self.pool.tile_mut(heights)[k] += before - sunk;
        }
    }
}

impl Surface for HeightField {
    #[inline]
    fn lattice(&self) -> &Lattice {
        &self.lattice
    }
    #[inline]
    fn height(&self, i: i32, j: i32) -> f64 {
        Self::height(self, i, j)
    }
    fn heights(&self, i: i32, j: i32, out: &mut [f64]) {
        let edge = TILE_EDGE as usize;
        let (mut i, mut rest) = (i, out);
        while !rest.is_empty() {
            if !self.lattice.has(i, j) {
                let (now, later) = rest.split_at_mut(1);
                now[0] = Self::height(self, i, j);
                (i, rest) = (i + 1, later);
                continue;
            }
            let (tile, first) = self.lattice.locate(i as u32, j as u32);
            let inside = (self.lattice.size[0] as usize - i as usize).min(edge - first % edge);
            let (now, later) = rest.split_at_mut(inside.min(rest.len()));
            match self.tile(tile) {
                Err(units) => now.fill(f64::from(units) * UNIT_M),
                Ok(units) => {
                    now.iter_mut().zip(&units[first..]).for_each(|(h, u)| *h = f64::from(*u) * UNIT_M);
                }
            }
            (i, rest) = (i + now.len() as i32, later);
        }
    }
}

/// The nodes of a tile that lie inside the lattice.
fn rows(values: &[i32], nx: u32, ny: u32) -> impl Iterator<Item = &i32> {
    values.chunks_exact(TILE_EDGE as usize).take(ny as usize).flat_map(move |row| &row[..nx as usize])
}

fn check(lattice: &Lattice) -> Result<(), HeightError> {
    let positive = lattice.spacing > 0.0 && lattice.spacing.is_finite();
    if positive && lattice.node_count() > 0 { Ok(()) } else { Err(HeightError::Empty) }
}

fn to_units(height: f64, node: [u32; 2]) -> Result<i32, HeightError> {
    // `<=` also refuses NaN.
    if height.abs() <= LIMIT_M {
        Ok((height / UNIT_M).round() as i32)
    } else {
        Err(HeightError::OutOfRange { node, height })
    }
}
