//! Reads a recording, also one that was cut off or damaged in the middle: whatever arrived whole is there.

use crate::error::{Error, Result};
use crate::observer::Happening;
use crate::recording::layout::{RECORDING, at};
use crate::recording::messages::GluingRecord;
use crate::recording::records::{Piece, Records};
use crate::recording::solids::{SceneMessage, Solid, Vector};
use crate::recording::table::Table;
use base64::Engine;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Everything in a recording.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// What was simulated.
    pub header: Header,
    /// Variables by subsystem.
    pub variables: BTreeMap<String, Table>,
    /// Units by subsystem and variable.
    pub units: BTreeMap<String, BTreeMap<String, String>>,
    /// Poses by frame, e.g. `robot/body`.
    pub poses: BTreeMap<String, PoseSeries>,
    /// The first frame of the recording.
    pub first_frame: Option<String>,
    /// Radius of the first sphere of every body that has one, by frame, m.
    pub radii: BTreeMap<String, f64>,
    /// Shapes of every body in its frame, by frame.
    pub solids: BTreeMap<String, Vec<Solid>>,
    /// How the steps were glued.
    pub gluing: Vec<GluingRecord>,
    /// Energies, J: `kinetic`, …, and `<subsystem>.kinetic`, ….
    pub energy: Table,
    /// What happened.
    pub events: Vec<Happening>,
    /// The ground at the start.
    pub initial_ground: Option<GroundRecord>,
    /// The ground at the end, or where the recording ends.
    pub final_ground: Option<GroundRecord>,
    /// Whether the file has its footer; otherwise it was cut off.
    pub complete: bool,
    /// Parts that are damaged and left out.
    pub damaged: usize,
}

/// What was simulated; all texts as in the scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// All entries by name.
    pub entries: BTreeMap<String, String>,
}

impl Header {
    /// An entry; empty where it is missing.
    pub fn get(&self, name: &str) -> &str {
        self.entries.get(name).map_or("", String::as_str)
    }

    /// (name, module) of every subsystem.
    pub fn subsystems(&self) -> impl Iterator<Item = (&str, &str)> {
        self.get("subsystems").lines().filter_map(|l| l.split_once('='))
    }
}

/// A body's frame over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseSeries {
    /// Simulated time, s.
    pub t_s: Vec<f64>,
    /// Position in the world, m.
    pub position: Vec<[f64; 3]>,
    /// Unit quaternion w, x, y, z, world from body.
    pub orientation: Vec<[f64; 4]>,
}

/// A rectangle of ground.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroundRecord {
    /// Simulated time, s.
    pub t_s: f64,
    /// World x, y of the first node, m.
    pub origin: [f64; 2],
    /// Distance of neighbouring nodes, m.
    pub spacing: f64,
    /// Nodes along x and y.
    pub size: [usize; 2],
    /// Heights, m, row by row along x.
    pub height: Vec<f32>,
    /// Initial minus current height, m.
    pub sinkage: Vec<f32>,
}

impl GroundRecord {
    /// Puts a smaller rectangle of the same lattice in.
    fn patch(&mut self, patch: &GroundRecord) {
        let node = |axis: usize| ((patch.origin[axis] - self.origin[axis]) / self.spacing).round() as usize;
        let (i0, j0) = (node(0), node(1));
        if i0 + patch.size[0] > self.size[0] || j0 + patch.size[1] > self.size[1] {
            return;
        }
        for j in 0..patch.size[1] {
            let (from, to) = (j * patch.size[0], (j0 + j) * self.size[0] + i0);
            let n = patch.size[0];
            self.height[to..to + n].copy_from_slice(&patch.height[from..from + n]);
            self.sinkage[to..to + n].copy_from_slice(&patch.sinkage[from..from + n]);
        }
        self.t_s = patch.t_s;
    }
}

#[derive(Deserialize)]
struct Transforms {
    transforms: Vec<Transform>,
}

#[derive(Deserialize)]
struct Transform {
    child_frame_id: String,
    translation: Vector,
    rotation: Vector,
}

#[derive(Deserialize)]
struct GridMessage<'a> {
    pose: GridPose,
    column_count: usize,
    cell_size: Vector,
    data: &'a str,
}

#[derive(Deserialize)]
struct GridPose {
    position: Vector,
}

fn ground(data: &[u8], t_s: f64) -> Option<GroundRecord> {
    let grid: GridMessage = serde_json::from_slice(data).ok()?;
    let bytes = base64::engine::general_purpose::STANDARD.decode(grid.data).ok()?;
    let field = |offset: usize| {
        let node = |cell: &[u8]| cell[offset..offset + 4].try_into().map_or(f32::NAN, f32::from_le_bytes);
        bytes.chunks_exact(8).map(node).collect::<Vec<f32>>()
    };
    let spacing = grid.cell_size.x;
    let corner = [grid.pose.position.x, grid.pose.position.y];
    let size = [grid.column_count, (bytes.len() / 8).checked_div(grid.column_count)?];
    let origin = corner.map(|c| c + 0.5 * spacing);
    Some(GroundRecord { t_s, origin, spacing, size, height: field(0), sinkage: field(4) })
}

impl Recording {
    /// Reads `recording.mcap` of a results folder.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(RECORDING);
        let bytes = terraglue_subsystem::files::read(&path).map_err(at(&path))?;
        Self::read(&bytes).ok_or_else(|| Error::File {
            path: path.display().to_string(),
            source: std::io::Error::new(std::io::ErrorKind::InvalidData, "is not an MCAP recording"),
        })
    }

    /// Reads a recording from memory; `None` where it does not even begin like one.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let mut records = Records::new(bytes)?;
        let mut recording = Self { complete: mcap::read::footer(bytes).is_ok(), ..Self::default() };
        for piece in &mut records {
            match piece {
                Piece::Message(message) => recording.take(&message),
                Piece::Metadata(about) if about.name == "terraglue" => {
                    recording.header.entries = about.metadata
                }
                Piece::Metadata(_) => {}
            }
        }
        // With a footer, what ends early is not cut off: a length before it is wrong.
        recording.damaged = records.damaged + usize::from(recording.complete && !records.ended);
        Some(recording)
    }

    fn take(&mut self, message: &mcap::Message) {
        let t_s = message.log_time as f64 * 1e-9;
        let data = &message.data[..];
        match message.channel.topic.as_str() {
            "/tf" => self.take_transforms(data, t_s),
            "/ground" => self.take_ground(data, t_s),
            "/gluing" => self.gluing.extend(serde_json::from_slice::<GluingRecord>(data).ok()),
            "/events" => self.events.extend(serde_json::from_slice::<Happening>(data).ok()),
            // A message that does not parse is left out; the table stays rectangular.
            "/energy" => drop(self.energy.push(data)),
            "/scene" => self.take_scene(data),
            topic => {
                let name = topic.trim_start_matches('/');
                if !self.units.contains_key(name) {
                    self.units.insert(name.into(), units(message));
                }
                drop(self.variables.entry(name.into()).or_default().push(data));
            }
        }
    }

    fn take_transforms(&mut self, data: &[u8], t_s: f64) {
        let Ok(all) = serde_json::from_slice::<Transforms>(data) else { return };
        for t in all.transforms {
            self.first_frame.get_or_insert_with(|| t.child_frame_id.clone());
            let series = self.poses.entry(t.child_frame_id).or_default();
            series.t_s.push(t_s);
            series.position.push([t.translation.x, t.translation.y, t.translation.z]);
            series.orientation.push([t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z]);
        }
    }

    fn take_scene(&mut self, data: &[u8]) {
        let Ok(scene) = serde_json::from_slice::<SceneMessage>(data) else { return };
        let spheres =
            scene.entities.iter().filter_map(|e| Some((e.frame_id.clone(), e.spheres.first()?.size.x / 2.0)));
        self.radii.extend(spheres);
        self.solids.extend(scene.entities.iter().map(|e| (e.frame_id.clone(), e.solids())));
    }

    fn take_ground(&mut self, data: &[u8], t_s: f64) {
        let Some(record) = ground(data, t_s) else { return };
        match &mut self.final_ground {
            None => {
                self.initial_ground = Some(record.clone());
                self.final_ground = Some(record);
            }
            Some(now) => now.patch(&record),
        }
    }

    /// Radius of a body's first sphere, m.
    pub fn radius(&self, subsystem: &str, body: &str) -> Option<f64> {
        self.radii.get(&format!("{subsystem}/{body}")).copied()
    }

    /// Frame and motion of the body that the report speaks of: that of the scenario, else the first one.
    pub fn reported_body(&self) -> Option<(&str, &PoseSeries)> {
        let wanted = self.header.get("report_body").replacen('.', "/", 1);
        let found = self.poses.get_key_value(&wanted);
        let (name, poses) = found.or_else(|| self.poses.get_key_value(self.first_frame.as_ref()?))?;
        Some((name, poses))
    }

    /// Time and values of `subsystem.variable`.
    pub fn series(&self, name: &str) -> Option<(&[f64], &[f64])> {
        let (subsystem, variable) = name.split_once('.')?;
        let table = self.variables.get(subsystem)?;
        Some((&table.t_s, table.column(variable)?))
    }

    /// Unit of `subsystem.variable`; empty for a pure number.
    pub fn unit(&self, name: &str) -> &str {
        name.split_once('.').and_then(|(s, v)| self.units.get(s)?.get(v)).map_or("", String::as_str)
    }

    /// Simulated time of the last message, s.
    pub fn end_s(&self) -> f64 {
        let last = |t: &[f64]| t.last().copied().unwrap_or(0.0);
        let tables = self.variables.values().map(|t| last(&t.t_s));
        let poses = self.poses.values().map(|p| last(&p.t_s));
        tables.chain(poses).chain(self.gluing.last().map(|g| g.t)).fold(last(&self.energy.t_s), f64::max)
    }
}

/// Units from the JSON schema of a channel.
fn units(message: &mcap::Message) -> BTreeMap<String, String> {
    let Some(schema) = &message.channel.schema else { return BTreeMap::new() };
    let Ok(schema) = serde_json::from_slice::<serde_json::Value>(&schema.data) else {
        return BTreeMap::new();
    };
    let Some(properties) = schema["properties"].as_object() else { return BTreeMap::new() };
    let unit = |p: &serde_json::Value| p["unit"].as_str().unwrap_or_default().to_owned();
    properties.iter().map(|(name, p)| (name.clone(), unit(p))).collect()
}
