//! One file per strategy.

mod report;

pub use report::{PortReport, StepReport};
