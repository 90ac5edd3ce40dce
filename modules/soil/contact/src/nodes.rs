//! Memory of the soil at its nodes: everything under a foot, one number at places where a foot has stood.
//!
//! Ground that was pressed outnumbers ground that is being pressed by far, so only the depth that stays is kept for
//! every node; the history of a contact lives in a list as long as the contact does.

use terraglue_ground::{Lattice, TILE_NODES, TileMap, TileMapSnapshot, UNIT_M};
use terraglue_soil_law::ShearState;
use terraglue_subsystem::Result;
use terraglue_subsystem::bytes::Persist;

/// Tiles of pressed ground, and nodes below feet, for which memory is allocated at the start.
const RESERVE_TILES: usize = 256;
const RESERVE_NODES: usize = 4096;
const RESERVE_INDEX: usize = 64;
const ABSENT: u32 = u32::MAX;

/// Memory of the soil at a node. The default is untouched ground.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct NodeState {
    /// Reference level while a foot stands here, m, not rounded; see [`crate::Ground::reference`].
    pub reference: f64,
    /// Unrounded height of the surface minus the booked one where no foot stands, m.
    pub remainder: f64,
    /// Depth of the unloaded surface below the reference level, m, vertical; below zero where loose soil lies higher.
    pub permanent: f64,
    /// By how much `permanent` exceeds the depth up to which the foot carries nothing, m, vertical, see
    /// `Spread::above`; 0 where no foot stands.
    pub above: f64,
    /// Half the range of the depths that the foot has printed into the cell so far, m, vertical; 0 where no foot stands.
    pub half: f64,
    /// The same of the print that lies here, or lay here when the present contact began.
    pub print: f64,
    /// Depth of the bed's surface below the reference level when the present contact began, m, vertical.
    pub bed: f64,
    /// Height of loose soil on the bed: where no foot stands now, else when the present contact began, m.
    pub loose: f64,
    /// Elastic energy of the soil here at the last commit, J.
    pub energy: f64,
    /// Area that carried pressure at the last commit, m².
    pub area: f64,
    /// Part of the cell in which the foot reached into the bed at the last commit.
    pub part: f64,
    /// Committed pressure, Pa; > 0: a foot stands here.
    pub pressure: f64,
    /// Shear history of the present contact.
    pub shear: ShearState,
    /// Number of the commit at which the node was last loaded; 0: no foot stands here.
    pub stamp: u64,
}

impl NodeState {
    /// Whether a foot stands here.
    #[inline]
    pub fn loaded(&self) -> bool {
        self.stamp != 0
    }

    /// Remainder of the loose soil, m: all that the foot has not pressed through.
    pub fn loose_left(&self) -> f64 {
        (self.bed - self.permanent).clamp(0.0, self.loose)
    }
}

/// Memory of a node that no foot stands on, in 80 bits: the permanent depth of the bed in sixteenths of a unit of
/// height (26 bits, to 1 m), the remainder of the surface in 1/16384 of a unit (14 bits), the height of the loose soil
/// on the bed in units (24 bits, to 4 m), exactly: it comes a few units at a time if steps are short, and half the
/// range of depths of the print in sixteen units (16 bits, to 25 cm). A foot that comes back finds its pressure to 1e-6
/// from a depth of a centimetre on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
struct Kept {
    bed: [u8; 5],
    loose: [u8; 3],
    print: [u8; 2],
}

impl Kept {
    const STEP: f64 = UNIT_M / 16.0;
    const DEEPEST: f64 = 67_108_863.0;
    const FINE: f64 = UNIT_M / 16_384.0;
    const FINE_BITS: u32 = 14;
    const HALF: i64 = 1 << (Self::FINE_BITS - 1);
    const MOST_LOOSE: i32 = (1 << 24) - 1;
    /// Units (3.8 µm).
    const TRICKLE: i32 = 16;

    /// Step of the range of a print, m.
    const PRINT: f64 = 16.0 * UNIT_M;

    fn new(permanent: f64, remainder: f64, loose: f64, print: f64) -> Self {
        let steps = (permanent / Self::STEP).round().clamp(0.0, Self::DEEPEST) as u64;
        let half = Self::HALF as f64;
        let fine = (remainder / Self::FINE).round().clamp(-half, half - 1.0) as i64 + Self::HALF;
        let loose = (loose / UNIT_M).round().clamp(0.0, f64::from(Self::MOST_LOOSE)) as i32;
        // numbers beyond the range of the type become its ends
        let print = ((print / Self::PRINT).round() as u16).to_le_bytes();
        Self { bed: Self::pack(steps, fine as u64), loose: [0; 3], print }.with_loose(loose)
    }

    #[inline]
    fn with_loose(self, units: i32) -> Self {
        let [a, b, c, _] = units.to_le_bytes();
        Self { loose: [a, b, c], ..self }
    }

    #[inline]
    fn loose_units(self) -> i32 {
        let [a, b, c] = self.loose;
        i32::from_le_bytes([a, b, c, 0])
    }

    /// Without depth nothing is kept of the bed.
    #[inline]
    fn pack(steps: u64, fine: u64) -> [u8; 5] {
        let [a, b, c, d, e, ..] = (steps << Self::FINE_BITS | fine).to_le_bytes();
        if steps == 0 { [0; 5] } else { [a, b, c, d, e] }
    }

    /// (steps of depth, fine steps of the remainder above their lowest).
    #[inline]
    fn unpack(self) -> (u64, u64) {
        let [a, b, c, d, e] = self.bed;
        let all = u64::from_le_bytes([a, b, c, d, e, 0, 0, 0]);
        (all >> Self::FINE_BITS, all & ((1 << Self::FINE_BITS) - 1))
    }

    fn permanent(self) -> f64 {
        self.unpack().0 as f64 * Self::STEP
    }

    fn remainder(self) -> f64 {
        match self.unpack() {
            (0, _) => 0.0,
            (_, fine) => (fine as i64 - Self::HALF) as f64 * Self::FINE,
        }
    }

    fn print(self) -> f64 {
        f64::from(u16::from_le_bytes(self.print)) * Self::PRINT
    }

    fn loose(self) -> f64 {
        f64::from(self.loose_units()) * UNIT_M
    }

    /// [`NodeState::loose_left`] of a node that no foot stands on.
    fn loose_left(self) -> f64 {
        let (bed, loose) = (self.permanent(), self.loose());
        (bed - (bed - loose)).clamp(0.0, loose)
    }

    /// After `units` of material have come to lie loose on the bed, or have gone from it (< 0), loose ones first. Arriving
    /// material counts to the unit, however little a short step brings. Leaving material counts in whole `TRICKLE`s, so that
    /// a slide of a few micrometres ends.
    #[inline]
    fn changed(self, units: i32) -> Self {
        let units = if units < 0 { units.div_euclid(Self::TRICKLE) * Self::TRICKLE } else { units };
        self.with_loose(self.loose_units().saturating_add(units).clamp(0, Self::MOST_LOOSE))
    }
}

/// Numbers of the contacts in a tile.
#[derive(Clone, Debug)]
struct Index {
    tile: u32,
    used: u32,
    places: Box<[u32; TILE_NODES]>,
}

/// The states of all nodes.
#[derive(Clone, Debug)]
pub struct NodeStates {
    kept: TileMap<Kept>,
    /// Per tile of the lattice its index; [`ABSENT`]: no foot stands in it.
    tiles: Vec<u32>,
    indices: Vec<Index>,
    spare: Vec<Index>,
    nodes: Vec<[i32; 2]>,
    contacts: Vec<NodeState>,
}

/// Exact copy of all states.
#[derive(Clone, Debug, Default)]
pub struct NodesSnapshot {
    kept: TileMapSnapshot<Kept>,
    nodes: Vec<[i32; 2]>,
    contacts: Vec<NodeState>,
}

impl NodesSnapshot {
    /// Nodes on which a foot stands.
    pub(crate) fn contacts(&self) -> impl Iterator<Item = &[i32; 2]> {
        self.nodes.iter()
    }
}

impl NodeStates {
    /// Untouched ground.
    pub fn new(lattice: Lattice) -> Self {
        let index = || Index { tile: 0, used: 0, places: Box::new([ABSENT; TILE_NODES]) };
        let count = lattice.tile_count();
        let mut spare = Vec::with_capacity(2 * RESERVE_INDEX);
        spare.extend((0..RESERVE_INDEX.min(count)).map(|_| index()));
        Self {
            kept: TileMap::new(lattice, Kept::default(), RESERVE_TILES),
            tiles: vec![ABSENT; count],
            indices: Vec::with_capacity(2 * RESERVE_INDEX),
            spare,
            nodes: Vec::with_capacity(RESERVE_NODES),
            contacts: Vec::with_capacity(RESERVE_NODES),
        }
    }

    #[inline]
    fn place(&self, i: i32, j: i32) -> (usize, usize, u32) {
        let lattice = self.kept.lattice();
        let (i, j) = lattice.clamp(i, j);
        let (tile, k) = lattice.locate(i, j);
        (tile, k, self.place_at(tile, k))
    }

    #[inline]
    fn place_at(&self, tile: usize, k: usize) -> u32 {
        match self.tiles[tile] {
            ABSENT => ABSENT,
            index => self.indices[index as usize].places[k],
        }
    }

    /// Remainder of the loose soil at node k of a tile, m.
    #[inline]
    pub fn loose_left_at(&self, tile: usize, k: usize) -> f64 {
        match self.place_at(tile, k) {
            ABSENT => self.kept.tile(tile).map_or(0.0, |tile| tile[k].loose_left()),
            place => self.contacts[place as usize].loose_left(),
        }
    }

    /// State of node (i, j); indices outside read the nearest node of the edge.
    #[inline]
    pub fn get(&self, i: i32, j: i32) -> NodeState {
        let (tile, k, place) = self.place(i, j);
        if place != ABSENT {
            return self.contacts[place as usize];
        }
        let kept = self.kept.tile(tile).map_or(Kept::default(), |tile| tile[k]);
        let (bed, loose, print) = (kept.permanent(), kept.loose(), kept.print());
        let remainder = kept.remainder();
        NodeState { permanent: bed - loose, bed, loose, remainder, print, ..NodeState::default() }
    }

    /// The state of a node where a foot stands, for writing; made when it is not there.
    #[inline]
    pub fn enter(&mut self, i: i32, j: i32) -> &mut NodeState {
        let (tile, k, mut place) = self.place(i, j);
        if place == ABSENT {
            let state = self.get(i, j);
            place = self.contacts.len() as u32;
            self.contacts.push(state);
            self.nodes.push([i, j]);
            self.list(tile, k, place);
        }
        &mut self.contacts[place as usize]
    }

    /// The state of a node where a foot stands, for writing.
    #[inline]
    pub fn get_mut(&mut self, i: i32, j: i32) -> Option<&mut NodeState> {
        let (_, _, place) = self.place(i, j);
        self.contacts.get_mut(place as usize)
    }

    fn list(&mut self, tile: usize, k: usize, place: u32) {
        if self.tiles[tile] == ABSENT {
            let index = self.spare.pop();
            let mut index =
                index.unwrap_or_else(|| Index { tile: 0, used: 0, places: Box::new([ABSENT; TILE_NODES]) });
            index.tile = tile as u32;
            self.tiles[tile] = self.indices.len() as u32;
            self.indices.push(index);
        }
        let index = &mut self.indices[self.tiles[tile] as usize];
        index.used += u32::from(index.places[k] == ABSENT);
        index.places[k] = place;
    }

    /// The foot has left node (i, j), whose booked height is `height` (m): only the depth that stays is kept.
    pub fn leave(&mut self, i: i32, j: i32, height: f64) {
        let (tile, k, place) = self.place(i, j);
        if place == ABSENT {
            return;
        }
        self.nodes.swap_remove(place as usize);
        let state = self.contacts.swap_remove(place as usize);
        if let Some([i, j]) = self.nodes.get(place as usize).copied() {
            let (tile, k, _) = self.place(i, j);
            self.list(tile, k, place);
        }
        self.unlist(tile, k);
        let (above, left) = (height - (state.reference - state.permanent), state.loose_left());
        // material that has flowed into a print under an unloaded foot lies loose
        let flowed = if state.pressure > 0.0 { 0.0 } else { ((above / UNIT_M).round() * UNIT_M).max(0.0) };
        let kept = Kept::new(state.permanent + left, flowed - above, left + flowed, state.half);
        self.keep(tile, k, kept);
    }

    fn keep(&mut self, tile: usize, k: usize, kept: Kept) {
        if kept != Kept::default() || self.kept.tile(tile).is_some() {
            self.kept.tile_mut(tile)[k] = kept;
        }
    }

    fn unlist(&mut self, tile: usize, k: usize) {
        let number = self.tiles[tile];
        let index = &mut self.indices[number as usize];
        index.places[k] = ABSENT;
        index.used -= 1;
        if index.used == 0 {
            self.tiles[tile] = ABSENT;
            self.spare.push(self.indices.swap_remove(number as usize));
            if let Some(moved) = self.indices.get(number as usize) {
                self.tiles[moved.tile as usize] = number;
            }
        }
    }

    /// `units` of material came to node (i, j) or went (< 0), where no foot stands: arriving material lies loose.
    #[inline]
    pub fn add_loose(&mut self, i: i32, j: i32, units: i32) {
        let (tile, k, _) = self.place(i, j);
        self.add_loose_at(tile, k, units);
    }

    /// The same at node k of a tile.
    #[inline]
    pub fn add_loose_at(&mut self, tile: usize, k: usize, units: i32) {
        if self.place_at(tile, k) == ABSENT && (units > 0 || self.kept.tile(tile).is_some()) {
            let kept = &mut self.kept.tile_mut(tile)[k];
            *kept = kept.changed(units);
        }
    }

    /// The same for nodes of a tile from place `first` on; nodes with a foot neither gain nor lose.
    pub fn add_loose_row(&mut self, tile: usize, first: usize, units: &[i32]) {
        if units.iter().any(|u| *u > 0) || self.kept.tile(tile).is_some() {
            // where a foot stands the kept numbers are not read until it leaves, which writes them
            let kept = &mut self.kept.tile_mut(tile)[first..];
            for (kept, units) in kept.iter_mut().zip(units).filter(|(_, units)| **units != 0) {
                *kept = kept.changed(*units);
            }
        }
    }

    /// Copies all states into `out`.
    pub fn save(&self, out: &mut NodesSnapshot) {
        self.kept.save(&mut out.kept);
        out.nodes.clone_from(&self.nodes);
        out.contacts.clone_from(&self.contacts);
    }

    /// Back to a saved state.
    pub fn restore(&mut self, saved: &NodesSnapshot) {
        self.kept.restore(&saved.kept);
        for mut index in self.indices.drain(..) {
            self.tiles[index.tile as usize] = ABSENT;
            index.places.fill(ABSENT);
            index.used = 0;
            self.spare.push(index);
        }
        self.nodes.clone_from(&saved.nodes);
        self.contacts.clone_from(&saved.contacts);
        for place in 0..self.nodes.len() {
            let [i, j] = self.nodes[place];
            let (tile, k, _) = self.place(i, j);
            self.list(tile, k, place as u32);
        }
    }
}

terraglue_subsystem::persist!(NodeState {
    reference,
    remainder,
    permanent,
    above,
    half,
    print,
    bed,
    loose,
    energy,
    area,
    part,
    pressure,
    shear,
    stamp,
});

impl Persist for Kept {
    fn write(&self, out: &mut Vec<u8>) {
        let ([a, b, c, d, e], [f, g, h]) = (self.bed, self.loose);
        u64::from_le_bytes([a, b, c, d, e, f, g, h]).write(out);
        u16::from_le_bytes(self.print).write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let [a, b, c, d, e, f, g, h] = u64::read(from)?.to_le_bytes();
        Ok(Self { bed: [a, b, c, d, e], loose: [f, g, h], print: u16::read(from)?.to_le_bytes() })
    }
}

impl Persist for NodesSnapshot {
    fn write(&self, out: &mut Vec<u8>) {
        self.kept.write(out);
        self.nodes.write(out);
        self.contacts.iter().for_each(|c| c.write(out));
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let (kept, nodes) = (Persist::read(from)?, Vec::<[i32; 2]>::read(from)?);
        let contacts = nodes.iter().map(|_| NodeState::read(from)).collect::<Result<_>>()?;
        Ok(Self { kept, nodes, contacts })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        /// However short the steps are in which it comes.
        #[test]
        fn loose_soil_is_kept_to_the_unit(
            depth in 0.0..0.1f64, changes in prop::collection::vec(prop_oneof![1 => -100..0i32, 4 => 0..40i32], 1..200),
        ) {
            let mut kept = Kept::new(depth, 0.0, 0.0, 0.0);
            let mut units = 0_i32;
            for change in changes {
                kept = kept.changed(change);
                let gone = change.min(0).div_euclid(Kept::TRICKLE) * Kept::TRICKLE;
                units = (units + gone + change.max(0)).max(0);
            }
            prop_assert_eq!(kept.loose(), f64::from(units) * UNIT_M);
            prop_assert_eq!(kept.permanent(), Kept::new(depth, 0.0, 0.0, 0.0).permanent());
            prop_assert_eq!(Kept::new(depth, 0.0, kept.loose(), 0.0).loose_units(), units);
        }

        #[test]
        fn contacts_come_and_go_and_leave_their_depth(
            actions in prop::collection::vec((0..40i32, 0..40i32, 0..4u32, 0.0..0.1f64), 1..300),
        ) {
            let lattice = Lattice { origin: [0.0; 2], spacing: 0.01, size: [40, 40] };
            let mut states = NodeStates::new(lattice);
            let mut model: BTreeMap<(i32, i32), (bool, f64)> = BTreeMap::new();
            let mut saved = (NodesSnapshot::default(), model.clone());
            states.save(&mut saved.0);
            for (i, j, action, depth) in actions {
                let entry = model.entry((i, j)).or_default();
                match action {
                    0 | 1 => {
                        let state = states.enter(i, j);
                        (state.permanent, state.bed, state.reference, state.stamp) = (depth, depth, depth, 1);
                        *entry = (true, depth);
                    }
                    2 => {
                        states.leave(i, j, 0.0);
                        *entry = (false, Kept::new(entry.1, 0.0, 0.0, 0.0).permanent());
                    }
                    _ if depth < 0.01 => {
                        states.restore(&saved.0);
                        model = saved.1.clone();
                    }
                    _ => {
                        states.save(&mut saved.0);
                        saved.1.clone_from(&model);
                    }
                }
            }
            for j in 0..40 {
                for i in 0..40 {
                    let (loaded, depth) = model.get(&(i, j)).copied().unwrap_or_default();
                    prop_assert_eq!(states.get(i, j).loaded(), loaded);
                    prop_assert_eq!(states.get(i, j).permanent, depth);
                }
            }
        }
    }
}
