//! Common parts of all soils on a height field: contact patches, node states, fields, variables; a soil adds the motion
//! of material.
//!
//! A soil module brings a [`Material`], which determines where the soil under a foot goes; [`FieldSoil`] makes a
//! subsystem of it. The pressure and shear laws act node by node on floating-point depths; the fixed-point
//! height field only books permanent changes.
//!
//! # Depths
//! A node has a *reference level*, where the surface of its bed would be if it had never been pressed, and an *unloaded
//! surface* at the depth z₀ below it, above it where loose soil lies on the bed. The depth under a foot is counted from the
//! reference level along the port's normal n: z = (reference − underside)·n_z − X_n − (rotation). The soil is elastic above
//! z₀ up to the pressure at which it yields; yielding moves z₀ down.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod assemble;
mod bookkeeping;
mod bound;
mod cell;
mod chunk;
mod clinging;
mod compatibility;
mod cone;
mod contact_memory;
mod contacts;
mod fold;
mod gaps;
mod ground;
mod grousers;
mod law_memory;
mod mask;
mod nodes;
mod normal;
mod overlays;
mod patch;
mod patch_nodes;
mod rows;
mod size;
mod soil;
mod spread;
mod state;
mod trial;
mod values;
mod vectors;
mod wall;
mod wheel;
mod yielding;

pub use ground::{Covered, Ground, squares_grown};
pub use mask::{MOST_SOILS, Mask, schema};
pub use nodes::{NodeState, NodeStates, NodesSnapshot};
pub use soil::{FieldSoil, Material};
