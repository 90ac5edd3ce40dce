//! Numerics that modules and coordinator share: rotations, and extremes that keep NaN.
//!
//! The only interface crate with algorithms. It touches no clock, no file and no thread.

pub mod extremes;
pub mod rotation;
