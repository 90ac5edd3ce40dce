//! Sensors that every robot has: IMU, inclinometer, range finder, joint encoder, foot force, contact switch, with their errors.
//!
//! [`Sensor`] is the module. Sensors on a body ([`SensorKind::is_mounted`]) look at the committed world; the others take their
//! measurand from connections.
//!
//! # From truth to output
//! 1. A sample is due at each multiple of 1/`rate_hz`, at the end of each step where `rate_hz` is 0. Of several in a step the
//!    last one is taken. A mounted sensor looks at the time of the sample itself; inputs hold over a step.
//! 2. Each channel gets a constant bias, white noise and rounding to its quantum, in this order ([`Errors`]).
//! 3. The sample is shown `delay_s` after it was taken, at the first communication point from then on.
//!
//! Everything random follows from the seed of the instance and the number of the sample, so a state that is restored goes on
//! with the same noise.

#![warn(clippy::unwrap_used)]

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod errors;
mod kind;
mod measure;
mod sensor;
mod settings;

pub use errors::{ErrorModel, Errors};
pub use kind::SensorKind;
pub use sensor::Sensor;
pub use settings::schema;
