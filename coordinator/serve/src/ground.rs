//! The ground for the page: heights and sinkages as whole numbers, tile by tile, made of the clouds that the recording holds.
//!
//! A message is zlib of: count of tiles (u32), then of each tile its first node and size (4 × u16) and two layers of u16, heights and
//! sinkages; each number but the first of a row is the difference to the one before, the first of a row that to the first of the row
//! before. All numbers are little-endian. Height = z0 + dz × number; sinkage = dz × the number as i16.

use crate::ground_mesh::{GroundMesh, ground_mesh};
use crate::topics::MESH;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::sync::Arc;
use terraglue_recording::{Stored, ground_cloud, ground_grid};

/// Tiles of the page, nodes along an edge.
const EDGE: usize = 64;
/// Nodes of all triangles, about.
const MESH_NODES: f64 = 60_000.0;
/// Room for the height of what may pile up, in ranges of the heights at the start on either side.
const ROOM: f64 = 0.5;

/// Whether a topic of the recording is a tile of ground.
pub fn is_tile(topic: &str) -> bool {
    topic.strip_prefix("/ground/").is_some_and(|tile| tile != "tiles" && tile.contains('_'))
}

/// The ground.
#[derive(Clone)]
pub struct Ground {
    /// World x, y of the first node, m.
    origin: [f64; 2],
    /// Distance of nodes, m.
    spacing: f64,
    /// Nodes along x and y.
    size: [usize; 2],
    /// Height of number 0, m, and of a step, m.
    z: [f64; 2],
    heights: Vec<u16>,
    sinkages: Vec<i16>,
    /// As they were at the start.
    first: Arc<Vec<u16>>,
    time_ns: u64,
    /// Time of the message that is in, by channel.
    taken: BTreeMap<u16, u64>,
    /// First nodes of rectangles that have changed since triangles were made of them.
    stale: BTreeSet<[usize; 2]>,
}

impl Ground {
    /// Of the first message of `/ground`; none where it is damaged.
    pub fn of(first: &Stored) -> Option<Self> {
        let grid = ground_grid(&first.data)?;
        let finite = grid.height.iter().copied().filter(|z| z.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
            (low.min(f64::from(z)), high.max(f64::from(z)))
        });
        let range = (high - low).max(20.0 * grid.spacing);
        let z0 = low - ROOM * range;
        let dz = (1.0 + 2.0 * ROOM) * range / f64::from(u16::MAX);
        let mut ground = Self {
            origin: grid.origin,
            spacing: grid.spacing,
            size: grid.size,
            z: [z0, dz],
            heights: Vec::new(),
            sinkages: vec![0; grid.height.len()],
            first: Arc::default(),
            time_ns: first.time_ns,
            taken: BTreeMap::new(),
            stale: BTreeSet::new(),
        };
        ground.heights = grid.height.iter().map(|z| ground.number(f64::from(*z))).collect();
        for (to, sinkage) in ground.sinkages.iter_mut().zip(&grid.sinkage) {
            *to = (f64::from(*sinkage) / dz).round() as i16;
        }
        ground.first = Arc::new(ground.heights.clone());
        Some(ground)
    }

    /// Where it lies, for the page.
    pub fn header(&self) -> Value {
        json!({
            "x0": self.origin[0], "y0": self.origin[1], "spacing": self.spacing,
            "nx": self.size[0], "ny": self.size[1], "z0": self.z[0], "dz": self.z[1],
        })
    }

    fn number(&self, z: f64) -> u16 {
        ((z - self.z[0]) / self.z[1]).round() as u16
    }

    /// As it was at the start.
    pub fn begin_again(&mut self) {
        self.heights.clone_from(&self.first);
        self.sinkages.fill(0);
        self.taken.clear();
    }

    /// Puts the cloud of a tile in; the places of its nodes.
    pub fn put(&mut self, tile: &Stored) {
        self.put_nodes(tile);
    }

    /// First and last node of what was put in, along x and y.
    fn put_nodes(&mut self, tile: &Stored) -> Option<[[usize; 2]; 2]> {
        let points = ground_cloud(&tile.data)?;
        // a large ground is drawn by every second, third, … node: each represents its neighbours
        let x = |k: usize| points.get(k).map(|(p, _)| p[0]);
        let step = (x(1)? - x(0)?).abs() / self.spacing;
        let stride = if step.is_finite() { (step.round() as usize).max(1) } else { 1 };
        let mut ends = [[usize::MAX; 2], [0; 2]];
        for ([px, py, pz], sinkage) in &points {
            let node = [(px - self.origin[0]) / self.spacing, (py - self.origin[1]) / self.spacing];
            let [i0, j0] = node.map(|n| n.round().max(0.0) as usize);
            let (z, s) = (self.number(*pz), (f64::from(*sinkage) / self.z[1]).round() as i16);
            for j in j0..(j0 + stride).min(self.size[1]) {
                for i in i0..(i0 + stride).min(self.size[0]) {
                    let k = j * self.size[0] + i;
                    (self.heights[k], self.sinkages[k]) = (z, s);
                    ends[0] = [ends[0][0].min(i), ends[0][1].min(j)];
                    ends[1] = [ends[1][0].max(i), ends[1][1].max(j)];
                }
            }
        }
        self.time_ns = self.time_ns.max(tile.time_ns);
        (ends[0][0] <= ends[1][0]).then_some(ends)
    }

    /// Takes the last messages of all tiles; the message of those that are new, with its time, if any is.
    pub fn take(&mut self, latest: impl Iterator<Item = Arc<Stored>>) -> Option<(u64, Vec<u8>)> {
        let mut changed = Vec::new();
        for tile in latest {
            if self.taken.get(&tile.channel) == Some(&tile.time_ns) {
                continue;
            }
            self.taken.insert(tile.channel, tile.time_ns);
            changed.extend(self.put_nodes(&tile));
        }
        let edge = self.mesh_edge();
        for [[i0, j0], [i1, j1]] in &changed {
            // the rectangle before shares its last nodes with the one that has changed
            let rows = (j0.saturating_sub(1) / edge)..=(j1 / edge);
            let columns = || (i0.saturating_sub(1) / edge)..=(i1 / edge);
            self.stale.extend(rows.flat_map(|j| columns().map(move |i| [i * edge, j * edge])));
        }
        (!changed.is_empty()).then(|| (self.time_ns, self.message(&changed)))
    }

    /// All of it as one message.
    pub fn whole(&self) -> Stored {
        let mut tiles = Vec::new();
        let [nx, ny] = self.size;
        for j in (0..ny).step_by(16 * EDGE) {
            for i in (0..nx).step_by(16 * EDGE) {
                tiles.push([[i, j], [(i + 16 * EDGE).min(nx) - 1, (j + 16 * EDGE).min(ny) - 1]]);
            }
        }
        let data = self.message(&tiles);
        Stored { channel: crate::topics::TILES, sequence: 0, time_ns: self.time_ns, data }
    }

    /// Nodes that triangles leave out between two of theirs, plus one: what other viewers draw is to stay small.
    fn mesh_stride(&self) -> usize {
        let nodes = self.heights.len() as f64;
        ((nodes / MESH_NODES).sqrt().ceil() as usize).max(1)
    }

    /// Nodes along the edge of a rectangle of triangles.
    fn mesh_edge(&self) -> usize {
        EDGE * self.mesh_stride()
    }

    /// Triangles of what has changed since the last time, if anything has.
    pub fn stale_mesh(&mut self) -> Option<Stored> {
        let stale = std::mem::take(&mut self.stale);
        (!stale.is_empty()).then(|| self.mesh(stale.into_iter()))
    }

    /// Triangles that have been sent are those of now.
    pub fn forget_changes(&mut self) {
        self.stale.clear();
    }

    /// Triangles of all of it.
    pub fn whole_mesh(&self) -> Stored {
        let edge = self.mesh_edge();
        let [nx, ny] = self.size;
        let all = (0..ny).step_by(edge).flat_map(|j| (0..nx).step_by(edge).map(move |i| [i, j]));
        self.mesh(all)
    }

    fn mesh(&self, rectangles: impl Iterator<Item = [usize; 2]>) -> Stored {
        let rectangles = rectangles.filter_map(|first| self.rectangle(first)).collect();
        let data = ground_mesh(self.time_ns, rectangles);
        Stored { channel: MESH, sequence: 0, time_ns: self.time_ns, data }
    }

    /// The rectangle that begins at a node; none where that is the last of its row or column.
    fn rectangle(&self, [i0, j0]: [usize; 2]) -> Option<GroundMesh> {
        let (stride, edge) = (self.mesh_stride(), self.mesh_edge());
        let along = |first: usize, count: usize| {
            let last = (first + edge).min(count - 1);
            let mut all: Vec<usize> = (first..last).step_by(stride).collect();
            all.push(last);
            all
        };
        if i0 + 1 >= self.size[0] || j0 + 1 >= self.size[1] {
            return None;
        }
        let (columns, rows) = (along(i0, self.size[0]), along(j0, self.size[1]));
        let nodes: Vec<[usize; 2]> = rows.iter().flat_map(|j| columns.iter().map(|i| [*i, *j])).collect();
        let point = |[i, j]: &[usize; 2]| {
            let z = self.z[0] + self.z[1] * f64::from(self.heights[j * self.size[0] + i]);
            [self.origin[0] + self.spacing * *i as f64, self.origin[1] + self.spacing * *j as f64, z]
        };
        let sinkage = |[i, j]: &[usize; 2]| self.z[1] * f64::from(self.sinkages[j * self.size[0] + i]);
        Some(GroundMesh {
            name: format!("ground_{i0}_{j0}"),
            columns: columns.len(),
            points: nodes.iter().map(point).collect(),
            sinkage: nodes.iter().map(sinkage).collect(),
        })
    }

    /// A message of these rectangles, first and last node of each.
    fn message(&self, tiles: &[[[usize; 2]; 2]]) -> Vec<u8> {
        let mut plain = Vec::new();
        plain.extend((tiles.len() as u32).to_le_bytes());
        for [[i0, j0], [i1, j1]] in tiles {
            let head = [*i0, *j0, i1 + 1 - i0, j1 + 1 - j0];
            head.iter().for_each(|n| plain.extend((*n as u16).to_le_bytes()));
            let rows = || (*j0..=*j1).map(|j| j * self.size[0] + i0..=j * self.size[0] + i1);
            layer(rows().map(|row| self.heights[row].iter().copied()), &mut plain);
            layer(rows().map(|row| self.sinkages[row].iter().map(|s| *s as u16)), &mut plain);
        }
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
        // a vector takes everything
        drop(packed.write_all(&plain));
        packed.finish().unwrap_or_default()
    }
}

/// Appends a layer, row by row, as differences.
fn layer(rows: impl Iterator<Item = impl Iterator<Item = u16>>, out: &mut Vec<u8>) {
    let mut first = 0_u16;
    for row in rows {
        let mut before = first;
        for (k, value) in row.enumerate() {
            out.extend(value.wrapping_sub(before).to_le_bytes());
            before = value;
            if k == 0 {
                first = value;
            }
        }
    }
}
