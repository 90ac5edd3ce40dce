//! The testbed: steps all subsystems of a scenario from one communication point to the next.
//!
//! [`Testbed`] is the entry: `build` a [`terraglue_scenario::Scenario`], `step` it, look at it through an
//! [`observer::Observer`]. Several live side by side in one process; there are no globals.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod graph;
mod listed;
pub mod observer;
pub mod signals;
pub mod testbed;

pub use testbed::{Options, Testbed};
