//! The ground of a soil: heights of its material and the memory of each node.

use crate::cone::Carried;
use crate::contacts::Contacts;
use crate::law_memory::LawMemory;
use crate::mask::Mask;
use crate::nodes::{NodeState, NodeStates};
use crate::wall::Push;
use crate::wheel::Memory;
use terraglue_ground::{HeightField, TILE_EDGE, UNIT_M};
use terraglue_subsystem::{Result, Terrain};

/// Wheels for which memory is allocated at the start.
const WHEELS: usize = 64;

/// A node below a foot, as committed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covered {
    /// Index along x.
    pub i: i32,
    /// Index along y.
    pub j: i32,
    /// World height of the foot's underside, m.
    pub lower: f64,
    /// Depth of the underside below the reference level, vertical, m.
    pub depth: f64,
    /// Pressure, Pa; 0: the foot does not touch here.
    pub pressure: f64,
    /// Pressure at which the soil yields at this depth, Pa; 0 where the foot does not touch, or where nobody asks.
    pub virgin: f64,
    /// Height of the unloaded surface, from the unrounded state, m; NaN where the foot does not touch.
    pub surface: f64,
    /// Horizontal part of the direction in which the underside moves, world x and y: displaced soil flows with it.
    pub flow: [f64; 2],
}

/// Heights and node states on one lattice.
#[derive(Clone, Debug)]
pub struct Ground {
    /// Heights of the material.
    pub heights: HeightField,
    /// Memory of the soil at its nodes.
    pub nodes: NodeStates,
    /// Wheels that have touched it.
    pub wheels: Vec<Memory>,
    /// Displacement of the soil beside contacts.
    pub pushes: Vec<Push>,
    /// Soil that moves with contacts.
    pub cones: Vec<Carried>,
    /// Results of the contacts.
    pub contacts: Contacts,
    /// Which soil lies where.
    pub mask: Mask,
    /// State of the law per node.
    pub law_memory: LawMemory,
}

impl Ground {
    /// The ground of a scenario, untouched.
    ///
    /// # Errors
    /// A terrain whose heights or sizes are out of range.
    pub fn new(terrain: &dyn Terrain) -> Result<Self> {
        let heights = HeightField::from_terrain(terrain)?;
        let nodes = NodeStates::new(*heights.lattice());
        Ok(Self {
            heights,
            nodes,
            wheels: Vec::with_capacity(WHEELS),
            pushes: Vec::with_capacity(WHEELS),
            cones: Vec::with_capacity(WHEELS),
            contacts: Contacts::default(),
            mask: Mask::default(),
            law_memory: LawMemory::default(),
        })
    }

    /// Height of a node at the start, m.
    #[inline]
    pub fn initial(&self, i: i32, j: i32) -> f64 {
        f64::from(self.heights.initial_units(i, j)) * UNIT_M
    }

    /// Reference level of the bed at a node, m: its surface where the soil was never pressed.
    #[inline]
    pub fn reference(&self, i: i32, j: i32, state: &NodeState) -> f64 {
        if state.loaded() {
            state.reference
        } else {
            self.heights.height(i, j) + state.remainder + state.permanent
        }
    }

    /// World height of the bed at a node and height of the loose soil on it, m; outside the lattice those of its edge.
    pub fn levels(&self, i: i32, j: i32) -> [f64; 2] {
        let lattice = self.heights.lattice();
        let (i, j) = lattice.clamp(i, j);
        let (tile, k) = lattice.locate(i, j);
        let loose = self.nodes.loose_left_at(tile, k);
        [f64::from(self.heights.units_at(tile, k)) * UNIT_M - loose, loose]
    }

    /// Height of the loose soil on a node of the lattice, units.
    #[inline]
    pub fn loose_units(&self, i: i32, j: i32) -> i32 {
        (self.nodes.get(i, j).loose_left() / UNIT_M).round() as i32
    }

    /// The state of a node on which a foot stands from now on, for writing.
    #[inline]
    pub fn enter(&mut self, i: i32, j: i32) -> &mut NodeState {
        let height = self.heights.height(i, j);
        let state = self.nodes.enter(i, j);
        if !state.loaded() {
            state.reference = height + state.remainder + state.permanent;
        }
        state
    }

    /// The foot has left node (i, j).
    pub fn leave(&mut self, i: i32, j: i32) {
        let height = self.heights.height(i, j);
        self.nodes.leave(i, j, height);
    }

    /// Height of the unloaded surface at a node in units, from its unrounded state.
    #[inline]
    pub fn surface_units(&self, i: i32, j: i32) -> i32 {
        let state = self.nodes.get(i, j);
        if !state.loaded() {
            return self.heights.units(i, j);
        }
        ((state.reference - state.permanent) / UNIT_M).round() as i32
    }

    /// Books `units` of material that came to a node without a foot (or went, < 0). Arriving material lies loose on the
    /// bed, which stays as it was pressed; loose soil leaves first.
    #[inline]
    pub fn add_material(&mut self, i: i32, j: i32, units: i32) {
        if units == 0 || !self.heights.lattice().has(i, j) {
            return;
        }
        let (tile, k) = self.heights.lattice().locate(i as u32, j as u32);
        self.add_material_at(tile, k, units);
    }

    /// The same at node k of a tile; its new height in units.
    #[inline]
    pub fn add_material_at(&mut self, tile: usize, k: usize, units: i32) -> i32 {
        let height = self.heights.add_units_at(tile, k, units);
        self.nodes.add_loose_at(tile, k, units);
        height
    }

    /// Puts the nodes from (i, j) on along x at `heights` (units), as [`Ground::add_material`] books it. All are nodes
    /// of the lattice. Returns their total gain, the sum of the single gains, and by how much the sum of the squares of the
    /// heights has grown: twice the gravitational energy. `told` is called with the index along x of every node that has
    /// changed.
    pub fn put_row(&mut self, i: i32, j: i32, heights: &[i32], mut told: impl FnMut(i32)) -> [i64; 3] {
        let (mut gained, mut moved, mut lifted) = (0, 0, 0);
        let (mut i, mut rest) = (i, heights);
        let mut changes = [0; TILE_EDGE as usize];
        while !rest.is_empty() {
            let (tile, first) = self.heights.lattice().locate(i as u32, j as u32);
            let n = rest.len().min(TILE_EDGE as usize - first % TILE_EDGE as usize);
            let (part, left) = rest.split_at(n);
            if self.heights.write_row(tile, first, part, &mut changes) {
                self.nodes.add_loose_row(tile, first, &changes[..n]);
                for (k, (height, change)) in (i..).zip(part.iter().zip(&changes[..n])) {
                    if *change != 0 {
                        told(k);
                    }
                    gained += i64::from(*change);
                    moved += i64::from((*change).max(0));
                    lifted += squares_grown(*height, *change);
                }
            }
            (i, rest) = (i + n as i32, left);
        }
        [gained, moved, lifted]
    }
}

/// By how much the square of a height (units) has grown, that is `height` after it has changed by `change`.
#[inline]
pub fn squares_grown(height: i32, change: i32) -> i64 {
    i64::from(change) * (2 * i64::from(height) - i64::from(change))
}
