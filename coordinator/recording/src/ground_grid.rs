//! The ground as a rectangle of numbers: all of it at the start and the end, what has changed in between.

use crate::keep::keep;
use crate::snapshot::failed;
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::{SubsystemView, View};
use terraglue_subsystem::{FieldInfo, FieldTile};

/// Nodes i0 ≤ i < i1, j0 ≤ j < j1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rectangle {
    pub i0: u32,
    pub j0: u32,
    pub i1: u32,
    pub j1: u32,
}

impl Rectangle {
    fn of_tile(info: &FieldInfo, a: u32, b: u32) -> Self {
        let (i0, j0) = (a * info.tile_edge, b * info.tile_edge);
        Self {
            i0,
            j0,
            i1: (i0 + info.tile_edge).min(info.size[0]),
            j1: (j0 + info.tile_edge).min(info.size[1]),
        }
    }
}

// Another process counts generations afresh; `unseen` marks the tiles with changes that were not recorded.
keep!(GroundGrid { initial } parts {} same { subsystem, info, height, sinkage, generations });

/// The fields `height` and `sinkage` of a soil. Where a soil shows no `sinkage`, it is the initial height minus
/// the current one.
pub(crate) struct GroundGrid {
    /// Index of the soil in the view.
    pub subsystem: usize,
    /// Lattice of the height field.
    pub info: FieldInfo,
    height: usize,
    sinkage: Option<usize>,
    initial: Vec<f32>,
    generations: Vec<u64>,
}

impl GroundGrid {
    /// The first subsystem that shows a field `height`. To be called at the start of a run.
    pub fn find(view: &View) -> Result<Option<Self>> {
        for (subsystem, s) in view.subsystems.iter().enumerate() {
            let fields = s.instance.fields();
            let Some(height) = fields.iter().position(|f| f.name == "height") else { continue };
            let info = fields[height].clone();
            if info.size.contains(&0) || info.tile_edge == 0 {
                continue;
            }
            let same = |f: &FieldInfo| f.size == info.size && f.origin == info.origin && f.tile_edge != 0;
            let sinkage = fields.iter().position(|f| f.name == "sinkage" && same(f));
            let tiles = info.size.map(|n| n.div_ceil(info.tile_edge) as usize);
            let generations = vec![u64::MAX; tiles[0] * tiles[1]];
            let mut grid = Self { subsystem, info, height, sinkage, initial: Vec::new(), generations };
            if sinkage.is_none() {
                let mut initial = Vec::new();
                grid.visit(s, height, grid.all(), view.t_s, |_, z| initial.push(z as f32))?;
                grid.initial = initial;
            }
            grid.changed(s, view.t_s)?;
            return Ok(Some(grid));
        }
        Ok(None)
    }

    /// The whole lattice.
    pub fn all(&self) -> Rectangle {
        Rectangle { i0: 0, j0: 0, i1: self.info.size[0], j1: self.info.size[1] }
    }

    /// The tiles of the soil that changed since the last call.
    pub fn changed(&mut self, soil: &SubsystemView, t_s: f64) -> Result<Vec<Rectangle>> {
        let tiles_x = self.info.size[0].div_ceil(self.info.tile_edge);
        let mut changed = Vec::new();
        for (k, seen) in self.generations.iter_mut().enumerate() {
            let (a, b) = (k as u32 % tiles_x, k as u32 / tiles_x);
            let tile = soil.instance.field_tile(self.height, a, b);
            let generation = tile.map_err(|e| failed(soil, t_s, "field_tile", e.to_string()))?.generation;
            if *seen != generation {
                *seen = generation;
                changed.push(Rectangle::of_tile(&self.info, a, b));
            }
        }
        Ok(changed)
    }

    /// The tiles of the soil that changed since the last call of [`GroundGrid::changed`].
    pub fn unseen(&self, soil: &SubsystemView, t_s: f64) -> Result<Vec<bool>> {
        let tiles_x = self.info.size[0].div_ceil(self.info.tile_edge);
        let unseen = |(k, seen): (usize, &u64)| {
            let tile = soil.instance.field_tile(self.height, k as u32 % tiles_x, k as u32 / tiles_x);
            Ok(tile.map_err(|e| failed(soil, t_s, "field_tile", e.to_string()))?.generation != *seen)
        };
        self.generations.iter().enumerate().map(unseen).collect()
    }

    /// Tiles that count as changed whatever they are.
    pub fn forget(&mut self, tiles: &[bool]) {
        let unseen = self.generations.iter_mut().zip(tiles).filter(|(_, unseen)| **unseen);
        unseen.for_each(|(seen, _)| *seen = u64::MAX);
    }

    /// Appends height and sinkage of every node, row by row along x, as little-endian f32.
    pub fn pack(&self, soil: &SubsystemView, r: Rectangle, t_s: f64, out: &mut Vec<u8>) -> Result {
        let first = out.len();
        self.visit(soil, self.height, r, t_s, |_, z| {
            out.extend_from_slice(&(z as f32).to_le_bytes());
            out.extend_from_slice(&[0; 4]);
        })?;
        let mut place = first + 4;
        let mut put = |out: &mut Vec<u8>, value: f32| {
            out[place..place + 4].copy_from_slice(&value.to_le_bytes());
            place += 8;
        };
        match self.sinkage {
            Some(field) => self.visit(soil, field, r, t_s, |_, s| put(out, s as f32)),
            None => self.visit(soil, self.height, r, t_s, |node, z| put(out, self.initial[node] - z as f32)),
        }
    }

    /// Tile (a, b) of the height field.
    pub fn height_tile<'a>(
        &self,
        soil: &SubsystemView<'a>,
        a: u32,
        b: u32,
    ) -> terraglue_subsystem::Result<FieldTile<'a>> {
        soil.instance.field_tile(self.height, a, b)
    }

    /// Largest sinkage of the four nodes around a point, m; 0 outside the lattice.
    pub fn sinkage_at(&self, soil: &SubsystemView, x: f64, y: f64, t_s: f64) -> Result<f64> {
        let i = ((x - self.info.origin[0]) / self.info.spacing).floor();
        let j = ((y - self.info.origin[1]) / self.info.spacing).floor();
        let inside =
            i >= 0.0 && j >= 0.0 && i < f64::from(self.info.size[0]) && j < f64::from(self.info.size[1]);
        if !inside {
            return Ok(0.0);
        }
        let (i0, j0) = (i as u32, j as u32);
        let (i1, j1) = ((i0 + 2).min(self.info.size[0]), (j0 + 2).min(self.info.size[1]));
        let mut largest = 0.0_f64;
        let initial = &self.initial;
        self.visit(
            soil,
            self.sinkage.unwrap_or(self.height),
            Rectangle { i0, j0, i1, j1 },
            t_s,
            |node, value| {
                let sinkage = if initial.is_empty() { value } else { f64::from(initial[node]) - value };
                largest = largest.max(sinkage);
            },
        )?;
        Ok(largest)
    }

    /// Calls `node(index, value)` for every node of a rectangle, x fastest.
    fn visit(
        &self,
        soil: &SubsystemView,
        field: usize,
        r: Rectangle,
        t_s: f64,
        mut node: impl FnMut(usize, f64),
    ) -> Result {
        let edge = soil.instance.fields()[field].tile_edge;
        for j in r.j0..r.j1 {
            let mut i = r.i0;
            while i < r.i1 {
                let end = ((i / edge + 1) * edge).min(r.i1);
                let tile = soil
                    .instance
                    .field_tile(field, i / edge, j / edge)
                    .map_err(|e| failed(soil, t_s, "field_tile", e.to_string()))?;
                for i in i..end {
                    let k = (j % edge) as usize * edge as usize + (i % edge) as usize;
                    node(j as usize * self.info.size[0] as usize + i as usize, tile.values.at(k));
                }
                i = end;
            }
        }
        Ok(())
    }
}
