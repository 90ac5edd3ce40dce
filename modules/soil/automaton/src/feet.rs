//! The nodes below feet: their load, what still fits under them, and which of them have changed.

use crate::active::Marks;
use terraglue_ground::{Lattice, TILE_EDGE, UNIT_M};
use terraglue_soil_contact::{Covered, Ground};

/// Room of a node with open sky, units.
pub const OPEN: i32 = i32::MAX;
/// Inlet of a node with open sky, units.
pub const OPEN_INLET: i32 = OPEN / 16;
/// Load and room change in steps of so many units (61 µm), so that a foot at rest wakes nobody.
const QUANTUM: i32 = 256;

/// Largest flux over one of up to sixteen paths into a node in one pass, units.
#[inline]
pub fn inlet(room: i32) -> i32 {
    (room - room % QUANTUM) / 16
}

/// A node below a foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Indices.
    pub node: [i32; 2],
    /// Force-equivalent height, units.
    pub load: i32,
    /// What still fits below the foot's underside, units; 0: the foot stands here.
    pub room: i32,
}

impl Foot {
    fn new(node: &Covered, ground: &Ground) -> Self {
        let height = ground.heights.height(node.i, node.j);
        Self { node: [node.i, node.j], load: load_units(node), room: room_units(node, height) }
    }

    fn key(&self) -> (i32, i32) {
        (self.node[1], self.node[0])
    }

    /// What the rules see of it.
    fn seen(&self) -> (i32, i32) {
        (self.load, inlet(self.room))
    }
}

/// Force-equivalent height p/(N·ρ·g) = z·p/p_law(z) in units, in steps of [`QUANTUM`].
fn load_units(node: &Covered) -> i32 {
    if node.pressure <= 0.0 || node.virgin <= 0.0 {
        return 0;
    }
    let height = node.depth * (node.pressure / node.virgin).min(1.0);
    // a depth below a foot under pressure is not negative: the nearest step
    (height / (UNIT_M * f64::from(QUANTUM)) + 0.5) as i32 * QUANTUM
}

/// What fits between the ground and a foot that does not touch it, units; 0: the foot stands here and the node is closed.
fn room_units(node: &Covered, height: f64) -> i32 {
    const LARGEST: f64 = 65_536.0;
    if node.pressure > 0.0 { 0 } else { ((node.lower - height) / UNIT_M).clamp(1.0, LARGEST) as i32 }
}

/// All nodes below feet, by rows, and a bit for each.
#[derive(Clone, Debug)]
pub struct Feet {
    /// Sorted by j, then i.
    pub list: Vec<Foot>,
    before: Vec<Foot>,
    lattice: Lattice,
    covered: Vec<[u32; TILE_EDGE as usize]>,
}

impl Feet {
    /// None.
    pub fn new(lattice: Lattice, reserve: usize) -> Self {
        Self {
            list: Vec::with_capacity(reserve),
            before: Vec::with_capacity(reserve),
            lattice,
            covered: vec![[0; TILE_EDGE as usize]; lattice.tile_count()],
        }
    }

    /// Takes the nodes below feet of this step; marks those that the rules see differently now.
    pub fn take(&mut self, ground: &Ground, covered: &[Covered], changed: &mut Marks) {
        self.cover(false);
        std::mem::swap(&mut self.list, &mut self.before);
        self.list.clear();
        self.list.extend(covered.iter().map(|node| Foot::new(node, ground)));
        // runs of rows: a stable sort merges them; the heaviest of several feet over a node comes first
        self.list.sort_by(|a, b| a.key().cmp(&b.key()).then(a.room.cmp(&b.room)).then(b.load.cmp(&a.load)));
        self.list.dedup_by_key(|foot| foot.node);
        self.cover(true);
        self.compare(changed);
    }

    fn cover(&mut self, set: bool) {
        for foot in &self.list {
            let (tile, k) = self.lattice.locate(foot.node[0] as u32, foot.node[1] as u32);
            let (row, bit) = (k / TILE_EDGE as usize, 1 << (k % TILE_EDGE as usize));
            let row = &mut self.covered[tile][row];
            *row = if set { *row | bit } else { *row & !bit };
        }
    }

    fn compare(&self, changed: &mut Marks) {
        let (mut old, mut new) = (self.before.iter().peekable(), self.list.iter().peekable());
        loop {
            match (old.peek(), new.peek()) {
                (None, None) => return,
                (Some(a), Some(b)) if a.key() == b.key() => {
                    if a.seen() != b.seen() {
                        changed.mark(b.node);
                    }
                    old.next();
                    new.next();
                }
                (Some(a), b) if b.is_none_or(|b| a.key() < b.key()) => {
                    changed.mark(a.node);
                    old.next();
                }
                (_, Some(b)) => {
                    changed.mark(b.node);
                    new.next();
                }
                (Some(_), None) => return,
            }
        }
    }

    /// Whether a foot is above a node of the lattice.
    #[inline]
    pub fn above(&self, i: i32, j: i32) -> bool {
        let (tile, k) = self.lattice.locate(i as u32, j as u32);
        self.covered[tile][k / TILE_EDGE as usize] >> (k % TILE_EDGE as usize) & 1 == 1
    }

    /// Copies the list into `out`.
    pub fn save(&self, out: &mut Vec<Foot>) {
        out.clone_from(&self.list);
    }

    /// Back to a saved list.
    pub fn restore(&mut self, saved: &[Foot]) {
        self.cover(false);
        self.list.clear();
        self.list.extend_from_slice(saved);
        self.cover(true);
    }
}

terraglue_subsystem::persist!(Foot { node, load, room });
