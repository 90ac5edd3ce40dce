//! Reads robot files (URDF) into a checked tree of bodies, joints and shapes.
//!
//! What comes out can be simulated: every body has a physical mass and inertia, the joints form a tree, links
//! without mass are merged into the link to which they are fixed. What cannot be is refused with file, line,
//! link or joint, the offending value and a way out.

mod check;
mod error;
mod model;
mod tree;
mod urdf;

pub use error::Error;
pub use model::{Base, Body, Joint, JointKind, Robot, Shape, ShapeGeometry};
pub use urdf::{read_urdf, read_urdf_text};
