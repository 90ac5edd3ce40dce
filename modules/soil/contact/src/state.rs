//! Exact copies of the committed state: in numbered slots, and as bytes.

use crate::bookkeeping::EnergyLedger;
use crate::cone::Carried;
use crate::contacts::Contacts;
use crate::ground::Ground;
use crate::law_memory::LawMemorySnapshot;
use crate::nodes::NodesSnapshot;
use crate::wall::Push;
use crate::wheel::Memory;
use terraglue_ground::HeightSnapshot;
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::bytes::{self, Persist};
use terraglue_subsystem::{Error, Result};

/// Version of the bytes.
const VERSION: u32 = 9;

/// One saved state; `S` is the material's own.
#[derive(Debug, Default)]
pub struct Slot<S> {
    heights: HeightSnapshot,
    nodes: NodesSnapshot,
    wheels: Vec<Memory>,
    pushes: Vec<Push>,
    cones: Vec<Carried>,
    contacts: Contacts,
    law_memory: LawMemorySnapshot,
    loaded: Vec<[i32; 2]>,
    ledger: EnergyLedger,
    parameters: Option<SoilParameters>,
    /// The material's own state.
    pub material: S,
}

impl<S: Persist> Persist for Slot<S> {
    fn write(&self, out: &mut Vec<u8>) {
        let Self { heights, nodes, wheels, pushes, cones, contacts, law_memory, .. } = self;
        heights.write(out);
        nodes.write(out);
        wheels.write(out);
        pushes.write(out);
        cones.write(out);
        contacts.write(out);
        let Self { loaded, ledger, parameters, material, .. } = self;
        law_memory.write(out);
        loaded.write(out);
        ledger.write(out);
        parameters.write(out);
        material.write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        Ok(Self {
            heights: Persist::read(from)?,
            nodes: Persist::read(from)?,
            wheels: Persist::read(from)?,
            pushes: Persist::read(from)?,
            cones: Persist::read(from)?,
            contacts: Persist::read(from)?,
            law_memory: Persist::read(from)?,
            loaded: Persist::read(from)?,
            ledger: Persist::read(from)?,
            parameters: Persist::read(from)?,
            material: Persist::read(from)?,
        })
    }
}

/// Content of a slot apart from the material's own state.
pub struct Committed<'a> {
    /// Heights and node states.
    pub ground: &'a Ground,
    /// Loaded nodes.
    pub loaded: &'a Vec<[i32; 2]>,
    /// Sums over the run.
    pub ledger: &'a EnergyLedger,
    /// The laws' numbers, which may be changed during a run.
    pub parameters: &'a SoilParameters,
}

/// The same to be overwritten.
pub struct Target<'a> {
    /// Heights and node states.
    pub ground: &'a mut Ground,
    /// Loaded nodes.
    pub loaded: &'a mut Vec<[i32; 2]>,
    /// Sums over the run.
    pub ledger: &'a mut EnergyLedger,
    /// The laws' numbers.
    pub parameters: &'a mut SoilParameters,
}

impl<S> Slot<S> {
    /// Copies the state; the material's own is left to the caller.
    pub fn fill(&mut self, state: &Committed) {
        state.ground.heights.save(&mut self.heights);
        state.ground.nodes.save(&mut self.nodes);
        state.ground.law_memory.save(&mut self.law_memory);
        self.wheels.clone_from(&state.ground.wheels);
        self.pushes.clone_from(&state.ground.pushes);
        self.cones.clone_from(&state.ground.cones);
        self.contacts.clone_from(&state.ground.contacts);
        self.loaded.clone_from(state.loaded);
        self.ledger = *state.ledger;
        self.parameters = Some(*state.parameters);
    }

    /// Copies it back; the material's own is left to the caller.
    ///
    /// # Errors
    /// It was never filled.
    pub fn put_back(&self, state: &mut Target) -> Result {
        let empty = || Error::Refused("nothing is saved in this slot".into());
        *state.parameters = self.parameters.ok_or_else(empty)?;
        state.ground.heights.restore(&self.heights);
        state.ground.nodes.restore(&self.nodes);
        state.ground.law_memory.restore(&self.law_memory);
        state.ground.wheels.clone_from(&self.wheels);
        state.ground.pushes.clone_from(&self.pushes);
        state.ground.cones.clone_from(&self.cones);
        state.ground.contacts.clone_from(&self.contacts);
        state.loaded.clone_from(&self.loaded);
        *state.ledger = self.ledger;
        Ok(())
    }
}

impl<S: Persist> Slot<S> {
    /// As bytes that only a soil on the same ground takes.
    pub fn to_bytes(&self, ground: &Ground) -> Vec<u8> {
        bytes::seal(VERSION, mark(ground), self)
    }

    /// Back from such bytes.
    ///
    /// # Errors
    /// `Refused`: cut, changed, of another ground, or about nodes that the ground does not have.
    pub fn from_bytes(from: &[u8], ground: &Ground) -> Result<Self> {
        let slot: Self = bytes::open(VERSION, mark(ground), from)?;
        let lattice = ground.heights.lattice();
        let inside = |[i, j]: &[i32; 2]| lattice.has(*i, *j);
        let tiles = slot.heights.tiles().all(|(t, _)| (t as usize) < lattice.tile_count());
        let nodes = slot.nodes.contacts().all(inside) && slot.loaded.iter().all(inside);
        if !slot.law_memory.fits(&ground.law_memory) {
            Err(bytes::wrong("they hold the state of another law"))
        } else if tiles && nodes && slot.parameters.is_some() {
            Ok(slot)
        } else {
            Err(bytes::wrong("they speak of nodes that this ground does not have"))
        }
    }
}

/// Of the ground at its start: where its nodes lie, and how high.
fn mark(ground: &Ground) -> u64 {
    let lattice = ground.heights.lattice();
    let mut all = Vec::new();
    (lattice.origin, [lattice.spacing]).write(&mut all);
    lattice.size.write(&mut all);
    for j in 0..lattice.size[1] as i32 {
        for i in 0..lattice.size[0] as i32 {
            ground.heights.initial_units(i, j).write(&mut all);
        }
        let row = bytes::hash(&all);
        all.clear();
        row.write(&mut all);
    }
    bytes::hash(&all)
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

    /// A slot to be filled.
    pub fn get_mut(&mut self, slot: u32) -> Result<&mut Slot<S>> {
        self.slots.get_mut(slot as usize).ok_or_else(|| unknown(slot))
    }

    /// A slot to be put back.
    pub fn get(&self, slot: u32) -> Result<&Slot<S>> {
        let filled = self.slots.get(slot as usize).filter(|s| s.parameters.is_some());
        filled.ok_or_else(|| unknown(slot))
    }
}

fn unknown(slot: u32) -> Error {
    Error::Refused(format!("nothing is saved in slot {slot}"))
}
