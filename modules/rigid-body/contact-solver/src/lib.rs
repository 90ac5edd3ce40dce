//! Frictional contact problems and linear complementarity problems on plain numbers.
//!
//! | file | what |
//! |---|---|
//! | `problem` | W, q, μ and the residual by which solutions are judged |
//! | `solver` | the order of attack and its report |
//! | `newton` | semismooth Newton on Alart and Curnier's function, with line search |
//! | `local` | one contact, exactly |
//! | `gauss_seidel` | sweeps of exact local solutions |
//! | `cone`, `dense` | projections, LU |
//! | `lcp` | the friction pyramid, Lemke's and Dantzig's algorithms |
//!
//! Deliberately absent: shapes, bodies, time.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod cone;
mod dense;
mod gauss_seidel;
pub mod lcp;
mod local;
mod newton;
mod problem;
mod solver;

pub use cone::project;
pub use problem::{Error, Problem};
pub use solver::{Options, Report, Solver, Stage};
