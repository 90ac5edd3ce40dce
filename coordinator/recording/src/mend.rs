//! Gives a recording that was cut off its footer, so that readers that need an index accept it.

use crate::layout::{RECORDING, at, other_at};
use crate::mcap_writer;
use crate::records::{Piece, Records};
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use terraglue_diagnostics::error::Result;
use terraglue_scenario::InputError;

/// Whether the recording of a results folder has its end.
///
/// # Errors
/// It cannot be read.
pub fn has_end(folder: &Path) -> Result<bool> {
    let path = folder.join(RECORDING);
    let bytes = terraglue_subsystem::files::read(&path).map_err(at(&path))?;
    Ok(mcap::read::footer(&bytes).is_ok())
}

/// Rewrites `recording.mcap` of a results folder with all messages that arrived whole and a footer. Does
/// nothing to a complete recording, nor to one that is damaged before its end: rewritten, it would lose what
/// another program may still read. Returns whether anything was mended.
///
/// # Errors
/// [`Error::Input`](terraglue_diagnostics::Error::Input) when the file is empty or no MCAP recording; it is left as it is.
pub fn mend(folder: &Path) -> Result<bool> {
    let path = folder.join(RECORDING);
    let bytes = terraglue_subsystem::files::read(&path).map_err(at(&path))?;
    let Some(mut records) = Records::new(&bytes) else {
        let what = if bytes.is_empty() { "is empty" } else { "is not an MCAP recording" };
        let help = Some("the file was left as it is".into());
        return Err(InputError::plain(format!("`{}` {what}", path.display()), help).into());
    };
    if mcap::read::footer(&bytes).is_ok() {
        return Ok(false);
    }
    let mended = folder.join("recording.mcap.mended");
    let copied = copy(&mut records, &mended).map_err(other_at(&path));
    if copied.is_err() || records.damaged > 0 {
        std::fs::remove_file(&mended).map_err(at(&mended))?;
        return copied.map(|()| false);
    }
    std::fs::rename(&mended, &path).map_err(at(&path))?;
    Ok(true)
}

fn copy(records: &mut Records, to: &Path) -> mcap::McapResult<()> {
    let out = NoSeek::new(BufWriter::new(File::create(to)?));
    let mut sink = mcap_writer::options().create(out)?;
    let mut channels = BTreeMap::new();
    for piece in records {
        let message = match piece {
            Piece::Message(message) => message,
            Piece::Metadata(metadata) => {
                sink.write_metadata(&metadata)?;
                continue;
            }
        };
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
