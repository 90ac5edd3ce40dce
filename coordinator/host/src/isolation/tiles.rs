//! Fields of an isolated soil: the tiles that changed cross after every commit and are read from a copy here.

use super::wire::{Reader, Wire, Writer};
use terraglue_subsystem::{FieldInfo, FieldTile, Subsystem, TileValues};

/// Values of a tile, owned.
#[derive(Clone, Debug)]
enum Owned {
    Uniform(f64),
    F64(Vec<f64>),
    F32(Vec<f32>),
    Fixed(Vec<i32>, f64),
}

/// A copy of a tile.
#[derive(Clone, Debug)]
pub struct Tile {
    generation: u64,
    values: Owned,
}

impl Wire for Tile {
    fn put(&self, w: &mut Writer) {
        w.put(&self.generation);
        match &self.values {
            Owned::Uniform(x) => (w.put(&0_u8), w.put(x)).0,
            Owned::F64(x) => (w.put(&1_u8), w.put(x)).0,
            Owned::F32(x) => (w.put(&2_u8), w.put(x)).0,
            Owned::Fixed(x, unit) => (w.put(&3_u8), w.put(unit), w.put(x)).0,
        }
    }
    fn take(r: &mut Reader) -> Option<Self> {
        let generation = r.take()?;
        let values = match r.take::<u8>()? {
            0 => Owned::Uniform(r.take()?),
            1 => Owned::F64(r.take()?),
            2 => Owned::F32(r.take()?),
            3 => {
                let unit = r.take()?;
                Owned::Fixed(r.take()?, unit)
            }
            _ => return None,
        };
        Some(Self { generation, values })
    }
}

impl Tile {
    /// Of what is borrowed.
    pub fn of(tile: &FieldTile) -> Self {
        let values = match tile.values {
            TileValues::Uniform(x) => Owned::Uniform(x),
            TileValues::F64(x) => Owned::F64(x.to_vec()),
            TileValues::F32(x) => Owned::F32(x.to_vec()),
            TileValues::Fixed { data, unit } => Owned::Fixed(data.to_vec(), unit),
        };
        Self { generation: tile.generation, values }
    }

    /// As the interface wants it.
    pub fn shown(&self) -> FieldTile<'_> {
        let values = match &self.values {
            Owned::Uniform(x) => TileValues::Uniform(*x),
            Owned::F64(x) => TileValues::F64(x),
            Owned::F32(x) => TileValues::F32(x),
            Owned::Fixed(data, unit) => TileValues::Fixed { data, unit: *unit },
        };
        FieldTile { generation: self.generation, values }
    }

    /// Whether it has a value for each node.
    pub fn holds(&self, edge: u32) -> bool {
        let nodes = (edge as usize).saturating_mul(edge as usize);
        match &self.values {
            Owned::Uniform(_) => true,
            Owned::F64(x) => x.len() >= nodes,
            Owned::F32(x) => x.len() >= nodes,
            Owned::Fixed(x, _) => x.len() >= nodes,
        }
    }
}

/// Copies of all tiles of all fields.
#[derive(Debug, Default)]
pub struct Tiles {
    /// Tiles along x, in all, and nodes along an edge, of every field.
    shapes: Vec<(u32, usize, u32)>,
    tiles: Vec<Vec<Option<Tile>>>,
}

impl Tiles {
    /// Room for the tiles of these fields.
    pub fn new(fields: &[FieldInfo]) -> Self {
        let shape = |f: &FieldInfo| {
            let count = f.size.map(|n| n.div_ceil(f.tile_edge.max(1)));
            (count[0], count[0] as usize * count[1] as usize, f.tile_edge)
        };
        let shapes: Vec<_> = fields.iter().map(shape).collect();
        Self { tiles: shapes.iter().map(|s| vec![None; s.1]).collect(), shapes }
    }

    /// In the worker: writes the tiles that are newer than what was sent.
    pub fn send(&mut self, unit: &dyn Subsystem, w: &mut Writer) {
        for (field, ((along, ..), sent)) in self.shapes.iter().zip(&mut self.tiles).enumerate() {
            for (k, sent) in sent.iter_mut().enumerate() {
                let (a, b) = (k as u32 % along, k as u32 / along);
                let Ok(tile) = unit.field_tile(field, a, b) else { continue };
                if sent.as_ref().is_some_and(|s| s.generation == tile.generation) {
                    continue;
                }
                let tile = Tile::of(&tile);
                w.put(&1_u8);
                w.put(&[field as u32, k as u32]);
                w.put(&tile);
                *sent = Some(Tile { generation: tile.generation, values: Owned::Uniform(0.0) });
            }
        }
        w.put(&0_u8);
    }

    /// In the host: takes them.
    pub fn receive(&mut self, r: &mut Reader) -> Option<()> {
        while r.take::<u8>()? != 0 {
            let [field, k]: [u32; 2] = r.take()?;
            let tile: Tile = r.take()?;
            let edge = self.shapes.get(field as usize)?.2;
            let place = self.tiles.get_mut(field as usize)?.get_mut(k as usize)?;
            *place = Some(tile).filter(|t| t.holds(edge));
        }
        Some(())
    }

    /// A tile as it was after the last commit.
    pub fn tile(&self, field: usize, a: u32, b: u32) -> Option<FieldTile<'_>> {
        let (along, ..) = self.shapes.get(field)?;
        let k = (a < *along).then_some(b as usize * *along as usize + a as usize)?;
        self.tiles.get(field)?.get(k)?.as_ref().map(Tile::shown)
    }
}
