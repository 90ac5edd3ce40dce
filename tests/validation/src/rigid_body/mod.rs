//! Area `rigid-body`, part by part.

mod contact;
mod fixture;
mod peers;
mod solver;

pub use peers::{comparison, mujoco_gait};

use super::Part;

/// The parts, in the order of the table.
pub const PARTS: [Part; 3] =
    [("contact", contact::figures), ("solver", solver::figures), ("peers", peers::figures)];
