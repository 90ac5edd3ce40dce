//! Glues subsystems into one simulation of a whole mission.
//!
//! [`Testbed`] is the entry: `build_with` a [`scenario::Scenario`] and the modules of [`library`], `step` it, look at it
//! through an [`observer::Observer`]. Several live side by side in one process; there are no globals.
//!
//! Each part is a crate of its own below `coordinator/`; this one gives them one name. Without the feature `program`
//! neither recordings nor the checker nor the modules that come with the program are compiled.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use terraglue_diagnostics::{Error, Result};
pub use terraglue_engine::Testbed;
pub use terraglue_fmu::library;

pub use terraglue_diagnostics as diagnostics;
pub use terraglue_engine::{observer, signals, testbed};
pub use terraglue_fmu as fmu;
pub use terraglue_gluing::{self as gluing, contact, timing};
pub use terraglue_host as host;
pub use terraglue_scenario as scenario;
pub use terraglue_subsystem as subsystem;
pub use terraglue_terrain as terrain;
pub use terraglue_world as world;

#[cfg(feature = "program")]
pub use terraglue_checkpoint as checkpoint;
#[cfg(feature = "program")]
pub use terraglue_compare as compare;
#[cfg(feature = "program")]
pub use terraglue_conformance as conformance;
#[cfg(feature = "program")]
pub use terraglue_recording as recording;
#[cfg(feature = "program")]
pub use terraglue_reload as reload;
#[cfg(feature = "program")]
pub use terraglue_scaffold as scaffold;
#[cfg(feature = "program")]
pub use terraglue_soil_fit as soil_fit;
