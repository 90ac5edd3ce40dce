//! Messages of the streams of an isolated instance: those of the last step cross with its answer and are read from a copy.

use super::wire::{Reader, Writer};
use terraglue_subsystem::{Error, Message, Result, Subsystem};

/// The newest message of every stream, where the last step made one.
#[derive(Debug, Default)]
pub struct Messages {
    kept: Vec<Option<(f64, Vec<u8>)>>,
}

impl Messages {
    /// Room for that many streams.
    pub fn new(streams: usize) -> Self {
        Self { kept: vec![None; streams] }
    }

    /// In the worker: writes what the last step made.
    pub fn send(unit: &dyn Subsystem, w: &mut Writer) {
        for k in 0..unit.streams().len() {
            let message = unit.stream(k).ok().flatten();
            w.put(&u8::from(message.is_some()));
            if let Some(Message { time, bytes }) = message {
                w.put(&time);
                w.put(bytes);
            }
        }
    }

    /// In the host: takes it; nothing is allocated where the messages are not longer than before.
    pub fn receive(&mut self, r: &mut Reader) -> Option<()> {
        for place in &mut self.kept {
            if r.take::<u8>()? == 0 {
                *place = None;
                continue;
            }
            let time = r.take()?;
            let count: u32 = r.take()?;
            let bytes = r.bytes(count as usize)?;
            let (kept_time, kept) = place.get_or_insert_default();
            *kept_time = time;
            kept.clear();
            kept.extend_from_slice(bytes);
        }
        Some(())
    }

    /// The message of a stream.
    ///
    /// # Errors
    /// [`Error::Refused`]: there is no such stream.
    pub fn get(&self, k: usize) -> Result<Option<Message<'_>>> {
        let kept = self.kept.get(k).ok_or_else(|| Error::Refused(format!("no stream number {k}")))?;
        Ok(kept.as_ref().map(|(time, bytes)| Message { time: *time, bytes }))
    }
}
