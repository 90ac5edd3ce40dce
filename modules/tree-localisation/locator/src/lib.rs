//! Where a machine is among trees while it drives: from streams of scanners, odometry and GNSS to a pose and its bound.
//!
//! * `settings.rs`: parameters.
//! * `variables.rs`: inputs, outputs, settings that can be changed during a run.
//! * `cloud.rs`: point clouds of scanners.
//! * `own.rs`: where the machine itself is.
//! * `look.rs`: from messages to trees around the machine.
//! * `shown.rs`: overlays and the message of a match.
//! * `locator.rs`: the subsystem.

#![warn(clippy::unwrap_used)]

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod cloud;
mod locator;
mod look;
mod own;
mod settings;
mod shown;
mod variables;

pub use cloud::{Cloud, CloudError, CloudPoint};
pub use locator::TreeLocator;
