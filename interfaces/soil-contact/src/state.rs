//! Numbered slots with exact copies of the committed state.

use crate::bookkeeping::Book;
use crate::ground::{Ground, NodeState};
use terraglue_ground::{HeightSnapshot, TileMapSnapshot};
use terraglue_subsystem::{Error, Result};

/// One saved state.
#[derive(Debug, Default)]
struct Slot<S> {
    heights: HeightSnapshot,
    nodes: TileMapSnapshot<NodeState>,
    loaded: Vec<[i32; 2]>,
    book: Book,
    material: S,
    used: bool,
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

    /// Copies the ground and the book into a slot; the place for the material's own state is returned.
    pub fn save(&mut self, slot: u32, ground: &Ground, loaded: &[[i32; 2]], book: &Book) -> Result<&mut S> {
        let s = self.slots.get_mut(slot as usize).ok_or_else(|| unknown(slot))?;
        ground.heights.save(&mut s.heights);
        ground.nodes.save(&mut s.nodes);
        s.loaded.clear();
        s.loaded.extend_from_slice(loaded);
        s.book = *book;
        s.used = true;
        Ok(&mut s.material)
    }

    /// Copies a slot back; the material's own state is returned.
    pub fn restore(
        &self,
        slot: u32,
        ground: &mut Ground,
        loaded: &mut Vec<[i32; 2]>,
        book: &mut Book,
    ) -> Result<&S> {
        let s = self.slots.get(slot as usize).filter(|s| s.used).ok_or_else(|| unknown(slot))?;
        ground.heights.restore(&s.heights);
        ground.nodes.restore(&s.nodes);
        loaded.clear();
        loaded.extend_from_slice(&s.loaded);
        *book = s.book;
        Ok(&s.material)
    }
}

fn unknown(slot: u32) -> Error {
    Error::Refused(format!("nothing is saved in slot {slot}"))
}
