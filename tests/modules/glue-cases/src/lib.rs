//! Subsystems of the reference cases of gluing (`tests/reference/gluing/README.md`).
//!
//! - [`MassChain`]: masses on springs along x; a half of the two-mass oscillator, or all of it.
//! - [`PlanarBodies`]: rigid bodies in a plane with pins at position level; a cut mechanism, or all of it.
//! - [`TableOnFeet`]: heave, roll and pitch of a body above its feet; with one foot, a falling foot.
//! - [`PowerColumns`]: independent soil columns T = K·zⁿ with elastic unloading, one per foot.
//!
//! All integrate by a [`Scheme`], so that the same case runs with several integrators.

mod chain;
mod columns;
mod dense;
mod feet;
mod mechanism;
mod planar;
mod scheme;

pub use chain::MassChain;
pub use columns::PowerColumns;
pub use feet::TableOnFeet;
pub use planar::PlanarBodies;
pub use scheme::Scheme;
