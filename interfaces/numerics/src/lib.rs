//! Numerics that modules and coordinator share: rotations.
//!
//! The only interface crate with algorithms. It touches no clock, no file and no thread.

pub mod rotation;
