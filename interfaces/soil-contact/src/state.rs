//! Numbered slots with exact copies of the committed state.

use crate::bookkeeping::Book;
use crate::contacts::Contacts;
use crate::ground::Ground;
use crate::nodes::NodesSnapshot;
use crate::wheel::Memory;
use terraglue_ground::HeightSnapshot;
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::{Error, Result};

/// One saved state.
#[derive(Debug, Default)]
struct Slot<S> {
    heights: HeightSnapshot,
    nodes: NodesSnapshot,
    wheels: Vec<Memory>,
    contacts: Contacts,
    loaded: Vec<[i32; 2]>,
    book: Book,
    parameters: Option<SoilParameters>,
    material: S,
}

/// What a slot holds beside the material's own state.
pub struct Committed<'a> {
    /// Heights and node states.
    pub ground: &'a mut Ground,
    /// Loaded nodes.
    pub loaded: &'a mut Vec<[i32; 2]>,
    /// Sums over the run.
    pub book: &'a mut Book,
    /// The laws' numbers, which may be changed during a run.
    pub parameters: &'a mut SoilParameters,
}

/// All slots of an instance.
#[derive(Debug)]
pub struct Slots<S> {
    slots: Vec<Slot<S>>,
}

impl<S: Default> Slots<S> {
    /// `count` empty slots.
    pub fn new(count: u32) -> Self {
        Self { slots: (0..count).map(|_| Slot::default()).collect() }
    }

    /// Copies the state into a slot; the place for the material's own state is returned.
    pub fn save(&mut self, slot: u32, state: &Committed) -> Result<&mut S> {
        let s = self.slots.get_mut(slot as usize).ok_or_else(|| unknown(slot))?;
        state.ground.heights.save(&mut s.heights);
        state.ground.nodes.save(&mut s.nodes);
        s.wheels.clone_from(&state.ground.wheels);
        s.contacts.clone_from(&state.ground.contacts);
        s.loaded.clone_from(state.loaded);
        s.book = *state.book;
        s.parameters = Some(*state.parameters);
        Ok(&mut s.material)
    }

    /// Copies a slot back; the material's own state is returned.
    pub fn restore(&self, slot: u32, state: &mut Committed) -> Result<&S> {
        let s = self.slots.get(slot as usize).ok_or_else(|| unknown(slot))?;
        *state.parameters = s.parameters.ok_or_else(|| unknown(slot))?;
        state.ground.heights.restore(&s.heights);
        state.ground.nodes.restore(&s.nodes);
        state.ground.wheels.clone_from(&s.wheels);
        state.ground.contacts.clone_from(&s.contacts);
        state.loaded.clone_from(&s.loaded);
        *state.book = s.book;
        Ok(&s.material)
    }
}

fn unknown(slot: u32) -> Error {
    Error::Refused(format!("nothing is saved in slot {slot}"))
}
