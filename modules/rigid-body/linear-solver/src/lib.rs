//! Sparse symmetric factorisation of the joint system in tree order; the one crate that compiles faer.
//!
//! The matrix [[M, Jᵀ], [J, −C]] of a tree of bodies is quasi-definite. Numbered from the leaves to the root
//! (each body before the joint to its parent, the joint before the parent) its LDLᵀ has no fill outside the
//! blocks that it already has and needs no pivoting (Baraff 1996, "Linear-time dynamics using Lagrange
//! multipliers"; Vanderbei 1995 on quasi-definite matrices). The analysis is done once, [`Solver::factor`] is
//! repeated with new values. The interface is not generic, so faer is compiled here and nowhere else.

mod solver;
mod triangular;

pub use solver::{Error, Solver};
