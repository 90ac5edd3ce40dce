//! A ground as contact detection reads it: the field `height` of a soil, tile by tile, with cached bounds.

use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::math::Vector;
use std::cell::Cell;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_ground::{HeightField, Lattice, Surface, TILE_EDGE};
use terraglue_subsystem::{FieldInfo, FieldTile, Subsystem, Terrain, TileValues};

/// Constants of a ground over a run, and the bounds of its tiles.
pub struct Ground {
    /// Index of the subsystem that owns it.
    pub subsystem: u32,
    pub lattice: Lattice,
    source: Source,
    edge: u32,
    bounds: Vec<Bound>,
}

enum Source {
    /// Number of the field `height`, and of `sinkage` where the soil shows one on the same lattice.
    Field(usize, Option<usize>),
    /// The scenario's terrain, for a soil that shows no heights.
    Fixed(Box<HeightField>),
}

/// Highest node of a tile at a generation.
#[derive(Clone, Copy)]
struct Bound {
    generation: Option<u64>,
    high: f64,
}

impl Ground {
    pub fn new(subsystem: u32, instance: &dyn Subsystem, terrain: Option<&dyn Terrain>) -> Result<Self> {
        let failed = |message: String| Error::Simulation { time_s: 0.0, message };
        let field = instance.fields().iter().enumerate().find(|(_, f)| f.name == "height");
        let (lattice, edge, source) = match (field, terrain) {
            (Some((number, info)), _) => {
                let lattice = Lattice { origin: info.origin, spacing: info.spacing, size: info.size };
                let same = |f: &&FieldInfo| {
                    (f.size, f.origin, f.tile_edge) == (info.size, info.origin, info.tile_edge)
                };
                let sinkage = instance.fields().iter().position(|f| f.name == "sinkage" && same(&f));
                (lattice, info.tile_edge, Source::Field(number, sinkage))
            }
            (None, Some(terrain)) => {
                let field = HeightField::from_terrain(terrain).map_err(|e| failed(e.to_string()))?;
                (*field.lattice(), TILE_EDGE, Source::Fixed(Box::new(field)))
            }
            (None, None) => {
                return Err(failed("a soil shows no field `height` and there is no [terrain]".into()));
            }
        };
        if edge == 0 || lattice.node_count() == 0 || lattice.spacing.is_nan() || lattice.spacing <= 0.0 {
            return Err(failed(format!("the field `height` has no lattice: {lattice:?}, tiles of {edge}")));
        }
        let tiles = lattice.size.map(|n| n.div_ceil(edge) as usize);
        let unknown = Bound { generation: None, high: 0.0 };
        Ok(Self { subsystem, lattice, source, edge, bounds: vec![unknown; tiles[0] * tiles[1]] })
    }

    /// The ground now, and its bounds for updating.
    pub fn read<'a>(&'a mut self, instance: &'a dyn Subsystem) -> (Reader<'a>, Bounds<'a>) {
        let reader = Reader {
            lattice: &self.lattice,
            source: &self.source,
            instance,
            edge: self.edge,
            last: Cell::new(None),
            last_sunk: Cell::new(None),
            recent: Default::default(),
            sunk: Default::default(),
            trouble: Cell::new(None),
        };
        (reader, Bounds { tiles: &mut self.bounds })
    }
}

/// Errors of reading a ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trouble {
    /// The soil refused tile (a, b).
    Tile(u32, u32),
    /// Node (i, j) is not a number.
    Node(u32, u32),
}

impl std::fmt::Display for Trouble {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Tile(a, b) => write!(f, "tile ({a}, {b}) of the field `height` cannot be read"),
            Self::Node(i, j) => write!(f, "the field `height` is not a number at node ({i}, {j})"),
        }
    }
}

/// Number of recently read tiles that are remembered along each axis.
const RECENT: u32 = 4;

/// A tile with its number, or with its first node.
type Recent<'a> = ([u32; 2], FieldTile<'a>);

/// Recently read tiles of one field.
type Shelf<'a> = [Cell<Option<Recent<'a>>>; (RECENT * RECENT) as usize];

/// Reads nodes through the tiles of the last few reads.
pub struct Reader<'a> {
    lattice: &'a Lattice,
    source: &'a Source,
    instance: &'a dyn Subsystem,
    edge: u32,
    last: Cell<Option<Recent<'a>>>,
    last_sunk: Cell<Option<Recent<'a>>>,
    recent: Shelf<'a>,
    sunk: Shelf<'a>,
    trouble: Cell<Option<Trouble>>,
}

impl<'a> Reader<'a> {
    /// The first thing that could not be read.
    pub fn trouble(&self) -> Option<Trouble> {
        self.trouble.get()
    }

    /// The ground as it was at the start.
    pub fn undisturbed(&self) -> Undisturbed<'_, 'a> {
        Undisturbed(self)
    }

    fn tile(&self, a: u32, b: u32) -> Option<FieldTile<'a>> {
        self.recall(&self.recent, a, b, || match self.source {
            Source::Field(field, _) => self.instance.field_tile(*field, a, b).ok(),
            Source::Fixed(field) => Some(field.height_tile(a, b)),
        })
    }

    fn recall(
        &self,
        shelf: &Shelf<'a>,
        a: u32,
        b: u32,
        look: impl FnOnce() -> Option<FieldTile<'a>>,
    ) -> Option<FieldTile<'a>> {
        let slot = &shelf[(b % RECENT * RECENT + a % RECENT) as usize];
        if let Some((at, tile)) = slot.get()
            && at == [a, b]
        {
            return Some(tile);
        }
        let tile = look();
        match tile {
            Some(tile) => slot.set(Some(([a, b], tile))),
            None => self.fail(Trouble::Tile(a, b)),
        }
        tile
    }

    fn fail(&self, trouble: Trouble) {
        if self.trouble.get().is_none() {
            self.trouble.set(Some(trouble));
        }
    }

    #[inline]
    fn checked(&self, height: f64, i: u32, j: u32) -> f64 {
        if height.is_finite() {
            return height;
        }
        self.fail(Trouble::Node(i, j));
        0.0
    }

    /// Highest node of a range (inclusive) inside one tile; what is above `enough` ends the search.
    fn highest(&self, i: (u32, u32), j: (u32, u32), enough: f64) -> f64 {
        let (mut high, mut row) = (f64::NEG_INFINITY, [0.0; ROW]);
        for j in j.0..=j.1 {
            for first in (i.0..=i.1).step_by(ROW) {
                let row = &mut row[..ROW.min((i.1 - first + 1) as usize)];
                self.heights(first as i32, j as i32, row);
                high = highest_of(row).max(high);
            }
            if high > enough {
                return high;
            }
        }
        high
    }

    /// Calls `part` for the parts of the row (i, j), (i + 1, j) … of `out` that lie in one tile each: the tile's number, its
    /// first node of the part, and the part. Nodes outside the lattice are left to `one`.
    fn each_part(
        &self,
        (mut i, j): (i32, i32),
        mut out: &mut [f64],
        one: impl Fn(i32) -> f64,
        mut part: impl FnMut([u32; 2], usize, &mut [f64]),
    ) {
        let edge = self.edge;
        while !out.is_empty() {
            let inside = self.lattice.has(i, j);
            let (a, b) = (i as u32 / edge, j as u32 / edge);
            let end = if inside { ((a + 1) * edge).min(self.lattice.size[0]) - i as u32 } else { 1 };
            let (now, later) = out.split_at_mut(out.len().min(end as usize));
            if inside {
                part([a, b], ((j as u32 - b * edge) * edge + i as u32 - a * edge) as usize, now);
            } else {
                now[0] = one(i);
            }
            (i, out) = (i + now.len() as i32, later);
        }
    }
}

/// Nodes that are read at once.
const ROW: usize = 32;

/// The largest of some numbers, in four that need not wait for each other.
fn highest_of(row: &[f64]) -> f64 {
    let mut most = [f64::NEG_INFINITY; 4];
    let larger = |m: &mut f64, x: f64| *m = if x > *m { x } else { *m };
    let parts = row.chunks_exact(4);
    let rest = parts.remainder();
    rest.iter().for_each(|x| larger(&mut most[0], *x));
    parts.for_each(|part| most.iter_mut().zip(part).for_each(|(m, x)| larger(m, *x)));
    most.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Values number `first` … of a tile.
fn copy_row(values: &TileValues, first: usize, out: &mut [f64]) {
    let range = first..first + out.len();
    match values {
        TileValues::Uniform(v) => out.fill(*v),
        TileValues::F64(data) => out.copy_from_slice(&data[range]),
        TileValues::F32(data) => out.iter_mut().zip(&data[range]).for_each(|(o, d)| *o = f64::from(*d)),
        TileValues::Fixed { data, unit } => {
            out.iter_mut().zip(&data[range]).for_each(|(o, d)| *o = f64::from(*d) * unit);
        }
    }
}

impl Surface for Reader<'_> {
    fn lattice(&self) -> &Lattice {
        self.lattice
    }

    #[inline]
    fn height(&self, i: i32, j: i32) -> f64 {
        let (i, j) = self.lattice.clamp(i, j);
        // Most reads stay in the tile of the one before: no division.
        if let Some(([i0, j0], tile)) = self.last.get() {
            let (a, b) = (i.wrapping_sub(i0), j.wrapping_sub(j0));
            if a < self.edge && b < self.edge {
                return self.checked(tile.values.at((b * self.edge + a) as usize), i, j);
            }
        }
        let (a, b) = (i / self.edge, j / self.edge);
        let Some(tile) = self.tile(a, b) else { return 0.0 };
        let first = [a * self.edge, b * self.edge];
        self.last.set(Some((first, tile)));
        self.checked(tile.values.at(((j - first[1]) * self.edge + i - first[0]) as usize), i, j)
    }

    fn heights(&self, i: i32, j: i32, out: &mut [f64]) {
        self.each_part(
            (i, j),
            out,
            |i| self.height(i, j),
            |[a, b], first, part| {
                let Some(tile) = self.tile(a, b) else { return part.fill(0.0) };
                copy_row(&tile.values, first, part);
                let i = a * self.edge + first as u32 % self.edge;
                for (i, height) in (i..).zip(part).filter(|(_, height)| !height.is_finite()) {
                    *height = self.checked(*height, i, j as u32);
                }
            },
        );
    }
}

/// The ground before anything pressed it: current height plus sinkage, where the soil shows its sinkage.
///
/// Its slope gives the normal of a patch. The slope of the print that the foot itself is making would feed back
/// on the direction of its own force.
pub struct Undisturbed<'r, 'a>(&'r Reader<'a>);

impl Surface for Undisturbed<'_, '_> {
    fn lattice(&self) -> &Lattice {
        self.0.lattice
    }

    #[inline]
    fn height(&self, i: i32, j: i32) -> f64 {
        self.0.height(i, j) + self.sunk(i, j)
    }

    fn heights(&self, i: i32, j: i32, out: &mut [f64]) {
        let mut now = [0.0; ROW];
        for (i, out) in (i..).step_by(ROW).zip(out.chunks_mut(ROW)) {
            let now = &mut now[..out.len()];
            self.0.heights(i, j, now);
            self.raise((i, j), now, out);
        }
    }
}

impl<'a> Undisturbed<'_, 'a> {
    /// Tile (a, b) of the field `sinkage`; none where the soil shows none.
    fn tile(&self, [a, b]: [u32; 2]) -> Option<FieldTile<'a>> {
        let reader = self.0;
        let Source::Field(_, Some(field)) = reader.source else { return None };
        reader.recall(&reader.sunk, a, b, || reader.instance.field_tile(*field, a, b).ok())
    }

    /// Sinkage of node (i, j), m.
    fn sunk(&self, i: i32, j: i32) -> f64 {
        let (reader, edge) = (self.0, self.0.edge);
        let (i, j) = reader.lattice.clamp(i, j);
        if let Some(([i0, j0], tile)) = reader.last_sunk.get() {
            let (a, b) = (i.wrapping_sub(i0), j.wrapping_sub(j0));
            if a < edge && b < edge {
                return tile.values.at((b * edge + a) as usize);
            }
        }
        let Some(tile) = self.tile([i / edge, j / edge]) else { return 0.0 };
        let first = [i - i % edge, j - j % edge];
        reader.last_sunk.set(Some((first, tile)));
        tile.values.at(((j - first[1]) * edge + i - first[0]) as usize)
    }

    /// Heights of a row as they are `now` and were before; no longer than [`ROW`].
    fn raise(&self, (i, j): (i32, i32), now: &[f64], out: &mut [f64]) {
        self.0.each_part(
            (i, j),
            out,
            |i| self.sunk(i, j),
            |at, first, part| match self.tile(at) {
                Some(tile) => copy_row(&tile.values, first, part),
                None => part.fill(0.0),
            },
        );
        out.iter_mut().zip(now).for_each(|(out, now)| *out += *now);
    }
}

/// The ground where it is higher: now, or before anything pressed it.
///
/// A node that a body has pressed below itself still belongs to the cut that the body stands in: the size of a contact is
/// that of the cut, not of the part that carries load in this step.
pub struct Cut<'r, 'a>(pub &'r Reader<'a>);

impl Surface for Cut<'_, '_> {
    fn lattice(&self) -> &Lattice {
        self.0.lattice
    }

    #[inline]
    fn height(&self, i: i32, j: i32) -> f64 {
        let now = self.0.height(i, j);
        now.max(now + self.0.undisturbed().sunk(i, j))
    }

    fn heights(&self, i: i32, j: i32, out: &mut [f64]) {
        let mut now = [0.0; ROW];
        for (i, out) in (i..).step_by(ROW).zip(out.chunks_mut(ROW)) {
            let now = &mut now[..out.len()];
            self.0.heights(i, j, now);
            self.0.undisturbed().raise((i, j), now, out);
            out.iter_mut().zip(now).for_each(|(out, now)| *out = now.max(*out));
        }
    }
}

/// Bounds of tiles, valid as long as the tile's generation stays.
pub struct Bounds<'a> {
    tiles: &'a mut [Bound],
}

impl Bounds<'_> {
    /// Whether a box in the world (already enlarged by what can move within the step) meets the ground.
    ///
    /// Tiles are boxes from far below up to their highest node. A tile that changed is looked at node by node
    /// where the box covers little of it, and measured anew otherwise.
    pub fn meets(&mut self, ground: &Reader, shape: &Aabb) -> bool {
        let lattice = ground.lattice;
        let (i0, i1) = lattice.cell_range(0, shape.mins.x, shape.maxs.x);
        let (j0, j1) = lattice.cell_range(1, shape.mins.y, shape.maxs.y);
        if i0 > i1 || j0 > j1 {
            return false;
        }
        let edge = ground.edge;
        let (i0, i1, j0, j1) = (i0 as u32, i1 as u32, j0 as u32, j1 as u32);
        for b in j0 / edge..=j1 / edge {
            for a in i0 / edge..=i1 / edge {
                let i = (i0.max(a * edge), i1.min(a * edge + edge - 1));
                let j = (j0.max(b * edge), j1.min(b * edge + edge - 1));
                let high = self.highest(ground, [a, b], i, j, shape.mins.z);
                let top = Aabb::new(
                    Vector::new(shape.mins.x, shape.mins.y, f64::MIN),
                    Vector::new(shape.maxs.x, shape.maxs.y, high),
                );
                if top.intersects(shape) {
                    return true;
                }
            }
        }
        false
    }

    /// At least the height of the highest node of a range inside tile (a, b).
    fn highest(
        &mut self,
        ground: &Reader,
        [a, b]: [u32; 2],
        i: (u32, u32),
        j: (u32, u32),
        enough: f64,
    ) -> f64 {
        let edge = ground.edge;
        let generation = ground.tile(a, b).map(|t| t.generation);
        let bound = &mut self.tiles[(b * ground.lattice.size[0].div_ceil(edge) + a) as usize];
        if generation.is_some() && bound.generation == generation {
            return bound.high;
        }
        let asked = (i.1 - i.0 + 1) * (j.1 - j.0 + 1);
        if 4 * asked < edge * edge {
            return ground.highest(i, j, enough);
        }
        let last = |k: usize, t: u32| (t * edge + edge - 1).min(ground.lattice.size[k] - 1);
        let high = ground.highest((a * edge, last(0, a)), (b * edge, last(1, b)), f64::INFINITY);
        *bound = Bound { generation, high };
        high
    }
}
