//! The integration tests of this crate in one program: it is linked once.
#![allow(clippy::unwrap_used, missing_docs)]

mod common;
mod contact;
mod kinematics;
mod overlays;
mod subsystem;
mod tables;
mod walking;
