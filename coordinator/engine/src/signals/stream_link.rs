//! Connections of streams: a message becomes the bytes of an input at the next communication point.
//!
//! Nothing waits for a message: where none has come, the input is not set and keeps what it has. Of several messages the
//! newest counts.

use super::access::VariableRef;
use super::modifier::Fate;
use terraglue_diagnostics::Result;
use terraglue_gluing::memory::{Recall, Remember};
use terraglue_host::{Instance, Reply};
use terraglue_scenario::{Connection, Extrapolate};
use terraglue_subsystem::{Causality, ValueType, Values};

/// One connection of a stream.
#[derive(Debug)]
pub struct StreamLink {
    /// Number of the stream among all of the run.
    stream: usize,
    to: VariableRef,
    /// The message on its way, where there is one.
    next: [Vec<u8>; 1],
    waits: bool,
    /// The message that the input got last, if any.
    told: [Vec<u8>; 1],
    was_told: bool,
}

impl StreamLink {
    /// From stream number `stream` to an input that was found to take it.
    pub fn new(stream: usize, to: VariableRef) -> Self {
        Self { stream, to, next: [Vec::new()], waits: false, told: [Vec::new()], was_told: false }
    }

    /// Number of the stream among all of the run.
    pub fn stream(&self) -> usize {
        self.stream
    }

    /// The input.
    pub fn to(&self) -> VariableRef {
        self.to
    }

    /// A message of the stream was made.
    pub fn take(&mut self, bytes: &[u8]) {
        self.next[0].clear();
        self.next[0].extend_from_slice(bytes);
        self.waits = true;
    }

    /// Applies what a fault does to the message on its way, if there is one.
    pub fn change(&mut self, fate: Fate) {
        match fate {
            Fate::Passes => {}
            Fate::Lost => self.waits = false,
            Fate::Again => {
                self.waits &= self.was_told;
                self.next[0].clone_from(&self.told[0]);
            }
        }
    }

    /// Sets the input to the message on its way, where there is one.
    ///
    /// # Errors
    /// A message that the subsystem refuses.
    pub fn pass_on(&mut self, instances: &mut [Instance]) -> Result {
        if !std::mem::take(&mut self.waits) {
            return Ok(());
        }
        std::mem::swap(&mut self.next, &mut self.told);
        self.was_told = true;
        let id = [self.to.describe(instances).id];
        let target = &mut instances[self.to.slot];
        match target.set(&id, Values::Binary(&self.told))? {
            Reply::Accepted => Ok(()),
            Reply::Refused(reason) => Err(target.error("set", reason)),
        }
    }

    /// The run begins: what came before is no message.
    pub fn forget(&mut self) {
        (self.waits, self.was_told) = (false, false);
    }

    /// For a snapshot.
    pub fn remember(&self, out: &mut Vec<u64>) {
        for (there, bytes) in [(self.waits, &self.next[0]), (self.was_told, &self.told[0])] {
            out.push(u64::from(there));
            if there {
                out.put_bytes(bytes);
            }
        }
    }

    /// Back to a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        let Self { next, waits, told, was_told, .. } = self;
        for (there, bytes) in [(waits, next), (was_told, told)] {
            *there = kept.word() != 0;
            if *there {
                kept.bytes(&mut bytes[0]);
            }
        }
    }
}

/// Why a stream cannot be connected to a variable.
pub fn check(
    connection: &Connection,
    instances: &[Instance],
    name: &str,
    (target, to): (&str, VariableRef),
) -> std::result::Result<(), String> {
    let v = to.describe(instances);
    if v.value_type != ValueType::Binary || v.causality != Causality::Input {
        return Err(format!("`{name}` is a stream and `{target}` no input of bytes (type binary)"));
    }
    if connection.extrapolate != Extrapolate::Constant {
        return Err(format!("`{name}` is a stream: it cannot be extrapolated"));
    }
    if !connection.map.is_empty() || (connection.factor, connection.offset) != (1.0, 0.0) {
        return Err(format!("`{name}` is a stream: it takes neither `map` nor `factor` and `offset`"));
    }
    Ok(())
}
