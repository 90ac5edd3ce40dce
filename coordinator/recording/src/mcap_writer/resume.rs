//! A recording that another process began: what it wrote up to a checkpoint is written once more and must be the same bytes,
//! which brings back the index and all check sums; then it goes on.
//!
//! Chunks end where they would end without checkpoints: of an open chunk a checkpoint keeps the messages.

use super::McapWriter;
use super::sink::Encoder;
use crate::keep::Keep;
use crate::layout::{RECORDING, at, other_at};
use crate::messages::WindowRecord;
use crate::overlays::Overlays;
use crate::records::{HEAD, chunk};
use crate::snapshot::Snapshot;
use mcap::records::{MessageHeader, Record, op};
use mcap::{McapError, McapResult};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::View;
use terraglue_host::kept_file::{KeptFile, shorter};
use terraglue_scenario::Scenario;
use terraglue_subsystem::bytes::Block;
use terraglue_subsystem::persist;

/// A message of the open chunk.
pub(super) struct Pending {
    channel: u16,
    sequence: u32,
    time_ns: u64,
    data: Block,
}
persist!(Pending { channel, sequence, time_ns, data });

impl Pending {
    pub fn of(header: &MessageHeader, data: &[u8]) -> Self {
        let MessageHeader { channel_id: channel, sequence, log_time: time_ns, .. } = *header;
        Self { channel, sequence, time_ns, data: Block(data.to_vec()) }
    }

    pub fn bytes(&self) -> &[u8] {
        &self.data.0
    }

    pub fn header(&self) -> MessageHeader {
        let Self { channel: channel_id, sequence, time_ns: log_time, .. } = *self;
        MessageHeader { channel_id, sequence, log_time, publish_time: log_time }
    }
}

/// State from which a writer resumes.
pub(crate) struct McapState {
    kept: (u64, f64),
    sequence: u32,
    pending: Vec<Pending>,
    /// Last written values of each part of each subsystem.
    written: Vec<Option<Vec<f64>>>,
    ground: Block,
    unseen: Vec<bool>,
    drawn: Vec<u64>,
    forces_next_s: f64,
    window: WindowRecord,
    /// Topics of the layers of overlays.
    layers: Vec<String>,
    /// Which shapes were shown.
    shown: Vec<Vec<bool>>,
}
persist!(McapState {
    kept,
    sequence,
    pending,
    written,
    ground,
    unseen,
    drawn,
    forces_next_s,
    window,
    layers,
    shown
});

impl McapWriter {
    /// From now on [`McapWriter::state`] can be asked for.
    pub fn keep_pending(&mut self) {
        self.pending.get_or_insert_default();
    }

    /// State with which another process resumes here.
    pub fn state(&mut self, view: &View) -> Result<McapState> {
        let waited = self.sink.wait();
        self.checked(waited)?;
        let (mut ground, mut unseen) = (Block::default(), Vec::new());
        if let Some(grid) = &self.ground {
            grid.keep(&mut ground.0);
            unseen = grid.unseen(&view.subsystems[grid.subsystem], view.t_s)?;
        }
        let parts = self.variables.iter().flatten().flatten();
        let pending = self.pending.iter().flatten();
        Ok(McapState {
            kept: self.sink.kept(),
            sequence: self.sequence,
            pending: pending.map(|p| Pending::of(&p.header(), &p.data.0)).collect(),
            written: parts.map(|part| part.written.clone()).collect(),
            ground,
            unseen,
            drawn: self.drawn.clone(),
            forces_next_s: self.forces_next_s,
            window: self.window,
            layers: self.overlays.iter().flat_map(Overlays::layers).cloned().collect(),
            shown: self.visibility.flags(),
        })
    }

    /// Opens the recording of another process and goes on from its state; `view` is the same moment as it was there.
    pub fn resume(
        folder: &Path,
        about: BTreeMap<String, String>,
        scenario: &Scenario,
        (view, snapshot): (&View, &Snapshot),
        state: McapState,
    ) -> Result<Self> {
        let path = folder.join(RECORDING);
        let length = state.kept.0;
        let file = KeptFile::repeat(&path, length).map_err(at(&path))?;
        let mut writer = Self::over(file, path.clone(), about, scenario)?;
        writer.sink.keep(state.kept);
        let before = File::open(&path).map_err(at(&path))?;
        if let Some(encoder) = writer.sink.encoder() {
            repeat(BufReader::new(before).take(length), encoder).map_err(at(&path))?;
        }
        writer.find(view)?;
        writer.announce(view, snapshot)?;
        if let Some(mut overlays) = writer.overlays.take() {
            state.layers.iter().try_for_each(|topic| writer.layer(&mut overlays, topic.clone()).map(drop))?;
            writer.overlays = Some(overlays);
        }
        writer.take(state).map_err(other_at(&path))?;
        let Some(encoder) = writer.sink.encoder() else { return Ok(writer) };
        let mut again = writer.pending.iter().flatten();
        let again = again.try_for_each(|p| encoder.write_to_known_channel(&p.header(), &p.data.0));
        writer.checked(again)?;
        writer.sink.start();
        Ok(writer)
    }

    fn take(&mut self, state: McapState) -> terraglue_subsystem::Result {
        self.sequence = state.sequence;
        self.pending = Some(state.pending);
        for (part, written) in self.variables.iter_mut().flatten().flatten().zip(state.written) {
            part.written = written;
        }
        if let Some(grid) = &mut self.ground {
            grid.recall(&mut state.ground.0.as_slice())?;
            grid.forget(&state.unseen);
        }
        if state.drawn.len() == self.drawn.len() {
            self.drawn = state.drawn;
        }
        self.forces_next_s = state.forces_next_s;
        self.window = state.window;
        self.visibility.recall(state.shown);
        Ok(())
    }
}

/// Gives a sink everything after the header of a recording, chunk by chunk as in the file.
fn repeat(mut from: impl Read, sink: &mut Encoder) -> std::io::Result<()> {
    let other = |e: McapError| match e {
        McapError::Io(source) => source,
        other => std::io::Error::new(ErrorKind::InvalidData, other),
    };
    from.read_exact(&mut [0; mcap::MAGIC.len()]).map_err(|_| shorter())?;
    let mut record = Vec::new();
    loop {
        record.clear();
        if from.by_ref().take(HEAD as u64).read_to_end(&mut record)? == 0 {
            return Ok(());
        }
        let length = record.get(1..HEAD).and_then(|l| l.try_into().ok()).map(u64::from_le_bytes);
        let read = from.by_ref().take(length.unwrap_or(0)).read_to_end(&mut record)?;
        if length != Some(read as u64) {
            return Err(shorter());
        }
        if record[0] == op::CHUNK {
            chunk(&record).and_then(|records| repeat_chunk(records, sink)).map_err(other)?;
        }
    }
}

/// All records of a chunk, and its end. Numbers of schemas and channels come again as they are given in turn.
fn repeat_chunk(records: Vec<Record>, sink: &mut Encoder) -> McapResult<()> {
    for record in records {
        match record {
            Record::Schema { header, data } => {
                sink.add_schema(&header.name, &header.encoding, &data)?;
            }
            Record::Channel(c) => {
                sink.add_channel(c.schema_id, &c.topic, &c.message_encoding, &c.metadata)?;
            }
            Record::Message { header, data } => sink.write_to_known_channel(&header, &data)?,
            _ => {}
        }
    }
    sink.flush()
}
