//! A scenario file: TOML in, checked [`Scenario`] out, errors with file, line and key.
//!
//! The keys of the reserved tables stand once, in [`keys`]; the parser, the JSON Schema and the documentation
//! are made from there. Parameters of modules are checked by [`check_parameters`] once their schemas are known.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod advice;
mod blame;
mod choices;
mod difference;
pub mod docs;
mod events;
mod ground_size;
mod isolation;
pub mod keys;
mod load;
mod mask;
mod model;
mod module_kind;
mod node;
mod page;
mod parameters;
pub mod plausible;
pub mod schema;
mod section;
mod set;
mod soil_row;
mod soil_table;
mod source;
pub mod ssp;
mod subsystems;
mod sweep;
mod sweep_plan;
mod task;
mod terrain;
#[cfg(test)]
mod tests;

pub use choices::{
    ConnectionOrder, Extrapolate, FormChoice, JacobianChoice, LevelChoice, Relaxation, StartChoice,
    StrategyKind,
};
pub use difference::{Difference, differences};
pub use ground_size::{SMALLER, TooMany, too_many};
pub use isolation::IsolationSpec;
pub use model::*;
pub use module_kind::ModuleKind;
pub use parameters::{SHIPPED_MODULES, check_parameters, check_parameters_among};
pub use set::split as split_set;
pub use soil_row::{find_soil_table, read_soil_table};
pub use soil_table::{COLUMNS, SoilRow, SoilTable, TableError};
pub use source::Source;
pub use sweep_plan::SweepPlan;
pub use terraglue_diagnostics::{Complaint, InputError, allowed_values, check_value, did_you_mean, nearest};
