//! Functional mock-up units as subsystems of a scenario, on their own, and made from scenarios and modules.
//!
//! A table `[x] fmu = "path.fmu"` makes a [`FmuSubsystem`]; [`simulate`] runs one unit alone; [`export`] writes
//! one; [`ssp`] says a system structure as a scenario.

mod adapter;
mod bodies;
mod clocks;
pub mod export;
mod feet;
mod inputs;
mod map;
mod rollback;
mod settings;
pub mod simulate;
pub mod ssp;
mod table;

pub use adapter::{FmuSubsystem, is_fmu};
pub use feet::Feet;
pub use settings::OnNan;
