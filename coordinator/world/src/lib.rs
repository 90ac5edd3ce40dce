//! Geometric queries on the world: rays, heights and overlaps among the shapes and grounds of all subsystems.
//!
//! [`WorldModel`] is what the host offers to a subsystem that sees ([`terraglue_subsystem::World`]). [`WorldBuilder`] takes scenes and
//! states; after that every step is one [`WorldModel::update`], which costs nothing for bodies that are fixed.
//!
//! # Accuracy
//! * Shapes with a closed form, triangles and grounds are met in double precision; only the boxes around them are in single
//!   precision, grown by more than it can lose. A hit does not depend on them.
//! * A body moves within a step on a straight line and turns at a constant rate about one axis; each ray meets it where it
//!   is at the ray's own time. Grounds and the visibility of shapes are those at the end of the step.
//! * A ground is the field `height` of a subsystem with two flat triangles in each cell between four nodes. Footprints and ruts
//!   are seen as soon as the field shows them.
//! * Of hits at the same distance the one with the first name of its subsystem counts, then the lowest id of the shape. Nothing
//!   depends on the order in which subsystems are added, or on threads.
//! * A body whose pose is not a number, or a node with such a height, is not seen.
//!
//! Surfaces are seen from both sides. A ray that starts inside a shape meets it from within.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod bounds;
mod builder;
mod cast;
mod error;
mod fixed;
mod ground;
mod mesh;
mod model;
mod motion;
mod moving;
mod overlap;
mod primitive;
mod tree;
mod triangle;

pub use builder::{WorldBuilder, fixed_bodies};
pub use error::{Error, Result};
pub use model::{Parallel, Update, WorldModel};
