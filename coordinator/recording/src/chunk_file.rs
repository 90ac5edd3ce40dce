//! A recording as a file of chunks that is looked into at any time, also while it still grows: the last messages before a time,
//! or all messages of some channels.
//!
//! Only the heads of chunks and the numbers of their channels are kept in memory, about a hundred bytes for 200 steps; chunks are
//! read when they are asked for.

use crate::layout::{RECORDING, at, other_at};
use crate::records::{HEAD, chunk};
use crate::tap::TopicInfo;
use mcap::records::{Channel, Metadata, Record, op};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::ErrorKind;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use terraglue_diagnostics::error::Result;

/// Bytes that are read at once behind a chunk, where the index of its channels stands.
const LOOK: usize = 1 << 14;
/// Chunks that are kept as they were read last.
const KEPT: usize = 8;

/// A message of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Number of its channel.
    pub channel: u16,
    /// Running number among all messages of the run.
    pub sequence: u32,
    /// Simulated time, ns.
    pub time_ns: u64,
    /// The message itself.
    pub data: Vec<u8>,
}

/// Where a chunk stands, and what is in it.
#[derive(Clone, Debug)]
struct ChunkPlace {
    offset: u64,
    length: u64,
    /// First and last time, ns.
    times: [u64; 2],
    /// Numbers of its channels, ascending.
    channels: Vec<u16>,
}

impl ChunkPlace {
    fn has(&self, channel: u16) -> bool {
        self.channels.binary_search(&channel).is_ok()
    }
}

/// Numbers of chunks with their messages, the last used at the end.
type RecentChunks = Vec<(usize, Arc<Vec<Stored>>)>;

/// A recording that is looked into.
pub struct ChunkFile {
    path: PathBuf,
    file: File,
    /// Whether it is still written: the index of its last chunk may not be whole.
    is_growing: bool,
    /// Up to where it was looked at.
    end: u64,
    chunks: Vec<ChunkPlace>,
    topics: BTreeMap<u16, TopicInfo>,
    schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
    header: BTreeMap<String, String>,
    kept: Mutex<RecentChunks>,
}

impl ChunkFile {
    /// Opens the recording of a results folder; of one that is written from now
    /// on, a later chunk is taken in once something follows it.
    ///
    /// # Errors
    /// [`Error::File`](terraglue_diagnostics::error::Error): there is none, or it does not begin like one.
    pub fn open(folder: &Path, is_growing: bool) -> Result<Self> {
        let path = folder.join(RECORDING);
        let file = File::open(&path).map_err(at(&path))?;
        let mut opened = Self {
            path,
            file,
            // nothing is written while it is opened
            is_growing: false,
            end: 0,
            chunks: Vec::new(),
            topics: BTreeMap::new(),
            schemas: BTreeMap::new(),
            header: BTreeMap::new(),
            kept: Mutex::default(),
        };
        opened.refresh()?;
        opened.is_growing = is_growing;
        Ok(opened)
    }

    /// Takes in what has been written since; a part that is not whole yet is left for the next time.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn refresh(&mut self) -> Result {
        if self.end == 0 {
            let Some(magic) = self.read(0, mcap::MAGIC.len())? else { return Ok(()) };
            if magic != mcap::MAGIC {
                return Err(other_at(&self.path)("it is not an MCAP recording"));
            }
            self.end = magic.len() as u64;
        }
        while let Some((opcode, length)) = self.head()? {
            let whole = HEAD as u64 + length;
            match opcode {
                op::CHUNK => match self.chunk_place(whole)? {
                    Some(place) => self.take_chunk(place)?,
                    None => return Ok(()),
                },
                op::SCHEMA | op::CHANNEL | op::METADATA => self.take_record(opcode, whole)?,
                op::FOOTER => return Ok(()),
                _ => {}
            }
            self.end += whole;
        }
        Ok(())
    }

    /// Opcode and length of the record at the end of what is known, if all of it is there.
    fn head(&self) -> Result<Option<(u8, u64)>> {
        let Some(head) = self.read(self.end, HEAD)? else { return Ok(None) };
        let length = head[1..].try_into().map_or(0, u64::from_le_bytes);
        let size = self.file.metadata().map_err(at(&self.path))?.len();
        let fits = self.end.checked_add(HEAD as u64 + length).is_some_and(|end| end <= size);
        Ok(fits.then_some((head[0], length)))
    }

    /// Exactly these bytes; none where the file ends before.
    fn read(&self, offset: u64, length: usize) -> Result<Option<Vec<u8>>> {
        let mut bytes = vec![0; length];
        match self.file.read_exact_at(&mut bytes, offset) {
            Ok(()) => Ok(Some(bytes)),
            Err(e) if e.kind() == ErrorKind::UnexpectedEof => Ok(None),
            Err(e) => Err(at(&self.path)(e)),
        }
    }

    /// The chunk at the end of what is known, once the index of its channels is there behind it.
    fn chunk_place(&self, length: u64) -> Result<Option<ChunkPlace>> {
        let Some(head) = self.read(self.end + HEAD as u64, 16)? else { return Ok(None) };
        let time = |k: usize| head[k..k + 8].try_into().map_or(0, u64::from_le_bytes);
        let times = [time(0), time(8)];
        let channels = self.indexed(self.end + length)?;
        Ok(channels.map(|channels| ChunkPlace { offset: self.end, length, times, channels }))
    }

    /// The numbers of the channels in the index behind a chunk.
    fn indexed(&self, mut offset: u64) -> Result<Option<Vec<u16>>> {
        let mut channels = Vec::new();
        let (mut bytes, mut from) = (Vec::new(), 0);
        loop {
            if bytes.len() < from + HEAD + 2 {
                bytes = vec![0; LOOK];
                let count = self.file.read_at(&mut bytes, offset).map_err(at(&self.path))?;
                bytes.truncate(count);
                from = 0;
            }
            let Some(head) = bytes.get(from..from + HEAD + 2) else {
                return Ok((!self.is_growing).then(|| sorted(channels)));
            };
            if head[0] != op::MESSAGE_INDEX {
                return Ok(Some(sorted(channels)));
            }
            let length = head[1..HEAD].try_into().map_or(0, u64::from_le_bytes);
            channels.push(u16::from_le_bytes([head[HEAD], head[HEAD + 1]]));
            let whole = HEAD as u64 + length;
            offset += whole;
            from = from.saturating_add(usize::try_from(whole).unwrap_or(usize::MAX));
            if from > bytes.len() {
                bytes.clear();
                from = 0;
            }
        }
    }

    /// Notes a chunk, and the topics that are announced in it.
    fn take_chunk(&mut self, place: ChunkPlace) -> Result {
        let new = place.channels.iter().any(|channel| !self.topics.contains_key(channel));
        if (new || self.chunks.is_empty())
            && let Some(bytes) = self.read(place.offset, place.length as usize)?
        {
            // what is damaged is left out
            for record in chunk(&bytes).unwrap_or_default() {
                self.note(record);
            }
        }
        self.chunks.push(place);
        Ok(())
    }

    fn take_record(&mut self, opcode: u8, length: u64) -> Result {
        let Some(bytes) = self.read(self.end, length as usize)? else { return Ok(()) };
        if let Ok(record) = mcap::read::parse_record(opcode, &bytes[HEAD..]) {
            self.note(record.into_owned());
        }
        Ok(())
    }

    fn note(&mut self, record: Record) {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(Channel { id, schema_id, topic, message_encoding, metadata }) => {
                let (schema, schema_encoding, schema_data) =
                    self.schemas.get(&schema_id).cloned().unwrap_or_default();
                let encoding = message_encoding;
                let info = TopicInfo {
                    channel: id,
                    topic,
                    encoding,
                    schema,
                    schema_encoding,
                    schema_data,
                    metadata,
                };
                self.topics.insert(id, info);
            }
            Record::Metadata(Metadata { name, metadata }) if name == "terraglue" => self.header = metadata,
            _ => {}
        }
    }

    /// All topics so far, by the numbers of their channels.
    pub fn topics(&self) -> impl Iterator<Item = &TopicInfo> {
        self.topics.values()
    }

    /// Description of the simulation; see [`crate::Header`].
    pub fn header(&self) -> &BTreeMap<String, String> {
        &self.header
    }

    /// First and last time of what is there, ns; none where nothing is.
    pub fn times_ns(&self) -> Option<[u64; 2]> {
        let first = self.chunks.iter().map(|c| c.times[0]).min()?;
        Some([first, self.chunks.iter().map(|c| c.times[1]).max()?])
    }

    /// The messages of a chunk in their order.
    fn messages(&self, number: usize) -> Result<Arc<Vec<Stored>>> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(k) = kept.iter().position(|(n, _)| *n == number) {
            let found = kept.remove(k);
            let messages = Arc::clone(&found.1);
            kept.push(found);
            return Ok(messages);
        }
        let place = &self.chunks[number];
        let bytes = self.read(place.offset, place.length as usize)?.unwrap_or_default();
        let message = |record| match record {
            Record::Message { header, data } => Some(Stored {
                channel: header.channel_id,
                sequence: header.sequence,
                time_ns: header.log_time,
                data: data.into_owned(),
            }),
            _ => None,
        };
        let messages: Vec<Stored> =
            chunk(&bytes).unwrap_or_default().into_iter().filter_map(message).collect();
        let messages = Arc::new(messages);
        if kept.len() >= KEPT {
            kept.remove(0);
        }
        kept.push((number, Arc::clone(&messages)));
        Ok(messages)
    }

    /// Of each of these channels the last message at or before a time, ns; channels that have none yet are left out.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn last(&self, channels: &[u16], time_ns: u64) -> Result<Vec<Stored>> {
        let mut wanted = channels.to_vec();
        let mut found = Vec::new();
        for (number, place) in self.chunks.iter().enumerate().rev() {
            if wanted.is_empty() {
                break;
            }
            if place.times[0] > time_ns || !wanted.iter().any(|channel| place.has(*channel)) {
                continue;
            }
            let messages = self.messages(number)?;
            wanted.retain(|channel| {
                let own = |m: &&Stored| m.channel == *channel && m.time_ns <= time_ns;
                match messages.iter().rev().find(own) {
                    Some(message) => {
                        found.push(message.clone());
                        false
                    }
                    None => true,
                }
            });
        }
        Ok(found)
    }

    /// Gives all messages of these channels from one time to another (ns, both included) in their order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn each(&self, channels: &[u16], [from, to]: [u64; 2], mut take: impl FnMut(&Stored)) -> Result {
        for (number, place) in self.chunks.iter().enumerate() {
            let apart = place.times[1] < from || place.times[0] > to;
            if apart || !channels.iter().any(|channel| place.has(*channel)) {
                continue;
            }
            let messages = self.messages(number)?;
            let own = |m: &&Stored| channels.contains(&m.channel) && (from..=to).contains(&m.time_ns);
            messages.iter().filter(own).for_each(&mut take);
        }
        Ok(())
    }
}

fn sorted(mut channels: Vec<u16>) -> Vec<u16> {
    channels.sort_unstable();
    channels.dedup();
    channels
}
