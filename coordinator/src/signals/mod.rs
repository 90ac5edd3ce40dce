//! What flows between subsystems besides glue: connections between variables, and the time line of events that
//! set variables or call actions. Faults are events.

mod access;
mod connection;
mod discrete;
mod event;
mod initial;
pub mod pattern;

pub use access::{Directory, VariableRef};
pub use connection::{Link, Links, connect};
pub use discrete::Discrete;
pub use event::{Due, TimeLine};
pub use initial::settle;
