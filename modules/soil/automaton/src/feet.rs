//! The nodes below feet: their load, the room left under them, and which of them have changed.

use crate::active::Marks;
use std::cmp::Ordering;
use terraglue_ground::{Lattice, TILE_EDGE, UNIT_M};
use terraglue_soil_contact::{Covered, Ground};

/// Room of a node with open sky, units.
pub const OPEN: i32 = i32::MAX;
/// Inlet of a node with open sky, units.
pub const OPEN_INLET: i32 = OPEN / 16;
/// Load and room change in steps of so many units (61 µm), so that a foot at rest wakes no node.
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
    /// Room below the foot's underside, units; 0: the foot stands here.
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

    /// By rows; the heaviest of several feet over a node comes first.
    fn order(&self, other: &Self) -> Ordering {
        let same_node = || self.room.cmp(&other.room).then(other.load.cmp(&self.load));
        self.key().cmp(&other.key()).then_with(same_node)
    }

    /// Values of it that the rules see.
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

/// Room between the ground and a foot that does not touch it, units; 0: the foot stands here and the node is closed.
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
    runs: Runs,
    lattice: Lattice,
    covered: Vec<[u32; TILE_EDGE as usize]>,
}

impl Feet {
    /// None.
    pub fn new(lattice: Lattice, reserve: usize) -> Self {
        Self {
            list: Vec::with_capacity(reserve),
            before: Vec::with_capacity(reserve),
            runs: Runs { merged: Vec::with_capacity(reserve), ends: Vec::with_capacity(RUNS) },
            lattice,
            covered: vec![[0; TILE_EDGE as usize]; lattice.tile_count()],
        }
    }

    /// Takes the nodes below feet of this step; marks those that the rules see differently now.
    pub fn take(&mut self, ground: &Ground, covered: &[Covered], changed: &mut Marks) {
        std::mem::swap(&mut self.list, &mut self.before);
        self.list.clear();
        self.list.extend(covered.iter().map(|node| Foot::new(node, ground)));
        self.runs.sort(&mut self.list);
        self.list.dedup_by_key(|foot| foot.node);
        self.compare(changed);
    }

    fn cover(&mut self, set: bool) {
        for foot in &self.list {
            put(&mut self.covered, &self.lattice, foot.node, set);
        }
    }

    /// Marks the nodes that are seen differently, and brings the bits from the list before to that of now.
    fn compare(&mut self, changed: &mut Marks) {
        let Self { list, before, covered, lattice, .. } = self;
        let (mut old, mut new) = (before.iter().peekable(), list.iter().peekable());
        loop {
            let side = match (old.peek(), new.peek()) {
                (None, None) => return,
                (Some(a), Some(b)) => a.key().cmp(&b.key()),
                (Some(_), None) => Ordering::Less,
                (None, Some(_)) => Ordering::Greater,
            };
            let gone = old.next_if(|_| side.is_le());
            let here = new.next_if(|_| side.is_ge());
            match (gone, here) {
                (Some(a), Some(b)) if a.seen() != b.seen() => changed.mark(b.node),
                (Some(a), None) => {
                    changed.mark(a.node);
                    put(covered, lattice, a.node, false);
                }
                (None, Some(b)) => {
                    changed.mark(b.node);
                    put(covered, lattice, b.node, true);
                }
                _ => {}
            }
        }
    }

    /// Whether a foot is above a node of the lattice.
    #[inline]
    pub fn above(&self, i: i32, j: i32) -> bool {
        let (tile, k) = self.lattice.locate(i as u32, j as u32);
        self.above_at(tile, k)
    }

    /// The same of node k of a tile.
    #[inline]
    pub fn above_at(&self, tile: usize, k: usize) -> bool {
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

/// Sets or clears the bit of a node.
fn put(covered: &mut [[u32; TILE_EDGE as usize]], lattice: &Lattice, node: [i32; 2], set: bool) {
    let (tile, k) = lattice.locate(node[0] as u32, node[1] as u32);
    let (row, bit) = (k / TILE_EDGE as usize, 1 << (k % TILE_EDGE as usize));
    let row = &mut covered[tile][row];
    *row = if set { *row | bit } else { *row & !bit };
}

/// Runs for which memory is allocated at the start.
const RUNS: usize = 64;

/// Sorts a list of a few runs that are in order: every foot lists its nodes by rows.
#[derive(Clone, Debug)]
struct Runs {
    merged: Vec<Foot>,
    /// End of each run.
    ends: Vec<usize>,
}

impl Runs {
    /// Neighbouring runs are merged until one is left.
    fn sort(&mut self, list: &mut Vec<Foot>) {
        let breaks = list.windows(2).zip(1..).filter(|(pair, _)| pair[0].order(&pair[1]).is_gt());
        self.ends.clear();
        self.ends.extend(breaks.map(|(_, place)| place).chain([list.len()]));
        while self.ends.len() > 1 {
            self.merged.clear();
            let mut first = 0;
            for pair in self.ends.chunks(2) {
                let last = pair[pair.len() - 1];
                merge(&list[first..pair[0]], &list[pair[0]..last], &mut self.merged);
                first = last;
            }
            let mut kept = 0;
            let count = self.ends.len();
            self.ends.retain(|_| {
                kept += 1;
                kept % 2 == 0 || kept == count
            });
            std::mem::swap(list, &mut self.merged);
        }
    }
}

/// Appends two lists in order as one.
fn merge(mut a: &[Foot], mut b: &[Foot], out: &mut Vec<Foot>) {
    while let ([x, rest_a @ ..], [y, rest_b @ ..]) = (a, b) {
        if y.order(x).is_lt() {
            out.push(*y);
            b = rest_b;
        } else {
            out.push(*x);
            a = rest_a;
        }
    }
    out.extend_from_slice(a);
    out.extend_from_slice(b);
}

terraglue_subsystem::persist!(Foot { node, load, room });

#[cfg(test)]
mod tests {
    use super::*;

    /// Feet of a few runs by rows, some of them over the same nodes.
    fn feet(runs: &[(i32, i32, i32)]) -> Vec<Foot> {
        let foot = |k: i32, (i, j, width): (i32, i32, i32)| Foot {
            node: [i + k % width, j + k / width],
            load: 256 * (k % 3),
            room: (k * width) % 2,
        };
        runs.iter().flat_map(|run| (0..run.2 * run.2).map(move |k| foot(k, *run))).collect()
    }

    #[test]
    fn runs_are_merged_to_the_order_that_sorting_gives() {
        let mut runs = Runs { merged: Vec::new(), ends: Vec::new() };
        let mut backwards = feet(&[(9, 9, 4), (3, 3, 5)]);
        backwards.reverse();
        let lists = [
            Vec::new(),
            feet(&[(5, 5, 6)]),
            feet(&[(50, 5, 6), (5, 5, 6)]),
            feet(&[(5, 40, 6), (52, 5, 7), (5, 5, 6), (6, 7, 5), (30, 5, 3)]),
            backwards,
        ];
        for list in lists {
            let (mut own, mut sorted) = (list.clone(), list);
            runs.sort(&mut own);
            sorted.sort_by(Foot::order);
            assert_eq!(own, sorted);
        }
    }

    #[test]
    fn bits_follow_the_list_from_step_to_step() {
        let lattice = Lattice { origin: [0.0; 2], spacing: 0.01, size: [90, 70] };
        let mut all = Feet::new(lattice, 0);
        let mut marks = Marks::new(lattice);
        for runs in [&[(5, 5, 6), (40, 5, 6)][..], &[(6, 5, 6), (40, 5, 6)], &[(80, 60, 6)], &[]] {
            std::mem::swap(&mut all.list, &mut all.before);
            all.list = feet(runs);
            all.runs.sort(&mut all.list);
            all.list.dedup_by_key(|foot| foot.node);
            all.compare(&mut marks);
            for (i, j) in (0..90).flat_map(|i| (0..70).map(move |j| (i, j))) {
                let expected = all.list.iter().any(|foot| foot.node == [i, j]);
                assert_eq!(all.above(i, j), expected, "({i}, {j})");
            }
        }
    }
}
