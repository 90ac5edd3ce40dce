//! The integration tests of this crate in one program: it is linked once.
#![allow(clippy::unwrap_used, missing_docs)]

mod extrapolation;
mod sight;
mod streams;
