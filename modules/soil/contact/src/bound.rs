//! Largest shear stress at nodes, from an expression or a module for many nodes at once.

use crate::patch::Local;
use terraglue_soil_law::YieldNodes;
use terraglue_subsystem::{MOST_LAW_STATE, Result};

/// Nodes that are evaluated together.
const CHUNK: usize = 32;

/// Nodes on one law that wait to be evaluated.
pub struct Bound {
    count: usize,
    law: usize,
    doubles: usize,
    area: [f64; CHUNK],
    pressure: [f64; CHUNK],
    slip: [f64; CHUNK],
    kept: [f64; CHUNK * MOST_LAW_STATE],
}

impl Bound {
    /// For nodes of which a law keeps `doubles` numbers.
    pub fn new(doubles: usize) -> Self {
        let zero = [0.0; CHUNK];
        let kept = [0.0; CHUNK * MOST_LAW_STATE];
        Self { count: 0, law: 0, doubles, area: zero, pressure: zero, slip: zero, kept }
    }

    /// Adds a node: its law by number, its inclined area (m²), pressure (Pa) and slip (m), the state that the law keeps of
    /// it. Returns the force (N) of those that had to make room.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn add(
        &mut self,
        laws: &[Local],
        law: usize,
        area: f64,
        node: [f64; 2],
        kept: &[f64],
    ) -> Result<f64> {
        let full = self.count == CHUNK || self.law != law;
        let force = if full { self.take(laws)? } else { 0.0 };
        let (at, d) = (self.count, self.doubles);
        self.law = law;
        (self.area[at], [self.pressure[at], self.slip[at]]) = (area, node);
        self.kept[at * d..(at + 1) * d].copy_from_slice(kept);
        self.count += 1;
        Ok(force)
    }

    /// Largest tangential force of the nodes that wait, N.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn take(&mut self, laws: &[Local]) -> Result<f64> {
        let (n, mut stress) = (std::mem::take(&mut self.count), [0.0; CHUNK]);
        let Some(law) = laws.get(self.law).filter(|_| n > 0) else { return Ok(0.0) };
        let kept = &self.kept[..n * self.doubles];
        let nodes = YieldNodes { pressure: &self.pressure[..n], slip: &self.slip[..n], kept };
        law.shear.yield_stresses(&nodes, &mut stress[..n])?;
        Ok(self.area[..n].iter().zip(&stress).map(|(area, stress)| area * stress).sum())
    }
}
