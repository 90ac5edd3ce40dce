//! Linear complementarity problems: find z with w = M·z + q, z ≥ 0, w ≥ 0, z·w = 0.

mod lemke;

pub use lemke::{Lemke, Outcome};
