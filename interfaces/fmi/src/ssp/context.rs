//! Where an element of a system structure is read: what may be named there, and what its units mean.

use super::Files;
use terraglue_subsystem::unit::Unit;

/// Where something is read.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// Files that may be named.
    pub files: &'a Files<'a>,
    /// Units that the structure defines.
    pub units: &'a [(String, Unit)],
    /// Systems around it.
    pub depth: usize,
}

impl Context<'_> {
    /// What the name of a unit means: by `own` definitions, by those of the structure, or else in our reading.
    pub fn unit(&self, name: &str, own: &[(String, Unit)]) -> Option<Unit> {
        let defined = own.iter().chain(self.units).find(|(n, _)| n == name).map(|(_, unit)| *unit);
        defined.or_else(|| Unit::parse(name).ok().filter(|_| !name.is_empty()))
    }
}
