//! What all soils on a height field share: contact patches, node states, fields, variables.
//!
//! A soil module brings a [`Material`], which says where the soil under a foot goes; [`FieldSoil`] makes a
//! subsystem of it. The pressure and shear laws act node by node on floating-point depths; the fixed-point
//! height field only books what stays.
//!
//! # Depths
//! A node has a *reference level*, where the surface would be if the node had never been pressed, and a
//! *permanent* depth of the unloaded surface below it. The depth under a foot is counted from the reference
//! level along the port's normal n: δ = (reference − underside)·n_z − X_n − (rotation). Loading follows the
//! pressure law of δ where it is below the elastic line k_u·(δ − permanent), the elastic line otherwise.

mod assemble;
mod bookkeeping;
mod bound;
mod chunk;
mod contacts;
mod ground;
mod law_memory;
mod mask;
mod nodes;
mod normal;
mod patch;
mod recall;
mod soil;
mod state;
mod trial;
mod values;
mod wheel;

pub use ground::{Covered, Ground};
pub use mask::{MOST_SOILS, Mask, schema};
pub use nodes::{NodeState, NodeStates, NodesSnapshot};
pub use soil::{FieldSoil, Material};
