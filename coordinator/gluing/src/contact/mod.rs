//! Step 1 of the paper: where may bodies touch ground within the coming step?
//!
//! [`ContactDetector`] keeps a list of all shapes that can be hit and, step by step, makes the [`PortSet`]: one
//! port for every piece on every ground that it can reach, with frame, extent and the lattice nodes below it. A piece is
//! what hangs together of a body's shapes: a rim with its grousers, most often one shape alone.
//! Contacts among the bodies of one subsystem are that subsystem's own business.

mod detector;
mod frame;
mod ground;
mod port_set;
mod shape;
mod touching;
mod touching_port;

pub use detector::{BodySide, ContactDetector, GroundSide, Now};
pub use port_set::{PortOwner, PortSet, port_key};

#[cfg(test)]
mod tests;
