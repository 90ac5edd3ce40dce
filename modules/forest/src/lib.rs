//! A stand of trees from a table or grown from a seed: stems, branches, undergrowth, and surveys of it.
//!
//! * `tree.rs`: one tree: diameter, height, taper, lean.
//! * `stand.rs`: where trees stand: grown by published distributions.
//! * `table.rs`: a stand that was surveyed, from a table.
//! * `scene.rs`: the shapes of a stand, for [`terraglue_subsystem::World`].
//! * `module.rs`: a stand in a scenario.
//! * `survey.rs`: maps of a stand as a survey makes them: noise, missing and extra trees.

#![warn(clippy::unwrap_used)]

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod module;
mod scene;
mod stand;
mod survey;
mod table;
mod tree;

pub use module::{Forest, schema};
pub use scene::{Plants, plants};
pub use stand::{Bush, Growth, Stand, Terrain};
pub use survey::{Survey, Surveyed};
pub use tree::{Species, Tree};
