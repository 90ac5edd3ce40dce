//! Errors with file, line and key, and the nearest name to a wrong one.

pub mod error;
mod fingerprint;
mod input_error;
mod nearest;

pub use error::{Error, Result};
pub use fingerprint::fingerprint;
pub use input_error::InputError;
pub use nearest::{did_you_mean, nearest};
