//! The integration tests of this crate in one program: it is linked once.
#![allow(clippy::unwrap_used, missing_docs)]

mod bad_values;
mod collada;
mod defects;
mod meshes;
mod mjcf;
mod mjcf_parts;
mod urdf;
mod xacro;
