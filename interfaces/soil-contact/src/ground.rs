//! The ground of a soil: heights of its material and what it remembers at each node.

use terraglue_ground::{HeightField, TileMap, UNIT_M};
use terraglue_soil_law::ShearState;
use terraglue_subsystem::{Result, Terrain};

/// Tiles of node states that can be touched before memory is asked for again.
const RESERVE_TILES: usize = 256;

/// What the soil remembers at a node. The default is untouched ground.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct NodeState {
    /// Reference level minus the height at the start where the node was pressed (`permanent` > 0), m.
    pub raised: f64,
    /// Depth of the unloaded surface below the reference level, m, vertical.
    pub permanent: f64,
    /// Largest depth along the normal that belongs to `permanent` under `curve`, m; a cache.
    pub largest: f64,
    /// Modulus of the pressure curve and n_z for which `largest` holds.
    pub curve: [f64; 2],
    /// Committed pressure, Pa; > 0: a foot stands here.
    pub pressure: f64,
    /// Shear history of the present contact.
    pub shear: ShearState,
    /// Number of the commit at which the node was last loaded.
    pub stamp: u64,
}

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
    /// Pressure of first loading at this depth, Pa.
    pub virgin: f64,
}

/// Heights and node states on one lattice.
#[derive(Clone, Debug)]
pub struct Ground {
    /// Heights of the material.
    pub heights: HeightField,
    /// What the soil remembers.
    pub nodes: TileMap<NodeState>,
}

impl Ground {
    /// The ground of a scenario, untouched.
    pub fn new(terrain: &dyn Terrain) -> Result<Self> {
        let heights = HeightField::from_terrain(terrain)?;
        let nodes = TileMap::new(*heights.lattice(), NodeState::default(), RESERVE_TILES);
        Ok(Self { heights, nodes })
    }

    /// Height of a node at the start, m.
    #[inline]
    pub fn initial(&self, i: i32, j: i32) -> f64 {
        f64::from(self.heights.initial_units(i, j)) * UNIT_M
    }

    /// Reference level of a node, m: the surface itself where the soil was never pressed.
    #[inline]
    pub fn reference(&self, i: i32, j: i32, state: &NodeState) -> f64 {
        if state.permanent > 0.0 { self.initial(i, j) + state.raised } else { self.heights.height(i, j) }
    }

    /// Height of the unloaded surface at a node in units, from its unrounded state.
    #[inline]
    pub fn surface_units(&self, i: i32, j: i32) -> i32 {
        let state = self.nodes.get(i, j);
        if state.permanent <= 0.0 {
            return self.heights.units(i, j);
        }
        let offset = (state.raised - state.permanent) / UNIT_M;
        self.heights.initial_units(i, j) + offset.round() as i32
    }

    /// Books `units` of material that came to an unloaded node (or went, < 0). What comes lies loose: it first fills
    /// the hollow that was pressed before and takes its compaction away; beyond that it raises the reference level.
    #[inline]
    pub fn add_material(&mut self, i: i32, j: i32, units: i32) {
        if units == 0 || !self.heights.lattice().has(i, j) {
            return;
        }
        self.heights.add_units(i, j, units);
        let (tile, k) = self.heights.lattice().locate(i as u32, j as u32);
        if self.nodes.tile(tile).is_some_and(|nodes| nodes[k].permanent > 0.0) {
            self.nodes.get_mut(i, j).add_loose(f64::from(units) * UNIT_M);
        }
    }
}

impl NodeState {
    fn add_loose(&mut self, change: f64) {
        let filled = change.clamp(0.0, self.permanent);
        self.permanent -= filled;
        self.raised += change - filled;
        self.curve = [0.0; 2];
    }
}
