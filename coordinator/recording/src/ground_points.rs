//! The ground as point clouds, one topic per tile: a viewer keeps the last message of each topic, so relief and old
//! prints stay when only one tile is written anew.

use crate::ground_grid::{GroundGrid, Rectangle};
use crate::point_cloud::Points;
use foxglove::messages::PointCloud;
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::SubsystemView;
use terraglue_page::colour_map::Palette;
use terraglue_subsystem::{FieldInfo, Pose};

/// No more tiles than viewers list well.
const MOST_TILES: u32 = 256;
/// No more points of a whole ground than viewers draw well; a larger one is drawn by every second, third, … node.
const MOST_POINTS: u64 = 1_000_000;
/// Sinkage of the darkest colour, in spacings of the lattice.
const DEEPEST: f64 = 5.0;
/// Steps of the colours.
const SHADES: usize = 65;

/// How the lattice is cut into tiles.
pub(crate) struct GroundPoints {
    info: FieldInfo,
    /// Nodes along the edge of a tile.
    edge: u32,
    /// Every how many nodes one is drawn.
    stride: u32,
    /// Tiles along x.
    columns: u32,
    /// Heights are rounded to this, m: what is drawn needs no more, and equal numbers take no room.
    step: f64,
    colours: Vec<[u8; 3]>,
}

impl GroundPoints {
    /// Tiles of whole tiles of the soil.
    pub fn new(info: &FieldInfo) -> Self {
        let tiles = |edge: u32| info.size.map(|n| n.div_ceil(edge));
        let too_many = |edge: u32| tiles(edge).map(u64::from).iter().product::<u64>() > u64::from(MOST_TILES);
        let mut edge = info.tile_edge.max(1);
        while too_many(edge) && edge < u32::MAX / 2 {
            edge *= 2;
        }
        let nodes = u64::from(info.size[0]) * u64::from(info.size[1]);
        let stride =
            (1..).find(|n: &u32| nodes / (u64::from(*n) * u64::from(*n)) <= MOST_POINTS).unwrap_or(1);
        let step = libm::exp2(libm::floor(libm::log2(info.spacing / 64.0)));
        let share = |k: usize| (k as f64 / (SHADES - 1) as f64) * 2.0 - 1.0;
        let palette = Palette::default();
        let colours = (0..SHADES).map(|k| palette.to_rgb(palette.colour(share(k)))).collect();
        Self { info: info.clone(), edge, stride, columns: tiles(edge)[0], step, colours }
    }

    /// Number of tiles.
    pub fn count(&self) -> usize {
        (self.columns * self.info.size[1].div_ceil(self.edge)) as usize
    }

    /// Topic of a tile: its place along x and y.
    pub fn topic(&self, tile: usize) -> String {
        let tile = tile as u32;
        format!("/ground/{}_{}", tile % self.columns, tile / self.columns)
    }

    /// The tile in which a tile of the soil lies.
    pub fn tile_of(&self, soil_tile: Rectangle) -> usize {
        (soil_tile.j0 / self.edge * self.columns + soil_tile.i0 / self.edge) as usize
    }

    fn rectangle(&self, tile: usize) -> Rectangle {
        let (a, b) = (tile as u32 % self.columns, tile as u32 / self.columns);
        let end = |k: u32, n: u32| (k + 1).saturating_mul(self.edge).min(n);
        Rectangle {
            i0: a * self.edge,
            j0: b * self.edge,
            i1: end(a, self.info.size[0]),
            j1: end(b, self.info.size[1]),
        }
    }

    fn colour(&self, sinkage: f32) -> [u8; 3] {
        let share = (f64::from(sinkage) / (DEEPEST * self.info.spacing)).clamp(-1.0, 1.0);
        self.colours[nearest(0.5 * (share + 1.0) * (SHADES - 1) as f64) as usize]
    }

    fn rounded(&self, z: f32) -> f32 {
        (nearest(f64::from(z) / self.step) * self.step) as f32
    }

    /// The cloud of a tile; none where all points are as they were when `drawn` was made, which says what was drawn
    /// last. `packed` is room for the heights.
    pub fn cloud(
        &self,
        grid: &GroundGrid,
        soil: &SubsystemView,
        (tile, drawn): (usize, &mut u64),
        t_s: f64,
        packed: &mut Vec<u8>,
    ) -> Result<Option<PointCloud>> {
        let r = self.rectangle(tile);
        packed.clear();
        grid.pack(soil, r, t_s, packed)?;
        let sum = self.round(packed);
        if std::mem::replace(drawn, sum) == sum {
            return Ok(None);
        }
        let width = (r.i1 - r.i0) as usize;
        let mut points = Points::with_room("sinkage", packed.len() / 8);
        for (j, row) in (0_u32..).zip(packed.chunks_exact(8 * width)).step_by(self.stride as usize) {
            let y = f64::from(j) * self.info.spacing;
            for (i, node) in (0_u32..).zip(row.chunks_exact(8)).step_by(self.stride as usize) {
                let [z, sinkage] = numbers(node);
                let at = [f64::from(i) * self.info.spacing, y, f64::from(z)];
                points.push(at, self.colour(sinkage), sinkage);
            }
        }
        let corner = |axis: usize, n: u32| self.info.origin[axis] + f64::from(n) * self.info.spacing;
        let pose = Pose { position: [corner(0, r.i0), corner(1, r.j0), 0.0], ..Pose::IDENTITY };
        Ok(Some(points.message(t_s, "world", &pose)))
    }

    /// Rounds heights and sinkages as they are drawn; a number that differs where any of them does.
    fn round(&self, packed: &mut [u8]) -> u64 {
        let mut sum = 0xcbf2_9ce4_8422_2325_u64;
        for node in packed.chunks_exact_mut(8) {
            let [z, sinkage] = numbers(node).map(|x| self.rounded(x).to_le_bytes());
            node[..4].copy_from_slice(&z);
            node[4..].copy_from_slice(&sinkage);
            let bits = u64::from(u32::from_le_bytes(z)) << 32 | u64::from(u32::from_le_bytes(sinkage));
            sum = (sum.rotate_left(23) ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
        // 0 marks a tile that was never drawn
        sum.max(1)
    }
}

/// The nearest whole number, the farther from 0 of two; a call of `round` takes a tenth of the time of a tile.
fn nearest(x: f64) -> f64 {
    (x + 0.5_f64.copysign(x)) as i64 as f64
}

/// Height and sinkage of a packed node.
fn numbers(node: &[u8]) -> [f32; 2] {
    [0, 4].map(|k| node[k..k + 4].try_into().map_or(f32::NAN, f32::from_le_bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_whole_number_is_that_of_round() {
        for k in -4000..4000_i32 {
            let x = f64::from(k as f32 * 0.137_5);
            assert_eq!(nearest(x), x.round(), "{x}");
            assert_eq!(nearest(0.5 * f64::from(k)), (0.5 * f64::from(k)).round());
        }
    }
}
