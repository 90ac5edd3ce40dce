//! States that a master has saved: numbers of slots in the subsystem, with the FMU's own part of the state.

use super::{Answer, Phase, wrong};

/// Handle of a saved state, held by the master: not a pointer, so a stale or foreign one is detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handle(pub usize);

/// State of the FMU apart from that of its subsystem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    pub time: f64,
    pub index: u64,
    pub phase: Phase,
}

/// All states saved by one instance.
#[derive(Debug)]
pub(super) struct States {
    /// Distinguishes the handles of instances.
    instance: usize,
    moments: Vec<Option<Moment>>,
}

/// Bits of a handle that hold the slot.
const SLOT_BITS: u32 = 16;

impl States {
    /// `slots` are those of the subsystem; the last one is kept for the FMU itself.
    pub fn new(instance: usize, slots: u32) -> Self {
        Self { instance, moments: vec![None; slots.saturating_sub(1) as usize] }
    }

    /// Slot that no master can hold.
    pub fn spare(&self) -> u32 {
        self.moments.len() as u32
    }

    /// A free slot.
    pub fn free_slot(&self) -> Answer<u32> {
        match self.moments.iter().position(Option::is_none) {
            Some(slot) => Ok(slot as u32),
            None => wrong(format!("{} states are saved already; free one first", self.moments.len())),
        }
    }

    /// Stores the moment that belongs to a slot.
    pub fn keep(&mut self, slot: u32, moment: Moment) -> Handle {
        if let Some(place) = self.moments.get_mut(slot as usize) {
            *place = Some(moment);
        }
        Handle(self.instance << SLOT_BITS | (slot as usize + 1))
    }

    /// Slot and moment of a handle.
    pub fn find(&self, handle: Handle) -> Answer<(u32, Moment)> {
        let slot = (handle.0 & ((1 << SLOT_BITS) - 1)).wrapping_sub(1);
        let own = handle.0 >> SLOT_BITS == self.instance;
        match self.moments.get(slot).copied().flatten().filter(|_| own) {
            Some(moment) => Ok((slot as u32, moment)),
            None => wrong("this state was not saved by this instance, or is freed"),
        }
    }

    /// Forgets a state.
    pub fn release(&mut self, handle: Handle) -> Answer {
        let (slot, _) = self.find(handle)?;
        self.moments[slot as usize] = None;
        Ok(())
    }
}
