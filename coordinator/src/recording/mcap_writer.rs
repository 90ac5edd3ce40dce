//! `recording.mcap`: all topics of a run in one append-only file.
//!
//! Equal runs give equal bytes: times are simulated, chunks end by a count of steps, nothing is compressed on
//! other threads, and no name of a machine or folder is written. What was flushed survives `kill -9`.

use crate::error::{Error, Result};
use crate::gluing::StepReport;
use crate::observer::{Happening, View};
use crate::recording::ground_grid::{GroundGrid, Rectangle};
use crate::recording::json::JsonBuffer;
use crate::recording::kept_file::KeptFile;
use crate::recording::layout::{RECORDING, at, nanoseconds, other_at};
use crate::recording::messages::{self, WindowRecord};
use crate::recording::snapshot::{ScalarKind, Snapshot, failed};
use crate::recording::{scene_message, schemas};
use base64::Engine;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// A chunk ends every so many steps; that many can be lost when the process is killed.
pub(crate) const FLUSH_STEPS: u64 = 100;

type Sink = mcap::Writer<NoSeek<BufWriter<KeptFile>>>;

/// How every recording is laid out, also a mended one.
pub(crate) fn options() -> mcap::WriteOptions {
    mcap::WriteOptions::new()
        .compression(Some(mcap::Compression::Zstd))
        .compression_level(1)
        .compression_threads(0)
        .library("terraglue")
        .disable_seeking(true)
}

/// Numbers of the channels.
#[derive(Default)]
struct Channels {
    tf: u16,
    scene: u16,
    ground: u16,
    energy: u16,
    gluing: u16,
    events: u16,
    subsystems: Vec<u16>,
}

/// Writes the topics of a run.
pub(crate) struct McapWriter {
    path: PathBuf,
    sink: Option<Sink>,
    channels: Channels,
    sequence: u32,
    json: JsonBuffer,
    ground: Option<GroundGrid>,
    packed: Vec<u8>,
    encoded: String,
    window: WindowRecord,
    /// Bytes and simulated time (s) of what can be read whatever comes after.
    kept: (u64, f64),
}

impl McapWriter {
    /// Creates the file; `about` is the description of the run that stands at its head.
    pub fn create(folder: &Path, about: BTreeMap<String, String>) -> Result<Self> {
        let path = folder.join(RECORDING);
        let file = KeptFile::create(&path).map_err(at(&path))?;
        // No chunk size: chunks end by count only.
        let sink = options().chunk_size(None).create(NoSeek::new(BufWriter::new(file)));
        let mut sink = sink.map_err(other_at(&path))?;
        let about = mcap::records::Metadata { name: "terraglue".into(), metadata: about };
        sink.write_metadata(&about).map_err(other_at(&path))?;
        let events = add(&mut sink, &schemas::events()).map_err(other_at(&path))?;
        Ok(Self {
            path,
            sink: Some(sink),
            channels: Channels { events, ..Channels::default() },
            sequence: 0,
            json: JsonBuffer::default(),
            ground: None,
            packed: Vec::new(),
            encoded: String::new(),
            window: WindowRecord::default(),
            kept: (0, 0.0),
        })
    }

    /// Announces all topics and writes what stands once at the start: shapes and the whole ground.
    pub fn started(&mut self, view: &View, snapshot: &Snapshot) -> Result {
        let announced = self.announce(snapshot);
        self.checked(announced)?;
        self.ground = GroundGrid::find(view)?;
        scene_message::write(self.json.clear(), view);
        self.emit(self.channels.scene, "/scene", view.t_s)?;
        self.whole_ground(view)
    }

    fn announce(&mut self, snapshot: &Snapshot) -> mcap::McapResult<()> {
        let Some(sink) = &mut self.sink else { return Ok(()) };
        self.channels.tf = add(sink, &schemas::transforms())?;
        self.channels.scene = add(sink, &schemas::scene())?;
        self.channels.ground = add(sink, &schemas::ground())?;
        self.channels.energy = add(sink, &schemas::energy())?;
        self.channels.gluing = add(sink, &schemas::gluing())?;
        for scalars in &snapshot.subsystems {
            self.channels.subsystems.push(add(sink, &schemas::variables(scalars))?);
        }
        Ok(())
    }

    /// Takes the step into the figures of `since_last`; called for every step.
    pub fn count(&mut self, report: &StepReport) {
        self.window.add(report);
    }

    /// Writes variables, poses, energy and gluing of a communication point.
    pub fn record(&mut self, view: &View, snapshot: &Snapshot) -> Result {
        self.transforms(view)?;
        for (k, scalars) in snapshot.subsystems.iter().enumerate() {
            self.json.clear().raw("{").field("t", view.t_s);
            for (column, value) in scalars.columns.iter().zip(&scalars.values) {
                self.json.element().raw(&column.key);
                match column.kind {
                    ScalarKind::Real => self.json.number(&column.name, *value),
                    ScalarKind::Bool => self.json.boolean(*value != 0.0),
                    ScalarKind::Integer | ScalarKind::Enumeration(_) => self.json.integer(*value as i64),
                };
            }
            self.json.raw("}");
            self.emit(self.channels.subsystems[k], &scalars.name, view.t_s)?;
        }
        messages::write_energy(self.json.clear(), view);
        self.emit(self.channels.energy, "/energy", view.t_s)?;
        messages::write_gluing(self.json.clear(), view, &self.window);
        self.window = WindowRecord::default();
        self.emit(self.channels.gluing, "/gluing", view.t_s)
    }

    fn transforms(&mut self, view: &View) -> Result {
        let now = nanoseconds(view.t_s);
        self.json.clear().raw("{").key("transforms").raw("[");
        for s in view.subsystems {
            for (body, state) in s.scene.bodies.iter().zip(s.body_states) {
                let pose = &state.world_from_body;
                self.json.element().raw("{").timestamp(now).key("parent_frame_id").text("world");
                scene_message::frame_id(self.json.key("child_frame_id"), s.name, &body.name);
                self.json.vector("translation", &pose.position);
                self.json.quaternion("rotation", &pose.orientation).raw("}");
                if self.json.refused().is_some() {
                    let message = format!("pose of body `{}` is not a number (NaN)", body.name);
                    return Err(failed(s, view.t_s, "body_states", message));
                }
            }
        }
        self.json.raw("]}");
        self.emit(self.channels.tf, "/tf", view.t_s)
    }

    /// Writes an event.
    pub fn happened(&mut self, happening: &Happening) -> Result {
        messages::write_event(self.json.clear(), happening);
        self.emit(self.channels.events, "/events", happening.t_s)
    }

    /// Writes the rectangle of the ground that has changed since it was last written.
    pub fn changed_ground(&mut self, view: &View) -> Result {
        let Some(ground) = &mut self.ground else { return Ok(()) };
        match ground.changed(&view.subsystems[ground.subsystem], view.t_s)? {
            Some(rectangle) => self.grid(view, rectangle),
            None => Ok(()),
        }
    }

    /// Writes all of the ground.
    pub fn whole_ground(&mut self, view: &View) -> Result {
        match self.ground.as_ref().map(GroundGrid::all) {
            Some(rectangle) => self.grid(view, rectangle),
            None => Ok(()),
        }
    }

    /// The ground that is recorded.
    pub fn ground(&self) -> Option<&GroundGrid> {
        self.ground.as_ref()
    }

    fn grid(&mut self, view: &View, r: Rectangle) -> Result {
        let Some(ground) = &self.ground else { return Ok(()) };
        self.packed.clear();
        ground.pack(&view.subsystems[ground.subsystem], r, view.t_s, &mut self.packed)?;
        self.encoded.clear();
        base64::engine::general_purpose::STANDARD.encode_string(&self.packed, &mut self.encoded);
        let info = &ground.info;
        // A node is the centre of a cell; the grid is placed by the corner of its first cell.
        let corner = |axis: usize, n: u32| info.origin[axis] + (f64::from(n) - 0.5) * info.spacing;
        let columns = r.i1 - r.i0;
        let json = self.json.clear().raw("{").timestamp(nanoseconds(view.t_s));
        json.key("frame_id").text("world").key("pose").raw("{");
        json.vector("position", &[corner(0, r.i0), corner(1, r.j0), 0.0]);
        json.quaternion("orientation", &[1.0, 0.0, 0.0, 0.0]).raw("}");
        json.key("column_count").integer(columns).key("cell_size").raw("{");
        json.field("x", info.spacing).field("y", info.spacing).raw("}");
        json.key("row_stride").integer(8 * columns).key("cell_stride").integer(8);
        json.key("fields")
            .raw(r#"[{"name":"height","offset":0,"type":7},{"name":"sinkage","offset":4,"type":7}]"#);
        json.key("data").raw("\"").raw(&self.encoded).raw("\"}");
        self.emit(self.channels.ground, "/ground", view.t_s)
    }

    fn emit(&mut self, channel_id: u16, what: &str, t_s: f64) -> Result {
        if let Some(key) = self.json.refused() {
            let message = format!("recording {what}: `{key}` is not a number (NaN)");
            return Err(Error::Simulation { time_s: t_s, message });
        }
        let Some(sink) = &mut self.sink else { return Ok(()) };
        let log_time = nanoseconds(t_s);
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.sequence = self.sequence.wrapping_add(1);
        let written = sink.write_to_known_channel(&header, self.json.bytes());
        self.checked(written)
    }

    /// Ends the chunk and hands everything up to time `t_s` to the operating system.
    pub fn flush(&mut self, t_s: f64) -> Result {
        let Some(sink) = &mut self.sink else { return Ok(()) };
        let flushed = sink.flush();
        self.checked(flushed)?;
        self.kept = (std::fs::metadata(&self.path).map_or(self.kept.0, |m| m.len()), t_s);
        Ok(())
    }

    /// Simulated time up to which all can be read whatever comes after, s.
    pub fn kept_s(&self) -> f64 {
        self.kept.1
    }

    /// After a write that failed the file ends with what was whole before, and nothing more is written.
    fn checked<T>(&mut self, written: mcap::McapResult<T>) -> Result<T> {
        written.map_err(|e| {
            self.sink = None;
            let cut = File::options().write(true).open(&self.path).and_then(|f| f.set_len(self.kept.0));
            if let Err(e) = cut {
                log::warn!("{}: its end cannot be cut off: {e}", self.path.display());
            }
            match e {
                mcap::McapError::Io(source) => at(&self.path)(source),
                other => other_at(&self.path)(other),
            }
        })
    }

    /// Writes the footer; later calls do nothing.
    pub fn close(&mut self) -> Result {
        let Some(mut sink) = self.sink.take() else { return Ok(()) };
        use std::io::Write;
        let finished = sink.finish();
        let finished = finished.and_then(|_| Ok(sink.into_inner().into_inner().flush()?));
        self.checked(finished)
    }
}

fn add(sink: &mut Sink, topic: &schemas::Topic) -> mcap::McapResult<u16> {
    let schema = sink.add_schema(&topic.schema, "jsonschema", topic.text.as_bytes())?;
    sink.add_channel(schema, &topic.topic, "json", &BTreeMap::new())
}
