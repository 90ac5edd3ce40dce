//! Sweeps: the points of a plan, the cases in a folder, and one table and page of their results.
//!
//! A sweep is a list of runs. [`points`] makes the list, [`Sweep`] keeps it in a folder in which any number of processes can do what is
//! missing, [`collect`] makes one table of what is there.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod claim;
mod collect;
mod folder;
mod outcome;
mod page;
mod parallel;
mod points;
mod statistics;

pub use claim::Claim;
pub use collect::{Collected, Row, collect};
pub use folder::{CASES, Case, PAGE, RESULTS, Settings, Sweep};
pub use outcome::{CaseStatus, Outcome, figures, keys};
pub use page::write as write_page;
pub use points::{Points, points};
pub use statistics::{Counted, Sampled};
