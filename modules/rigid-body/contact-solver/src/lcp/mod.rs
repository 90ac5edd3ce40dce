//! Linear complementarity problems: find z with w = M·z + q, z ≥ 0, w ≥ 0, z·w = 0.

mod dantzig;
mod lemke;
mod pyramid;

pub use dantzig::Dantzig;
pub use lemke::{Lemke, Outcome};
pub use pyramid::{Facets, Method, Pyramid};
