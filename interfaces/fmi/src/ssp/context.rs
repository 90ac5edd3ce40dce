//! The place where an element of a system structure is read: files that it may name, and the meaning of its units.

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
    /// The unit of a name: by `own` definitions, by those of the structure, or else in our reading.
    pub fn unit(&self, name: &str, own: &[(String, Unit)]) -> Option<Unit> {
        let defined = own.iter().chain(self.units).find(|(n, _)| n == name).map(|(_, unit)| *unit);
        defined.or_else(|| Unit::parse(name).ok().filter(|_| !name.is_empty()))
    }
}
