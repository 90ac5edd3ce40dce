//! Functional mock-up units as subsystems of a scenario, on their own, and made from scenarios and modules.
//!
//! A table `[x] fmu = "path.fmu"` makes a [`FmuSubsystem`]; [`simulate`] runs one FMU alone; [`export`] writes
//! one. System structures (SSP) become scenarios in `terraglue_scenario::ssp`.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod adapter;
mod array_starts;
mod bodies;
mod clocks;
mod driven_bodies;
pub mod export;
mod inputs;
mod limits;
mod map;
pub mod references;
mod rollback;
mod settings;
pub mod simulate;
mod table;
pub mod trace;

pub use adapter::FmuSubsystem;
pub use driven_bodies::DrivenBodiesModule;
pub use settings::{OnNan, host_keys, start_values};

use terraglue_host::Library;

/// Modules of this crate: driven `feet`, and the one that makes subsystems of FMUs.
pub fn library() -> Library {
    Library::new().with::<DrivenBodiesModule>().with_fmus(FmuSubsystem::make)
}
