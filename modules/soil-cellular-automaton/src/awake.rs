//! Which nodes each of the two rules has to visit next.

use crate::active::{ActiveSet, NEIGHBOURS, TRIPLES, TileBits};
use terraglue_ground::Lattice;

/// Awake nodes of both rules.
#[derive(Clone, Debug)]
pub struct Awake {
    /// For the rule of repose.
    pub repose: ActiveSet,
    /// For the rule of curvature.
    pub curvature: ActiveSet,
}

/// Exact copy of [`Awake`].
#[derive(Clone, Debug, Default)]
pub struct SavedAwake {
    repose: Vec<(u32, TileBits)>,
    curvature: Vec<(u32, TileBits)>,
}

impl Awake {
    /// Nobody is awake.
    pub fn new(lattice: Lattice) -> Self {
        Self { repose: ActiveSet::new(lattice), curvature: ActiveSet::new(lattice) }
    }

    /// The level, the load or the room of node (i, j) of the lattice has changed.
    #[inline]
    pub fn wake(&mut self, i: i32, j: i32) {
        self.repose.wake(i, j, &NEIGHBOURS);
        self.curvature.wake(i, j, &TRIPLES);
    }

    /// Whether all sleep.
    pub fn is_empty(&self) -> bool {
        self.repose.is_empty() && self.curvature.is_empty()
    }

    /// Number of nodes that the next sweep visits, one that both rules visit counted twice.
    pub fn len(&self) -> usize {
        self.repose.len() + self.curvature.len()
    }

    /// Copies the sets.
    pub fn save(&self, out: &mut SavedAwake) {
        self.repose.save(&mut out.repose);
        self.curvature.save(&mut out.curvature);
    }

    /// Back to saved sets.
    pub fn restore(&mut self, saved: &SavedAwake) {
        self.repose.restore(&saved.repose);
        self.curvature.restore(&saved.curvature);
    }
}
