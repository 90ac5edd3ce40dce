//! Sparse symmetric factorisation of the joint system in tree order; the one crate that compiles faer.
