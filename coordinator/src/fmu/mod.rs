//! Functional mock-up units as subsystems of a scenario, on their own, and made from scenarios and modules.
//!
//! A table `[x] fmu = "path.fmu"` makes a [`FmuSubsystem`]; [`simulate`] runs one unit alone; [`export`] writes one.

mod adapter;
mod bodies;
pub mod export;
mod feet;
mod map;
pub mod simulate;

pub use adapter::{FmuSubsystem, OnNan, is_fmu};
pub use feet::Feet;
