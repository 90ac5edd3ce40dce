//! Messages of the streams of an isolated instance: those of the last step cross with its answer and are read from a copy.

use super::wire::{Reader, Writer};
use terraglue_subsystem::{Error, Message, Result, Subsystem};

/// The newest message of every stream, where the last step made one.
#[derive(Debug, Default)]
pub struct Messages {
    kept: Vec<Option<(f64, Vec<u8>)>>,
    /// Error of each instead of a message.
    wrong: Vec<Option<String>>,
}

/// First byte of a message on its way.
const NONE: u8 = 0;
const THERE: u8 = 1;
const FAILED: u8 = 2;

impl Messages {
    /// Room for that many streams.
    pub fn new(streams: usize) -> Self {
        Self { kept: vec![None; streams], wrong: vec![None; streams] }
    }

    /// In the worker: writes what the last step made.
    pub fn send(unit: &dyn Subsystem, w: &mut Writer) {
        for k in 0..unit.streams().len() {
            match unit.stream(k) {
                Ok(None) => w.put(&NONE),
                Ok(Some(Message { time, bytes })) => {
                    w.put(&THERE);
                    w.put(&time);
                    w.put(bytes);
                }
                Err(e) => {
                    w.put(&FAILED);
                    w.put(&e.to_string());
                }
            }
        }
    }

    /// In the host: takes it; nothing is allocated where the messages are not longer than before.
    pub fn receive(&mut self, r: &mut Reader) -> Option<()> {
        for (place, wrong) in self.kept.iter_mut().zip(&mut self.wrong) {
            let begins = r.take::<u8>()?;
            *wrong = if begins == FAILED { Some(r.take()?) } else { None };
            if begins != THERE {
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
    /// [`Error::Refused`]: there is no such stream. [`Error::Failed`]: the instance could not provide the message.
    pub fn get(&self, k: usize) -> Result<Option<Message<'_>>> {
        let kept = self.kept.get(k).ok_or_else(|| Error::Refused(format!("no stream number {k}")))?;
        if let Some(Some(why)) = self.wrong.get(k) {
            return Err(Error::Failed(why.clone()));
        }
        Ok(kept.as_ref().map(|(time, bytes)| Message { time: *time, bytes }))
    }
}
