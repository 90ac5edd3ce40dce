//! Gives a recording that was cut off its footer, so that readers that need an index accept it.

use crate::error::Result;
use crate::recording::layout::{RECORDING, at, other_at};
use crate::recording::mcap_writer;
use mcap::read::{LinearReader, MessageStream, Options};
use mcap::records::{MessageHeader, Record};
use mcap::write::NoSeek;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Rewrites `recording.mcap` of a results folder with all messages that arrived whole and a footer. Does
/// nothing to a complete recording. Returns whether anything was mended.
pub fn mend(folder: &Path) -> Result<bool> {
    let path = folder.join(RECORDING);
    let bytes = std::fs::read(&path).map_err(at(&path))?;
    if mcap::read::footer(&bytes).is_ok() {
        return Ok(false);
    }
    let mended = folder.join("recording.mcap.mended");
    copy(&bytes, &mended).map_err(other_at(&path))?;
    std::fs::rename(&mended, &path).map_err(at(&path))?;
    Ok(true)
}

fn copy(bytes: &[u8], to: &Path) -> mcap::McapResult<()> {
    let out = NoSeek::new(BufWriter::new(File::create(to)?));
    let mut sink = mcap_writer::options().create(out)?;
    for record in LinearReader::new_with_options(bytes, Options::IgnoreEndMagic.into())? {
        match record {
            Ok(Record::Metadata(metadata)) => sink.write_metadata(&metadata)?,
            Ok(_) => {}
            Err(_) => break,
        }
    }
    let mut channels = BTreeMap::new();
    for message in MessageStream::new_with_options(bytes, Options::IgnoreEndMagic.into())? {
        let Ok(message) = message else { break };
        let channel_id = match channels.get(&message.channel.id) {
            Some(id) => *id,
            None => {
                let c = &message.channel;
                let schema = match &c.schema {
                    Some(s) => sink.add_schema(&s.name, &s.encoding, &s.data)?,
                    None => 0,
                };
                let id = sink.add_channel(schema, &c.topic, &c.message_encoding, &c.metadata)?;
                channels.insert(c.id, id);
                id
            }
        };
        let header = MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        sink.write_to_known_channel(&header, &message.data)?;
    }
    sink.finish()?;
    sink.into_inner().into_inner().flush()?;
    Ok(())
}
