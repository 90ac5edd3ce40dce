//! Functional mock-up units as subsystems of a scenario, and on their own.
//!
//! A table `[x] fmu = "path.fmu"` makes a [`FmuSubsystem`]; [`simulate`] runs one unit alone.

mod adapter;
mod map;
pub mod simulate;

pub use adapter::{FmuSubsystem, OnNan, is_fmu};
