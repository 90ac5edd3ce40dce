//! Glues subsystems into one simulation of a whole mission.
//!
//! [`Testbed`] is the entry: `build` a [`scenario::Scenario`], `step` it, look at it through an
//! [`observer::Observer`]. Several live side by side in one process; there are no globals.

pub mod check_module;
pub mod checkpoint;
pub mod contact;
pub mod error;
pub mod fmu;
pub mod gluing;
pub mod host;
pub mod observer;
pub mod recording;
pub mod reload;
mod rotation;
pub mod scaffold;
pub mod scenario;
pub mod signals;
pub mod soil_fit;
pub mod terrain;
pub mod testbed;
pub mod timing;

pub use error::{Error, Result};
pub use terraglue_subsystem as subsystem;
pub use testbed::Testbed;
