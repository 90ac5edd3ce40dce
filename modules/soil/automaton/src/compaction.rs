//! Material that became denser under feet: it leaves the height field and is booked, unit for unit.

use terraglue_ground::{Lattice, TileMap, TileMapSnapshot, UNIT_M};

/// Content of a node is kept in grains of so many units of height (7.6 µm): 16 bits reach to 0.5 m.
const GRAIN: i32 = 32;
/// Tiles that can be touched before memory is allocated again.
const RESERVE_TILES: usize = 256;

/// Compacted material by node.
#[derive(Clone, Debug)]
pub struct Compaction {
    fraction: f64,
    grains: TileMap<u16>,
    /// Remainder of the fraction beyond whole units so far, units.
    carried: f64,
    /// Units that make no whole grain yet; the node at which they do gets it.
    unplaced: i32,
    total: i64,
}

/// Exact copy.
#[derive(Clone, Debug, Default)]
pub struct SavedCompaction {
    fraction: f64,
    grains: TileMapSnapshot<u16>,
    carried: f64,
    unplaced: i32,
    total: i64,
}

impl Compaction {
    /// None so far; `fraction` (0 … 1) of the material pressed out of a node stays in it, denser.
    pub fn new(lattice: Lattice, fraction: f64) -> Self {
        let grains = TileMap::new(lattice, 0, RESERVE_TILES);
        Self { fraction, grains, carried: 0.0, unplaced: 0, total: 0 }
    }

    /// Share of the pressed volume that is compacted.
    pub fn fraction(&self) -> f64 {
        self.fraction
    }

    /// New share from now on.
    pub fn set_fraction(&mut self, fraction: f64) {
        self.fraction = fraction;
    }

    /// Books the compacted part of `excess` units at node (i, j) and returns it: over many calls the set fraction, however
    /// little each of them brings.
    pub fn take(&mut self, [i, j]: [i32; 2], excess: i32) -> i32 {
        let held = i32::from(self.grains.get(i, j));
        if self.fraction <= 0.0 || held == i32::from(u16::MAX) {
            return 0;
        }
        let wanted = f64::from(excess) * self.fraction + self.carried;
        let most = (i32::from(u16::MAX) - held) * GRAIN - self.unplaced;
        let dense = (wanted as i32).min(excess).min(most).max(0);
        // a node that cannot take more hands over no more than a unit
        self.carried = (wanted - f64::from(dense)).min(1.0);
        self.total += i64::from(dense);
        self.unplaced += dense;
        if self.unplaced >= GRAIN {
            *self.grains.get_mut(i, j) += (self.unplaced / GRAIN) as u16;
            self.unplaced %= GRAIN;
        }
        dense
    }

    /// Units of height that were compacted since the start, over all nodes.
    pub fn total(&self) -> i64 {
        self.total
    }

    /// Height that was compacted at a node, m, to a grain of 7.6 µm.
    pub fn height(&self, i: i32, j: i32) -> f64 {
        f64::from(i32::from(self.grains.get(i, j)) * GRAIN) * UNIT_M
    }

    /// Copies the state.
    pub fn save(&self, out: &mut SavedCompaction) {
        (out.fraction, out.carried) = (self.fraction, self.carried);
        (out.unplaced, out.total) = (self.unplaced, self.total);
        self.grains.save(&mut out.grains);
    }

    /// Back to a saved state.
    pub fn restore(&mut self, saved: &SavedCompaction) {
        (self.fraction, self.carried) = (saved.fraction, saved.carried);
        (self.unplaced, self.total) = (saved.unplaced, saved.total);
        self.grains.restore(&saved.grains);
    }
}

terraglue_subsystem::persist!(SavedCompaction { fraction, grains, carried, unplaced, total });

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_fraction_is_kept_and_every_unit_is_booked(
            pressed in prop::collection::vec((0..9i32, 1..2000i32), 100..400), fraction in 0.0..=1.0f64, slow in 1..100i32,
        ) {
            let lattice = Lattice { origin: [0.0; 2], spacing: 0.01, size: [9, 1] };
            let mut compaction = Compaction::new(lattice, fraction);
            let (mut taken, mut all) = (0, 0);
            for (i, excess) in pressed {
                // a foot that sinks slowly brings less than a grain at a time
                let excess = (excess / slow).max(1);
                let dense = compaction.take([i, 0], excess);
                prop_assert!(dense >= 0 && dense <= excess);
                (taken, all) = (taken + dense, all + excess);
            }
            prop_assert_eq!(i64::from(taken), compaction.total());
            let by_node: f64 = (0..9).map(|i| compaction.height(i, 0) / UNIT_M).sum();
            prop_assert!((0.0..f64::from(GRAIN)).contains(&(f64::from(taken) - by_node)));
            prop_assert!((f64::from(taken) - fraction * f64::from(all)).abs() <= 1.0);
        }
    }

    #[test]
    fn a_node_that_is_full_takes_no_more() {
        let lattice = Lattice { origin: [0.0; 2], spacing: 0.01, size: [2, 1] };
        let mut compaction = Compaction::new(lattice, 1.0);
        let taken: i64 = (0..3000).map(|_| i64::from(compaction.take([0, 0], 1000))).sum();
        let full = i64::from(u16::MAX) * i64::from(GRAIN);
        assert!((full - i64::from(GRAIN)..=full).contains(&taken), "{taken} of {full}");
        assert_eq!((compaction.take([0, 0], 1000), compaction.take([1, 0], 7)), (0, 7));
    }
}
