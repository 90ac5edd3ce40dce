//! Values between subsystems besides glue: connections between variables, and the time line of events that set
//! variables or call actions. A failure in a subsystem is an event; an error of a number on its way is a fault of its
//! own kind.

mod access;
mod connection;
mod discrete;
mod event;
mod extrapolation;
mod fault;
mod feed_through;
mod initial;
mod modifier;
pub mod pattern;
mod stream_link;
mod table;
mod traffic;

pub use access::{Directory, VariableRef, streams};
pub use connection::{Link, Links, connect, derivatives, named_ends};
pub use discrete::Discrete;
pub use event::{Due, TimeLine};
pub use extrapolation::{Moment, held};
pub use fault::Faults;
pub use feed_through::{ConnectedValue, FeedThroughs, Place};
pub use initial::{initialize, initialize_discrete};
pub use stream_link::StreamLink;
pub use traffic::Signals;
