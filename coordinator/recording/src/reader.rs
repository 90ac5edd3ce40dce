//! Reads a recording, also one that was cut off or damaged in the middle: whatever arrived whole is there.

use crate::columns::{About, Columns};
use crate::gluing_message::StepMessage;
use crate::layout::{RECORDING, at};
use crate::messages::GluingRecord;
use crate::point_cloud;
use crate::records::{Piece, Records};
use crate::solids::{self, Solid};
use crate::table::Table;
use crate::topics::{COLUMNS, STREAM, SUBSYSTEM};
use foxglove::messages::{FrameTransforms, Grid, Log, PointCloud, SceneEntity, SceneUpdate};
use prost::Message;
use std::collections::BTreeMap;
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_engine::observer::Event;

/// Everything in a recording.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Description of the simulation.
    pub header: Header,
    /// Variables by subsystem.
    pub variables: BTreeMap<String, Table>,
    /// Units by subsystem and variable.
    pub units: BTreeMap<String, BTreeMap<String, String>>,
    /// Poses by frame, e.g. `robot/body`.
    pub poses: BTreeMap<String, PoseSeries>,
    /// The first frame of the recording.
    pub first_frame: Option<String>,
    /// Shapes of every body in its frame, by frame.
    pub solids: BTreeMap<String, Vec<Solid>>,
    /// The same shapes as they were written, by frame.
    pub(crate) entities: BTreeMap<String, SceneEntity>,
    /// Length of a force in what is recorded for viewers, m/N.
    pub(crate) metres_per_newton: Option<f64>,
    /// How the steps were glued.
    pub gluing: Vec<GluingRecord>,
    /// Energies, J: `kinetic`, …, and `<subsystem>.kinetic`, ….
    pub energy: Table,
    /// Events of the run.
    pub events: Vec<Event>,
    /// The ground at the start.
    pub initial_ground: Option<GroundRecord>,
    /// The ground at the end, or where the recording ends.
    pub final_ground: Option<GroundRecord>,
    /// Its changes in between.
    pub(crate) ground_changes: Vec<GroundChange>,
    /// Matches of local tree maps with global ones, by stream.
    pub(crate) tree_matches: BTreeMap<String, Vec<TreeMatch>>,
    /// Whether the file has its footer; otherwise it was cut off.
    pub complete: bool,
    /// Parts that are damaged and left out.
    pub damaged: usize,
    /// Whether it is in the JSON of earlier versions, which is no longer read.
    pub outdated: bool,
}

/// The columns of a channel.
struct Source {
    subsystem: String,
    columns: Columns,
    /// Places of the columns in their subsystem.
    places: Vec<usize>,
    names: Vec<String>,
    values: Vec<f64>,
    /// Whether a message completes a row.
    row: bool,
}

/// Names and last values of all columns of a subsystem.
#[derive(Default)]
struct VariableRow {
    names: Vec<String>,
    values: Vec<f64>,
    /// Columns of the subsystem's table; empty until a row is written after a channel was announced.
    columns: Vec<Option<usize>>,
}

impl VariableRow {
    /// Takes the columns of a channel in.
    fn announce(&mut self, source: &Source) {
        let end = source.places.iter().max().map_or(0, |k| k + 1).max(self.names.len());
        self.names.resize(end, String::new());
        self.values.resize(end, f64::NAN);
        for (place, name) in source.places.iter().zip(&source.names) {
            self.names[*place].clone_from(name);
        }
        self.columns.clear();
    }

    fn take(&mut self, source: &Source) {
        for (place, value) in source.places.iter().zip(&source.values) {
            self.values[*place] = *value;
        }
    }

    /// Appends the values to the table of the subsystem.
    fn write(&mut self, t_s: f64, table: &mut Table) {
        if self.columns.is_empty() {
            self.columns = table.places(&self.names);
        }
        table.push_at(t_s, &self.columns, &self.values);
    }
}

/// State of the reader between messages.
#[derive(Default)]
struct State {
    sources: BTreeMap<u16, Source>,
    rows: BTreeMap<String, VariableRow>,
}

/// Description of the simulation; all texts as in the scenario.
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

/// Schema of the messages that contain a [`TreeMatch`].
const TREE_MATCH: &str = "terraglue.TreeMatch";

/// A local tree map on a global one, in the frame of the latter.
#[derive(Clone, Debug, Default, PartialEq, serde::Deserialize)]
#[serde(default)]
pub(crate) struct TreeMatch {
    /// Pose of the machine: x, y, m, and yaw, rad.
    pub pose: Option<[f64; 3]>,
    /// Half axes of one deviation, m, and the direction of the longer one, rad.
    pub ellipse: [f64; 3],
    /// Trees of the local map, m.
    pub local: Vec<[f64; 2]>,
    /// Trees of the global map around, m.
    pub global: Vec<[f64; 2]>,
    /// Local trees that were matched, and their partners, m.
    pub match_from: Vec<[f64; 2]>,
    /// See there.
    pub match_to: Vec<[f64; 2]>,
}

/// Nodes that got another height.
#[derive(Clone, Debug, Default)]
pub(crate) struct GroundChange {
    /// Simulated time, s.
    pub t_s: f64,
    /// Number of the node, its height before and after, m.
    pub nodes: Vec<(u32, f32, f32)>,
}

impl GroundRecord {
    /// Puts the nodes of a tile in; returns the changes.
    fn patch(&mut self, cloud: &PointCloud, t_s: f64) -> GroundChange {
        let mut nodes = Vec::new();
        for ([x, y, z], sinkage) in point_cloud::unpack(cloud) {
            let i = ((x - self.origin[0]) / self.spacing).round();
            let j = ((y - self.origin[1]) / self.spacing).round();
            let inside = i >= 0.0 && j >= 0.0 && i < self.size[0] as f64 && j < self.size[1] as f64;
            let node = j.max(0.0) as usize * self.size[0] + i.max(0.0) as usize;
            if let (true, Some(height)) = (inside, self.height.get_mut(node)) {
                let before = std::mem::replace(height, z as f32);
                self.sinkage[node] = sinkage;
                if before != *height {
                    nodes.push((node as u32, before, *height));
                }
            }
        }
        self.t_s = t_s;
        GroundChange { t_s, nodes }
    }
}

/// A message of `/ground`; none where it is damaged.
pub fn ground_grid(data: &[u8]) -> Option<GroundRecord> {
    ground(data, 0.0)
}

/// Places (x, y, z, m) and sinkages (m) of the nodes in a message of a tile of ground, `/ground/<i>_<j>`; none where it is damaged.
pub fn ground_cloud(data: &[u8]) -> Option<Vec<([f64; 3], f32)>> {
    PointCloud::decode(data).ok().map(|cloud| point_cloud::unpack(&cloud))
}

fn ground(data: &[u8], t_s: f64) -> Option<GroundRecord> {
    let grid = Grid::decode(data).ok()?;
    let field = |offset: usize| {
        let node = |cell: &[u8]| cell[offset..offset + 4].try_into().map_or(f32::NAN, f32::from_le_bytes);
        grid.data.chunks_exact(8).map(node).collect::<Vec<f32>>()
    };
    let (spacing, corner) = (grid.cell_size?.x, grid.pose?.position?);
    let columns = grid.column_count as usize;
    let size = [columns, (grid.data.len() / 8).checked_div(columns)?];
    let origin = [corner.x, corner.y].map(|c| c + 0.5 * spacing);
    Some(GroundRecord { t_s, origin, spacing, size, height: field(0), sinkage: field(4) })
}

impl Recording {
    /// The first record after a step: in the one before it forces are unknown, not 0 N.
    pub fn first_step(&self) -> usize {
        self.gluing.iter().position(|g| g.evaluations_bodies > 0).unwrap_or(0)
    }

    /// Reads `recording.mcap` of a results folder.
    ///
    /// # Errors
    /// [`Error::File`]: there is no recording, or it cannot be read.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(RECORDING);
        let bytes = terraglue_subsystem::files::read(&path).map_err(at(&path))?;
        let unreadable = |what: &str| Error::File {
            path: path.display().to_string(),
            source: std::io::Error::new(std::io::ErrorKind::InvalidData, what),
        };
        match Self::read(&bytes) {
            None => Err(unreadable("is not an MCAP recording")),
            Some(r) if r.outdated => Err(unreadable(
                "was written by an earlier version of terraglue, or by another program; run the scenario again",
            )),
            Some(r) => Ok(r),
        }
    }

    /// Reads a recording from memory; `None` where it does not even begin like one.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let mut records = Records::new(bytes)?;
        let mut recording = Self { complete: mcap::read::footer(bytes).is_ok(), ..Self::default() };
        let mut state = State::default();
        for piece in &mut records {
            match piece {
                Piece::Message(message) => recording.take(&message, &mut state),
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

    fn take(&mut self, message: &mcap::Message, state: &mut State) {
        // Divided, not multiplied by 1e-9: 5 ms are 0.005 s to the bit.
        let t_s = message.log_time as f64 / 1e9;
        let data = &message.data[..];
        // messages in an encoding of a module's own contain nothing about the run
        if let Some(stream) = message.channel.metadata.get(STREAM) {
            let schema = message.channel.schema.as_ref().map(|s| s.name.as_str());
            if schema == Some(TREE_MATCH)
                && let Ok(told) = serde_json::from_slice(data)
            {
                self.tree_matches.entry(stream.clone()).or_default().push(told);
            }
            return;
        }
        self.outdated |= message.channel.message_encoding == "json";
        // A message that does not parse is left out.
        match message.channel.topic.as_str() {
            "/tf" => self.take_transforms(data, t_s),
            "/ground" => self.take_ground(data, t_s),
            "/gluing" => self.gluing.extend(StepMessage::decode(data).ok().map(GluingRecord::from)),
            "/events" => self.events.extend(Log::decode(data).ok().map(|e| Event { t_s, what: e.message })),
            "/scene" => self.take_scene(data),
            "/contact_forces" if self.metres_per_newton.is_none() => {
                let scale = message.channel.metadata.get("metres_per_newton");
                self.metres_per_newton = scale.and_then(|scale| scale.parse().ok());
            }
            topic if topic.starts_with("/ground/") => self.take_tile(data, t_s),
            _ => self.take_numbers(message, t_s, state),
        }
    }

    fn take_numbers(&mut self, message: &mcap::Message, t_s: f64, state: &mut State) {
        let channel = &message.channel;
        let source = match state.sources.entry(channel.id) {
            std::collections::btree_map::Entry::Occupied(known) => known.into_mut(),
            std::collections::btree_map::Entry::Vacant(new) => {
                let Some(source) = self.announced(channel) else { return };
                if channel.topic != "/energy" {
                    state.rows.entry(source.subsystem.clone()).or_default().announce(&source);
                }
                new.insert(source)
            }
        };
        if source.columns.decode(&message.data, &mut source.values).is_none() {
            return;
        }
        if channel.topic == "/energy" {
            return self.energy.push(t_s, &source.names, &source.values);
        }
        let Some(row) = state.rows.get_mut(&source.subsystem) else { return };
        row.take(source);
        if source.row {
            row.write(t_s, self.variables.entry(source.subsystem.clone()).or_default());
        }
    }

    /// The columns that a channel announces; notes their units.
    fn announced(&mut self, channel: &mcap::Channel) -> Option<Source> {
        let about: Vec<About> = serde_json::from_str(channel.metadata.get(COLUMNS)?).ok()?;
        let columns = Columns::read(&about);
        let subsystem = channel.metadata.get(SUBSYSTEM).cloned().unwrap_or_default();
        let units = self.units.entry(subsystem.clone()).or_default();
        units.extend(about.iter().map(|a| (a.name.clone(), a.unit.clone())));
        Some(Source {
            row: channel.topic == format!("/{subsystem}"),
            subsystem,
            places: about.iter().map(|a| a.index).collect(),
            values: vec![0.0; columns.count],
            names: about.into_iter().map(|a| a.name).collect(),
            columns,
        })
    }

    fn take_transforms(&mut self, data: &[u8], t_s: f64) {
        let Ok(all) = FrameTransforms::decode(data) else { return };
        for t in all.transforms {
            let (Some(p), Some(q)) = (t.translation, t.rotation) else { continue };
            self.first_frame.get_or_insert_with(|| t.child_frame_id.clone());
            let series = self.poses.entry(t.child_frame_id).or_default();
            series.t_s.push(t_s);
            series.position.push([p.x, p.y, p.z]);
            series.orientation.push([q.w, q.x, q.y, q.z]);
        }
    }

    fn take_scene(&mut self, data: &[u8]) {
        let Ok(scene) = SceneUpdate::decode(data) else { return };
        self.solids.extend(scene.entities.iter().map(|e| (e.frame_id.clone(), solids::solids(e))));
        self.entities.extend(scene.entities.into_iter().map(|e| (e.frame_id.clone(), e)));
    }

    fn take_ground(&mut self, data: &[u8], t_s: f64) {
        let record = ground(data, t_s);
        self.initial_ground = self.initial_ground.take().or_else(|| record.clone());
        self.final_ground = record.or_else(|| self.final_ground.take());
    }

    fn take_tile(&mut self, data: &[u8], t_s: f64) {
        // The tiles of the start contain less than the grid that was written with them.
        let Some(ground) = self.final_ground.as_mut().filter(|_| t_s > 0.0) else { return };
        if let Ok(cloud) = PointCloud::decode(data) {
            self.ground_changes.push(ground.patch(&cloud, t_s));
        }
    }

    /// Frame and motion of the reported body: that of the scenario, else the first one.
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

    /// Times at which the ground was recorded, s: the start, and each change.
    pub fn ground_times(&self) -> Vec<f64> {
        let start = self.initial_ground.iter().map(|ground| ground.t_s);
        let mut times: Vec<f64> = start.chain(self.ground_changes.iter().map(|c| c.t_s)).collect();
        times.dedup();
        times
    }

    /// Heights of the whole ground at each of those times with numbers in `range`, m, as [`GroundRecord::height`].
    pub fn grounds(&self, range: std::ops::Range<usize>) -> Vec<Vec<f32>> {
        let times = self.ground_times();
        let Some(start) = &self.initial_ground else { return Vec::new() };
        let mut height = start.height.clone();
        let mut changes = self.ground_changes.iter().peekable();
        let mut all = Vec::new();
        for (k, t_s) in times.iter().enumerate().take(range.end) {
            while let Some(change) = changes.next_if(|change| change.t_s <= *t_s) {
                for (node, _, new) in &change.nodes {
                    height.get_mut(*node as usize).into_iter().for_each(|z| *z = *new);
                }
            }
            if k >= range.start {
                all.push(height.clone());
            }
        }
        all
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
