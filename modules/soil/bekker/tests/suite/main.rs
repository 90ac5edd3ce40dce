//! The integration tests of this crate in one program: it is linked once.
#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../../../contact/tests/support/bars.rs"]
mod bars;
mod contact;
#[path = "../../../contact/tests/support/lines.rs"]
mod line_cases;
mod lines;
mod overlays;
#[path = "../../../contact/tests/support/mod.rs"]
mod support;
mod transport;
