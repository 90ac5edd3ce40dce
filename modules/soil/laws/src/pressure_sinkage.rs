//! The trait that each law of pressure and sinkage implements.
//!
//! A law describes the resistance of soil that is loaded for the first time; how it springs back is the same for all of them,
//! see [`PressureCurve`](crate::PressureCurve). To add a law: a file of its name with a type that implements
//! [`PressureSinkage`], a variant of [`PressureLaw`](crate::PressureLaw), and its numbers in [`crate::SoilParameters`].

use crate::first_loading::FirstLoading;

/// A law of pressure and sinkage: built in, text of a scenario or module.
///
/// It is called once per contact and step for the curve under a contact of that size, which then answers for all nodes.
pub trait PressureSinkage {
    /// First loading under a contact of smaller dimension `b` (m; radius of a disc, short side of a rectangle).
    fn under(&self, b: f64) -> FirstLoading;

    /// Doubles that the law keeps per node; a law that keeps some answers for unloading itself.
    fn state_doubles(&self) -> usize {
        0
    }

    /// Whether the slopes of a law that is no power law are known to stay below `k_u` (Pa/m) beyond the elastic limit.
    fn is_gentle_at(&self, _k_u: f64) -> bool {
        false
    }
}
