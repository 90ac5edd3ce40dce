//! Exact elimination of the joint system [[M, Jᵀ], [J, −C]] of trees of bodies.
//!
//! * [`Tree`] eliminates each body and the joint above it from the leaves to the root in blocks of fixed size:
//!   O(n), no pivoting, every pivot positive. It serves any number of trees at once.
//! * [`Cut`] is a row that closes a loop, on up to four bodies; their reduced system is dense and factored by faer.
//! * [`Path`] answers "how does a wrench on this body move that body" by the path to the root alone, which is all
//!   that contacts need of the inverse.
//! * [`Rows`] is the geometry of a joint: six directions, each rigid, compliant or free.
//!
//! The numbering of the unknowns: six rates for each body, then six impulses for each joint, then
//! one for each row that closes a loop. Nothing here knows
//! time, motors or contacts.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod dense;
mod forest;
mod loops;
mod path;
mod rows;
mod spatial;
mod tree;

pub use forest::{Error, Link};
pub use loops::{Cut, MOST_PARTS};
pub use path::Path;
pub use rows::Rows;
pub use spatial::Wrench;
pub use tree::Tree;
