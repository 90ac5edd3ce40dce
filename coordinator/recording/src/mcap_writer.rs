//! `recording.mcap`: all topics of a run in one append-only file.
//!
//! Equal runs give equal bytes: times are simulated, chunks end by a count of steps, one thread compresses them in their
//! order, and no name of a machine or folder is written. Flushed messages survive `kill -9`.

use crate::columns::{About, Columns};
use crate::force_message::{DRAWN_EVERY_S, Forces};
use crate::ground_grid::{GroundGrid, Rectangle};
use crate::ground_points::GroundPoints;
use crate::joint_message::Joints;
use crate::layout::{RECORDING, at, nanoseconds, other_at, timestamp};
use crate::messages::WindowRecord;
use crate::overlays::{self, Overlays};
use crate::scene_message::{bodies, frame_id, pose, quaternion, scene, vector};
use crate::selection::Precision;
use crate::snapshot::{Snapshot, failed};
use crate::tap::{Tap, TopicInfo};
use crate::topics::{self, Topic};
use crate::visibility::Visibility;
use crate::{energy_message, gluing_message, point_cloud, stream_topics};
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{FrameTransform, FrameTransforms, Grid, Log, PackedElementField, Vector2, log};
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use prost::Message;
use prost::bytes::Bytes;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::error::{Error, Result};
use terraglue_engine::observer::{Event, View};
use terraglue_gluing::StepReport;
use terraglue_host::kept_file::KeptFile;
use terraglue_numerics::rotation;
use terraglue_scenario::Scenario;
use terraglue_subsystem::Pose;

mod resume;
mod sink;
pub(crate) use resume::McapState;
use resume::Pending;
use sink::Sink;

/// A chunk ends every so many steps. When the process is killed, these can be lost and, where the disk is slow, as many before.
pub(crate) const FLUSH_STEPS: u64 = 200;

/// How every recording is laid out, also a mended one.
pub(crate) fn options() -> mcap::WriteOptions {
    mcap::WriteOptions::new()
        .compression(Some(mcap::Compression::Zstd))
        .compression_level(3)
        .compression_threads(0)
        .library("terraglue")
        .disable_seeking(true)
}

/// The variables of a subsystem on their way into the file.
struct Variables {
    channel: u16,
    columns: Columns,
    /// Places of the columns among all of the subsystem.
    places: Vec<usize>,
    /// Which of them are no real numbers.
    whole: Vec<bool>,
    values: Vec<f64>,
    /// Last written values of columns that are written when they change.
    written: Option<Vec<f64>>,
}

impl Variables {
    /// Takes the values from all of the subsystem; false where they are still as written.
    fn take(&mut self, all: &[f64], precision: Precision) -> bool {
        self.values.clear();
        // Whole numbers of up to 2^53 would lose their last places.
        let value = |k: &usize, whole: bool| if whole { all[*k] } else { precision.of(all[*k]) };
        self.values.extend(self.places.iter().zip(&self.whole).map(|(k, whole)| value(k, *whole)));
        let same = |a: &Vec<f64>| a.iter().zip(&self.values).all(|(a, b)| a.to_bits() == b.to_bits());
        !self.written.as_ref().is_some_and(same)
    }
}

/// Numbers of the channels.
#[derive(Default)]
struct Channels {
    tf: u16,
    scene: u16,
    ground: u16,
    tiles: Vec<u16>,
    forces: u16,
    force_points: u16,
    energy: u16,
    gluing: u16,
    events: u16,
    joints: Vec<u16>,
    streams: Vec<u16>,
}

/// Writes the topics of a run.
pub(crate) struct McapWriter {
    path: PathBuf,
    sink: Sink,
    channels: Channels,
    sequence: u32,
    message: Vec<u8>,
    /// The message of the poses, of which numbers change from record to record.
    poses: FrameTransforms,
    /// Of each subsystem: what is written when it changes, and what is written always.
    variables: Vec<[Option<Variables>; 2]>,
    joints: Vec<Joints>,
    /// Where the scenario wants them.
    overlays: Option<Overlays>,
    visibility: Visibility,
    energy: Columns,
    ground: Option<GroundGrid>,
    points: Option<GroundPoints>,
    /// Of each tile of those: what was drawn last.
    drawn: Vec<u64>,
    forces: Forces,
    forces_next_s: f64,
    gravity_m_s2: f64,
    precision: Precision,
    packed: Vec<u8>,
    window: WindowRecord,
    /// The messages behind what is kept, where checkpoints ask for them.
    pending: Option<Vec<Pending>>,
    /// All topics so far, in the order of their channels.
    announced: Vec<TopicInfo>,
    /// Who else gets the messages.
    tap: Option<Box<dyn Tap>>,
}

impl McapWriter {
    /// Creates the file; `about` is the description of the run at its head.
    pub fn create(folder: &Path, about: BTreeMap<String, String>, scenario: &Scenario) -> Result<Self> {
        let path = folder.join(RECORDING);
        let file = KeptFile::create(&path).map_err(at(&path))?;
        Self::over(file, path, about, scenario)
    }

    /// The same for a file that is open.
    fn over(
        file: KeptFile,
        path: PathBuf,
        about: BTreeMap<String, String>,
        scenario: &Scenario,
    ) -> Result<Self> {
        // No chunk size: chunks end by count only.
        let encoder = options().chunk_size(None).create(NoSeek::new(BufWriter::new(file)));
        let mut encoder = encoder.map_err(other_at(&path))?;
        let about = mcap::records::Metadata { name: "terraglue".into(), metadata: about };
        encoder.write_metadata(&about).map_err(other_at(&path))?;
        let mut writer = Self {
            sink: Sink::new(&path, encoder),
            path,
            channels: Channels::default(),
            sequence: 0,
            message: Vec::new(),
            poses: FrameTransforms::default(),
            variables: Vec::new(),
            joints: Vec::new(),
            overlays: Overlays::of(scenario),
            visibility: Visibility::default(),
            energy: Columns::default(),
            ground: None,
            points: None,
            drawn: Vec::new(),
            forces: Forces::default(),
            forces_next_s: f64::NEG_INFINITY,
            gravity_m_s2: rotation::length(scenario.world.gravity_m_s2),
            precision: Precision::digits(scenario.recording.digits),
            packed: Vec::new(),
            window: WindowRecord::default(),
            pending: None,
            announced: Vec::new(),
            tap: None,
        };
        writer.channels.events = writer.add(topics::of::<Log>("/events"))?;
        Ok(writer)
    }

    fn add(&mut self, topic: Topic) -> Result<u16> {
        let info = TopicInfo::of(&topic);
        let channel = self.sink.topic(topic);
        let channel = self.checked(channel)?;
        let info = TopicInfo { channel, ..info };
        self.tap.iter_mut().for_each(|tap| tap.announced(&info));
        self.announced.push(info);
        Ok(channel)
    }

    /// Gives all topics so far, the messages of the open chunk where they are kept, and everything that comes to `tap`, too.
    pub fn set_tap(&mut self, mut tap: Box<dyn Tap>) {
        self.announced.iter().for_each(|info| tap.announced(info));
        for pending in self.pending.iter().flatten() {
            tap.message(&pending.header(), pending.bytes());
        }
        self.tap = Some(tap);
    }

    /// Writes the messages of all streams since the step before; called for every step.
    pub fn streams(&mut self, view: &View) -> Result {
        for (k, stream) in view.streams.iter().enumerate() {
            for (time, bytes) in &stream.messages {
                self.message.clone_from(bytes);
                self.emit(self.channels.streams[k], *time)?;
            }
        }
        Ok(())
    }

    fn joint_states(&mut self, view: &View) -> Result {
        let mut all = std::mem::take(&mut self.joints);
        let written = all.iter_mut().enumerate().try_for_each(|(k, joints)| {
            joints.read(view, self.precision)?;
            self.put(self.channels.joints[k], view.t_s, &joints.message)
        });
        self.joints = all;
        written
    }

    /// Announces all topics and writes what stands once at the start: shapes and the whole ground.
    pub fn started(&mut self, view: &View, snapshot: &Snapshot) -> Result {
        self.find(view)?;
        self.announce(view, snapshot)?;
        self.put(self.channels.scene, view.t_s, &scene(view, &self.visibility))?;
        for (frame, cloud) in point_cloud::bodies(view) {
            let channel = self.add(topics::shape(&frame))?;
            self.put(channel, view.t_s, &cloud)?;
        }
        self.whole_ground(view)?;
        self.ground_tiles(view, (0..self.channels.tiles.len()).collect())?;
        self.sink.start();
        Ok(())
    }

    /// Finds the parts of the view that are recorded in forms of their own: ground, forces, visibility.
    fn find(&mut self, view: &View) -> Result {
        self.ground = GroundGrid::find(view)?;
        self.points = self.ground.as_ref().map(|g| GroundPoints::new(&g.info));
        self.drawn = vec![0; self.points.as_ref().map_or(0, GroundPoints::count)];
        self.forces = Forces::new(view, self.gravity_m_s2);
        self.visibility = Visibility::find(view)?;
        Ok(())
    }

    fn announce(&mut self, view: &View, snapshot: &Snapshot) -> Result {
        self.channels.tf = self.add(topics::of::<FrameTransforms>("/tf"))?;
        self.channels.scene = self.add(topics::scene())?;
        self.channels.forces = self.add(topics::forces(self.forces.metres_per_newton))?;
        self.channels.force_points = self.add(topics::force_points())?;
        self.channels.ground = self.add(topics::of::<Grid>("/ground"))?;
        for tile in 0..self.points.as_ref().map_or(0, GroundPoints::count) {
            let topic = self.points.as_ref().map(|p| p.topic(tile)).unwrap_or_default();
            let channel = self.add(topics::tile(&topic))?;
            self.channels.tiles.push(channel);
        }
        let (energy, about) = energy_message::columns(view);
        self.channels.energy = self.add(topics::energy(&energy, &about))?;
        self.energy = energy;
        self.channels.gluing = self.add(topics::gluing())?;
        for scalars in &snapshot.subsystems {
            let part = |parameter: bool| {
                let all = scalars.columns.iter().enumerate();
                all.filter(move |(_, c)| c.held == parameter && c.recorded)
            };
            let parameters = self.variables(&scalars.name, true, Columns::new(part(true)))?;
            let others = self.variables(&scalars.name, false, Columns::new(part(false)))?;
            self.variables.push([parameters, others]);
        }
        self.joints = Joints::find(view);
        let topics: Vec<Topic> = self.joints.iter().map(|joints| joints.topic(view)).collect();
        for topic in topics {
            let channel = self.add(topic)?;
            self.channels.joints.push(channel);
        }
        for stream in view.streams {
            let channel = self.add(stream_topics::topic(stream))?;
            self.channels.streams.push(channel);
        }
        Ok(())
    }

    fn variables(
        &mut self,
        subsystem: &str,
        parameters: bool,
        (columns, about): (Columns, Vec<About>),
    ) -> Result<Option<Variables>> {
        // The topic of a subsystem without variables still shows that it is there.
        if columns.count == 0 && parameters {
            return Ok(None);
        }
        let channel = self.add(topics::variables(subsystem, parameters, &columns, &about))?;
        let places: Vec<usize> = about.iter().map(|a| a.index).collect();
        let whole = about.iter().map(|a| !a.kind.is_real()).collect();
        let written = parameters.then(Vec::new);
        Ok(Some(Variables { channel, columns, places, whole, values: Vec::new(), written }))
    }

    /// Takes the step into the figures of `since_last`; called for every step.
    pub fn count(&mut self, report: &StepReport) {
        self.window.add(report);
    }

    /// Writes variables, poses, forces, energy and gluing of a communication point.
    pub fn record(&mut self, view: &View, snapshot: &Snapshot) -> Result {
        self.transforms(view)?;
        self.hidden(view)?;
        self.joint_states(view)?;
        let mut variables = std::mem::take(&mut self.variables);
        let written = snapshot.subsystems.iter().zip(&mut variables).try_for_each(|(scalars, parts)| {
            parts
                .iter_mut()
                .flatten()
                .try_for_each(|part| self.write_variables(view.t_s, part, &scalars.values))
        });
        self.variables = variables;
        written?;
        self.message.clear();
        let energy: Vec<f64> = energy_message::values(view).iter().map(|e| self.precision.of(*e)).collect();
        self.energy.encode(&energy, &mut self.message);
        self.emit(self.channels.energy, view.t_s)?;
        let step = gluing_message::step(view, &self.window, self.precision)?;
        self.put(self.channels.gluing, view.t_s, &step)?;
        self.window = WindowRecord::default();
        self.draw_forces(view)
    }

    /// Draws again the bodies of which another part is shown than before.
    fn hidden(&mut self, view: &View) -> Result {
        let changed = self.visibility.changed(view)?;
        if changed.is_empty() {
            return Ok(());
        }
        let scene = bodies(view, &self.visibility, changed.into_iter());
        self.put(self.channels.scene, view.t_s, &scene)
    }

    fn write_variables(&mut self, t_s: f64, part: &mut Variables, all: &[f64]) -> Result {
        let changed = part.take(all, self.precision);
        if let Some(written) = &mut part.written {
            if !changed && !written.is_empty() {
                return Ok(());
            }
            written.clone_from(&part.values);
        }
        self.message.clear();
        part.columns.encode(&part.values, &mut self.message);
        self.emit(part.channel, t_s)
    }

    fn draw_forces(&mut self, view: &View) -> Result {
        if view.t_s < self.forces_next_s {
            return Ok(());
        }
        // Not later for the rounding of a sum of steps.
        self.forces_next_s = view.t_s + DRAWN_EVERY_S * (1.0 - 1e-6);
        let (arrows, points) = (self.forces.arrows(view), self.forces.points(view));
        self.put(self.channels.forces, view.t_s, &arrows)?;
        self.put(self.channels.force_points, view.t_s, &points)?;
        self.draw_overlays(view)
    }

    fn draw_overlays(&mut self, view: &View) -> Result {
        let Some(mut overlays) = self.overlays.take() else { return Ok(()) };
        let written = overlays.read(view).into_iter().try_for_each(|(topic, shown)| {
            let channel = match overlays.channel(&topic) {
                Some(channel) => channel,
                None => {
                    // a run that goes on from a checkpoint announces its layers at the start of a chunk
                    self.flush(view.t_s)?;
                    self.layer(&mut overlays, topic)?
                }
            };
            self.put(channel, view.t_s, &shown)
        });
        self.overlays = Some(overlays);
        written
    }

    fn layer(&mut self, overlays: &mut Overlays, topic: String) -> Result<u16> {
        let channel = self.add(overlays::topic(&topic))?;
        overlays.add(topic, channel);
        Ok(channel)
    }

    fn transforms(&mut self, view: &View) -> Result {
        let mut poses = std::mem::take(&mut self.poses);
        let written = self.fill(&mut poses, view).and_then(|()| self.put(self.channels.tf, view.t_s, &poses));
        self.poses = poses;
        written
    }

    /// Poses of all bodies as they are now; frames keep the names that they got first.
    fn fill(&self, poses: &mut FrameTransforms, view: &View) -> Result {
        let mut count = 0;
        for s in view.subsystems {
            for (body, state) in s.scene.bodies.iter().zip(s.body_states) {
                let Pose { position, orientation } = state.world_from_body;
                if position.iter().chain(&orientation).any(|v| v.is_nan()) {
                    let message = format!("pose of body `{}` is not a number (NaN)", body.name);
                    return Err(failed(s, view.t_s, "body_states", message));
                }
                if count == poses.transforms.len() {
                    poses.transforms.push(FrameTransform {
                        parent_frame_id: "world".into(),
                        child_frame_id: frame_id(s.name, &body.name),
                        ..FrameTransform::default()
                    });
                }
                let transform = &mut poses.transforms[count];
                transform.timestamp = Some(timestamp(view.t_s));
                transform.translation = Some(vector(position.map(|x| self.precision.of(x))));
                transform.rotation = Some(quaternion(orientation.map(|x| self.precision.of(x))));
                count += 1;
            }
        }
        Ok(())
    }

    /// Writes an event.
    pub fn event(&mut self, event: &Event) -> Result {
        let entry = Log {
            timestamp: Some(timestamp(event.t_s)),
            level: log::Level::Info.into(),
            message: event.what.clone(),
            name: "terraglue".into(),
            ..Log::default()
        };
        self.put(self.channels.events, event.t_s, &entry)
    }

    /// Writes the tiles of ground that have changed since they were last written.
    pub fn changed_ground(&mut self, view: &View) -> Result {
        let (Some(ground), Some(points)) = (&mut self.ground, &self.points) else { return Ok(()) };
        let changed = ground.changed(&view.subsystems[ground.subsystem], view.t_s)?;
        let mut tiles: Vec<usize> = changed.iter().map(|r| points.tile_of(*r)).collect();
        tiles.sort_unstable();
        tiles.dedup();
        self.ground_tiles(view, tiles)
    }

    fn ground_tiles(&mut self, view: &View, tiles: Vec<usize>) -> Result {
        let (Some(ground), Some(points)) = (self.ground.take(), self.points.take()) else { return Ok(()) };
        let soil = &view.subsystems[ground.subsystem];
        let mut packed = std::mem::take(&mut self.packed);
        let written = tiles.into_iter().try_for_each(|tile| {
            let drawn = (tile, &mut self.drawn[tile]);
            match points.cloud(&ground, soil, drawn, view.t_s, &mut packed)? {
                Some(cloud) => self.put(self.channels.tiles[tile], view.t_s, &cloud),
                None => Ok(()),
            }
        });
        (self.ground, self.points, self.packed) = (Some(ground), Some(points), packed);
        written
    }

    /// Writes all of the ground, to the bit.
    pub fn whole_ground(&mut self, view: &View) -> Result {
        match self.ground.as_ref().map(GroundGrid::all) {
            Some(rectangle) => self.grid(view, rectangle),
            None => Ok(()),
        }
    }

    /// How the ground is cut into topics.
    pub fn ground_points(&self) -> Option<&GroundPoints> {
        self.points.as_ref()
    }

    /// The ground that is recorded.
    pub fn ground(&self) -> Option<&GroundGrid> {
        self.ground.as_ref()
    }

    fn grid(&mut self, view: &View, r: Rectangle) -> Result {
        let Some(ground) = &self.ground else { return Ok(()) };
        let mut packed = Vec::new();
        ground.pack(&view.subsystems[ground.subsystem], r, view.t_s, &mut packed)?;
        let info = &ground.info;
        // A node is the centre of a cell; the grid is placed by the corner of its first cell.
        let corner = |axis: usize, n: u32| info.origin[axis] + (f64::from(n) - 0.5) * info.spacing;
        let columns = r.i1 - r.i0;
        let place = Pose { position: [corner(0, r.i0), corner(1, r.j0), 0.0], ..Pose::IDENTITY };
        let field = |name: &str, offset: u32| PackedElementField {
            name: name.into(),
            offset,
            r#type: NumericType::Float32.into(),
        };
        let grid = Grid {
            timestamp: Some(timestamp(view.t_s)),
            frame_id: "world".into(),
            pose: pose(&place),
            column_count: columns,
            cell_size: Some(Vector2 { x: info.spacing, y: info.spacing }),
            row_stride: 8 * columns,
            cell_stride: 8,
            fields: vec![field("height", 0), field("sinkage", 4)],
            data: Bytes::from(packed),
        };
        self.put(self.channels.ground, view.t_s, &grid)
    }

    fn put(&mut self, channel: u16, t_s: f64, message: &impl Message) -> Result {
        self.message.clear();
        message
            .encode(&mut self.message)
            .map_err(|e| Error::Simulation { time_s: t_s, message: e.to_string() })?;
        self.emit(channel, t_s)
    }

    fn emit(&mut self, channel_id: u16, t_s: f64) -> Result {
        let log_time = nanoseconds(t_s);
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.sequence = self.sequence.wrapping_add(1);
        if let Some(pending) = &mut self.pending {
            pending.push(Pending::of(&header, &self.message));
        }
        if let Some(tap) = &mut self.tap {
            tap.message(&header, &self.message);
        }
        let written = self.sink.write(&header, &mut self.message);
        self.checked(written)
    }

    /// Ends the chunk and hands everything up to time `t_s` to the operating system.
    pub fn flush(&mut self, t_s: f64) -> Result {
        let flushed = self.sink.flush(t_s);
        self.checked(flushed)?;
        self.pending.iter_mut().for_each(Vec::clear);
        self.tap.iter_mut().for_each(|tap| tap.flushed());
        Ok(())
    }

    /// Simulated time up to which all can be read whatever comes after, s.
    pub fn kept_s(&self) -> f64 {
        self.sink.kept().1
    }

    /// After a write that failed the file ends with what was whole before, and nothing more is written.
    fn checked<T>(&mut self, written: mcap::McapResult<T>) -> Result<T> {
        written.map_err(|e| {
            self.sink.abandon();
            let kept = self.sink.kept().0;
            let cut = File::options().write(true).open(&self.path).and_then(|f| f.set_len(kept));
            if let Err(e) = cut {
                ::log::warn!("{}: its end cannot be cut off: {e}", self.path.display());
            }
            match e {
                mcap::McapError::Io(source) => at(&self.path)(source),
                other => other_at(&self.path)(other),
            }
        })
    }

    /// Writes the footer; later calls do nothing.
    pub fn close(&mut self) -> Result {
        let closed = self.sink.close();
        self.checked(closed)
    }
}
