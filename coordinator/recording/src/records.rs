//! Walks through a recording that may be cut off or damaged: what arrived whole is given, the rest left out.
//!
//! No length of the file is believed before it is compared with the bytes that are there, and the content of a
//! chunk is given only when its check sum is right. A damaged chunk is left out and the walk goes on behind it.

use mcap::McapResult;
use mcap::read::{ChannelAccumulator, parse_record};
use mcap::records::{Metadata, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// Opcode and length before every record.
pub(crate) const HEAD: usize = 9;
/// No chunk is larger when decompressed, bytes; a damaged size asks for no more memory than this.
const LARGEST_CHUNK: usize = 1 << 30;

/// An element of a recording.
pub(crate) enum Piece {
    /// A description.
    Metadata(Metadata),
    /// A message with its channel.
    Message(mcap::Message<'static>),
}

/// An iterator over the pieces of a recording.
pub(crate) struct Records<'a> {
    rest: &'a [u8],
    chunk: std::vec::IntoIter<Record<'static>>,
    channels: ChannelAccumulator<'static>,
    /// Parts that were left out because they are damaged; a last one that was cut off does not count.
    pub damaged: usize,
    /// Whether the end of the data was reached.
    pub ended: bool,
}

impl<'a> Records<'a> {
    /// Starts behind the magic; `None` where the bytes do not even begin like a recording.
    pub fn new(bytes: &'a [u8]) -> Option<Self> {
        let rest = bytes.strip_prefix(mcap::MAGIC)?;
        let channels = ChannelAccumulator::default();
        Some(Self { rest, chunk: Vec::new().into_iter(), channels, damaged: 0, ended: false })
    }

    /// The next record of the file that arrived whole, head included.
    fn next_record(&mut self) -> Option<&'a [u8]> {
        let length = self.rest.get(1..HEAD)?.try_into().map(u64::from_le_bytes).ok()?;
        let end = usize::try_from(length).ok()?.checked_add(HEAD)?;
        let (record, rest) = self.rest.split_at_checked(end)?;
        self.rest = rest;
        Some(record)
    }

    /// Opens one record of the file: the records of a chunk, or itself.
    fn open(&mut self) -> Option<()> {
        let record = self.next_record()?;
        let opened = match record[0] {
            op::CHUNK => chunk(record),
            opcode => parse_record(opcode, &record[HEAD..]).map(|r| vec![r.into_owned()]),
        };
        match opened {
            Ok(records) => self.chunk = records.into_iter(),
            Err(_) => self.damaged += 1,
        }
        Some(())
    }

    fn take(&mut self, record: Record<'static>) -> Option<Piece> {
        let taken = match record {
            Record::Metadata(metadata) => return Some(Piece::Metadata(metadata)),
            Record::Message { header, data } => {
                // The channel may have been announced in a part that is damaged.
                let channel = self.channels.get(header.channel_id)?;
                let (sequence, log_time, publish_time) =
                    (header.sequence, header.log_time, header.publish_time);
                return Some(Piece::Message(mcap::Message {
                    channel,
                    sequence,
                    log_time,
                    publish_time,
                    data,
                }));
            }
            Record::Schema { header, data } => self.channels.add_schema(header, data),
            Record::Channel(channel) => self.channels.add_channel(channel),
            Record::Unknown { .. } => {
                self.damaged += 1;
                Ok(())
            }
            Record::DataEnd(_) => {
                self.ended = true;
                Ok(())
            }
            _ => Ok(()),
        };
        self.damaged += usize::from(taken.is_err());
        None
    }
}

impl Iterator for Records<'_> {
    type Item = Piece;

    fn next(&mut self) -> Option<Piece> {
        while !self.ended {
            match self.chunk.next() {
                Some(record) => {
                    if let Some(piece) = self.take(record) {
                        return Some(piece);
                    }
                }
                None => self.open()?,
            }
        }
        None
    }
}

/// All records of a chunk whose check sum is right.
pub(crate) fn chunk(mut bytes: &[u8]) -> McapResult<Vec<Record<'static>>> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(LARGEST_CHUNK);
    let mut reader = LinearReader::new_with_options(options);
    let mut records = Vec::new();
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(wanted) => {
                let (now, later) = bytes.split_at(wanted.min(bytes.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                bytes = later;
            }
            LinearReadEvent::Record { data, opcode } => {
                records.push(parse_record(opcode, data)?.into_owned());
            }
        }
    }
    Ok(records)
}
