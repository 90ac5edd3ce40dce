//! Laser scanners: patterns of beams, motion within a turn, and the errors of a ray.
//!
//! * `pattern.rs`: which beams a turn has, in which direction and when.
//! * `beam.rs`: the extent of a beam, and which of its returns is reported.
//! * `errors.rs`: from the true distance of a ray to the reported range.
//! * `faults.rs`: settings that can be changed during a run.
//! * `cloud.rs`: the points of a turn as a message.
//! * `scanner.rs`, `settings.rs`: the module.

#![warn(clippy::unwrap_used)]

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod beam;
mod cloud;
mod errors;
mod faults;
mod pattern;
mod scanner;
mod settings;

pub use beam::{Beam, Returns};
pub use cloud::{Told, message};
pub use errors::RayErrors;
pub use pattern::Pattern;
pub use scanner::LaserScanner;
pub use settings::schema;
