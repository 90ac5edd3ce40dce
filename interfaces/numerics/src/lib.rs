//! Numerics that modules and coordinator share: rotations, dense linear systems, numbers drawn from a seed, and extremes that keep NaN.
//!
//! The only interface crate with algorithms. It touches no clock, no file and no thread.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod dense;
pub mod extremes;
pub mod in_place;
pub mod least_norm;
pub mod random;
pub mod rotation;
