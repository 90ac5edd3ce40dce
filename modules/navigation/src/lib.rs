//! GNSS under a canopy, odometry of wheels that slip, and a driver who follows way points.
//!
//! * `gnss.rs`: a receiver whose error stays the same for minutes, with outages.
//! * `odometry.rs`: the way from rates of wheels and of turning.
//! * `driver.rs`, `steering.rs`: from a pose that is believed to the angle of the steering joint and to rates of wheels.
//! * `slots.rs`: states that are saved.

#![warn(clippy::unwrap_used)]

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod driver;
mod gnss;
mod odometry;
mod steering;

pub use driver::Driver;
pub use gnss::Gnss;
pub use odometry::Odometry;
pub use steering::Steering;
