//! Numerics that modules and coordinator share: rotations, and extremes that keep NaN.
//!
//! The only interface crate with algorithms. It touches no clock, no file and no thread.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod extremes;
pub mod rotation;
