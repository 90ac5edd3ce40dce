//! The integration tests of this crate in one program: it is linked once.
#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../../../contact/tests/support/bars.rs"]
mod bars;
mod contact;
mod energy;
mod feet;
mod heap;
mod placement;
mod plain;
mod prints;
mod properties;
mod reference;
#[path = "../../../contact/tests/support/mod.rs"]
mod support;
