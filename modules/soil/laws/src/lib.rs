//! Pressure and shear laws of soils with tangents and inverses, evaluated over batches of nodes.
//!
//! No grid, no bodies: a node is a depth, a largest depth and a shear displacement. What lies around it is the
//! business of whoever calls. SI units; depths and pressures grow into the soil, pressure is never negative.

mod batch;
pub mod expression;
pub mod fit;
mod parameters;
mod plugin;
mod pressure;
mod rolling;
mod shear;
mod slip_sinkage;
mod straight;
pub mod strength;
mod table;
mod yielding;

pub use batch::first_loading;
pub use expression::{ExpressionError, PressureExpression, ShearExpression, SoilExpressions};
pub use parameters::{DEFAULT_DENSITY, Direction, Family, SoilParameters};
pub use plugin::{KeptNodes, PluginLaw};
pub use pressure::{PRESSURE_LAWS, PressureCurve, PressureLaw};
pub use rolling::{Rolling, SLIP_SINKAGES};
pub use shear::{ShearLaw, ShearResponse, ShearState, Travel};
pub use slip_sinkage::SlipSinkage;
pub use straight::{DEEPEST_TESTED, SMALL_CONTACT, Softened};
pub use strength::Strength;
pub use table::{COLUMNS, SoilRow, SoilTable, TableError};
pub use yielding::Sheared;
