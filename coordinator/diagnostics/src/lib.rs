//! Errors with file, line and key, checks of single values, and the nearest name to a wrong one.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod check;
pub mod error;
mod fingerprint;
mod input_error;
mod nearest;

pub use check::{Complaint, LARGEST_WHOLE, allowed, allowed_values, check_value, largest_plausible};
pub use error::{Error, Result};
pub use fingerprint::fingerprint;
pub use input_error::InputError;
pub use nearest::{closest, did_you_mean, nearest};
