//! Step 1 of the paper: where may bodies touch ground within the coming step?
//!
//! [`ContactDetector`] keeps a list of all shapes that can be hit and, step by step, makes the [`PortSet`]: one
//! port for every shape on every ground that it can reach, with frame, extent and the lattice nodes below it.
//! Contacts among the bodies of one subsystem are that subsystem's own business.

mod detector;
mod frame;
mod ground;
mod port_set;

pub use detector::{BodySide, ContactDetector, GroundSide, Now};
pub use port_set::{PortOwner, PortSet, port_key};

#[cfg(test)]
mod tests;
