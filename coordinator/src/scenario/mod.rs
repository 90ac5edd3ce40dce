//! A scenario file: TOML in, checked [`Scenario`] out, errors with file, line and key.
//!
//! The keys of the reserved tables stand once, in [`keys`]; the parser, the JSON Schema and the documentation
//! are made from there. Parameters of modules are checked by [`check_parameters`] once their schemas are known.

pub mod advice;
mod check;
mod difference;
pub mod docs;
mod events;
pub mod keys;
mod load;
mod mask;
mod model;
mod nearest;
mod node;
mod parameters;
pub mod plausible;
pub mod schema;
mod section;
mod set;
mod soil_row;
mod source;
mod subsystems;
mod terrain;
#[cfg(test)]
mod tests;

pub use check::allowed_values;
pub(crate) use check::check_value;
pub use difference::{Difference, differences};
pub use mask::resolve as resolve_mask;
pub use model::*;
pub use nearest::{did_you_mean, nearest};
pub use parameters::{SHIPPED_MODULES, check_parameters, check_parameters_among};
pub use set::split as split_set;
pub use soil_row::{find_soil_table, read_soil_table};
pub use source::{InputError, Source};
