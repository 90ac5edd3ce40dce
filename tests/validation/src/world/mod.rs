//! Figures of the world: rays against a loop over all shapes and against Embree, and their cost.

mod embree;
mod rays;
mod scenes;
mod speed;

use super::{Context, Figure, Limit, Part};

/// The parts, in the order of the table.
pub const PARTS: [Part; 3] =
    [("rays", rays::figures), ("embree", embree::figures), ("speed", speed::figures)];
