//! Pressure and shear laws of soils with tangents and inverses, evaluated over batches of nodes.
//!
//! A node is a depth, a largest depth and a shear displacement; its surroundings are up to the caller. SI units; depths
//! and pressures grow into the soil, pressure is never negative.
//!
//! * Pressure and sinkage: the trait [`PressureSinkage`], one file per law (`bekker.rs`, `reece.rs`, `bearing_capacity.rs`);
//!   [`PressureCurve`] adds elastic unloading, and slip sinkage is in `slip_sinkage.rs`.
//! * Shear: the trait [`ShearStrength`], `janosi_hanamoto.rs`; [`ShearLaw`] makes it elastic–plastic.
//! * Laws as text ([`expression`]) and laws as modules ([`PluginLaw`]) implement the same traits.
//!
//! Laws answer by [`Result`](terraglue_subsystem::Result): only a module can fail.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod advice;
mod batch;
mod bearing_capacity;
mod bekker;
mod build_up;
pub mod expression;
mod first_loading;
mod inverse;
mod janosi_hanamoto;
mod parameters;
mod plugin;
mod plugin_laws;
mod pressure_curve;
mod pressure_law;
mod pressure_sinkage;
mod reece;
mod rolling;
mod shear;
mod shear_strength;
mod slip_sinkage;
mod softened;
mod straight;
pub mod strength;
mod strength_law;
mod yielding;

pub use advice::advice;
pub use batch::first_loading;
pub use bearing_capacity::BearingCapacity;
pub use bekker::Bekker;
pub use expression::{ExpressionError, PressureExpression, ShearExpression, SoilExpressions};
pub use first_loading::FirstLoading;
pub use janosi_hanamoto::JanosiHanamoto;
pub use parameters::{DEFAULT_DENSITY, Direction, Family, SoilParameters};
pub use plugin::{KeptNodes, PluginLaw};
pub use plugin_laws::PluginShear;
pub use pressure_curve::PressureCurve;
pub use pressure_law::{PRESSURE_LAWS, PressureLaw};
pub use pressure_sinkage::PressureSinkage;
pub use reece::Reece;
pub use rolling::{Rolling, SLIP_SINKAGES};
pub use shear::{ShearLaw, ShearResponse, ShearState, Travel};
pub use shear_strength::{ShearStrength, YieldAnswer, YieldNodes};
pub use slip_sinkage::SlipSinkage;
pub use softened::{DEEPEST_TESTED, SMALL_CONTACT, Softened};
pub use strength::Strength;
pub use strength_law::StrengthLaw;
pub use yielding::Sheared;
