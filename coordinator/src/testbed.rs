//! The step loop; the paper's five steps can be read here by name.

/// A simulation of a whole mission.
pub struct Testbed {}
