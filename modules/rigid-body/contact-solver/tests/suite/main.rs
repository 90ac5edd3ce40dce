//! The integration tests of this crate in one program: it is linked once.
#![allow(clippy::unwrap_used, missing_docs)]

mod common;
mod lcp;
mod problems;
mod pyramid;
