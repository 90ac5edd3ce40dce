//! A pressure and a shear law as a module of its own: two functions over arrays of nodes.
//!
//! A soil asks [`Host::law`](crate::Host::law) for the law that its scenario names. A law is stateless: the memory of a
//! node is a declared number of doubles that the soil owns, so rollback, snapshots and export need no code of the law.
//! Depths and pressures grow into the soil, SI units throughout.
//!
//! A law **without state** is the curve of first loading, p(z); below the largest depth reached the soil is elastic by the
//! rule of the soil that uses it. A law **with state** covers everything, unloading and reloading too, and gives the
//! position of the unloaded surface. The shear law provides the yield stress only; below it the soil is elastic.

use crate::error::{Error, Result};
use crate::schema::Schema;

/// Most doubles that a law may keep per node.
pub const MOST_LAW_STATE: usize = 16;

/// Nodes of one contact at one trial of a step. All slices have one entry per node, `state` as many as the law
/// declares, node after node.
#[derive(Clone, Copy, Debug, Default)]
pub struct PressureNodes<'a> {
    /// Size of the contact, m: radius of a disc, short side of a rectangle, width of a wheel.
    pub b: f64,
    /// Length of the step, s; 0: no time passes.
    pub h: f64,
    /// Depth below the level at which the surface would be if the node had never been pressed, m; larger than
    /// zero for a law without state.
    pub depth: &'a [f64],
    /// Laws with state only: depth of the unloaded surface, m, as the last commit and the material since left it.
    pub permanent: &'a [f64],
    /// Laws with state only: accumulated slip, m.
    pub slip: &'a [f64],
    /// The committed state.
    pub state: &'a [f64],
}

/// Answer of a pressure law; the soil fills the numbers with NaN before the call.
#[derive(Debug)]
pub struct PressureAnswer<'a> {
    /// Pressure, Pa; never negative.
    pub pressure: &'a mut [f64],
    /// Its derivative by the depth, Pa/m.
    pub slope: &'a mut [f64],
    /// Laws with state only: depth of the unloaded surface after this step, m.
    pub permanent: &'a mut [f64],
    /// Laws with state only: the state after this step.
    pub state: &'a mut [f64],
    /// Longest step that the law can answer for, s; smaller than h: the step is repeated with it.
    pub longest_s: f64,
}

/// Nodes that are sheared.
#[derive(Clone, Copy, Debug, Default)]
pub struct ShearNodes<'a> {
    /// Length of the step, s.
    pub h: f64,
    /// Pressure, Pa; not negative.
    pub pressure: &'a [f64],
    /// Accumulated slip since the contact began, m.
    pub slip: &'a [f64],
    /// The committed state.
    pub state: &'a [f64],
}

/// Answer of a shear law: the stress up to which the soil is elastic, with its derivatives.
#[derive(Debug)]
pub struct ShearAnswer<'a> {
    /// Largest shear stress, Pa; it falls neither with the pressure nor with the slip.
    pub stress: &'a mut [f64],
    /// Its derivative by the pressure.
    pub by_pressure: &'a mut [f64],
    /// Its derivative by the slip, Pa/m.
    pub by_slip: &'a mut [f64],
    /// Longest step that the law can answer for, s.
    pub longest_s: f64,
}

/// A law with its parameters, ready to be called from any thread.
pub trait NodeLaw: Send + Sync {
    /// Name, for messages.
    fn name(&self) -> &str;
    /// Doubles per node; at most [`MOST_LAW_STATE`].
    fn state_doubles(&self) -> usize {
        0
    }
    /// Whether it has a pressure law; where not, that of the soil acts.
    fn has_pressure(&self) -> bool;
    /// Whether it has a shear law; where not, that of the soil acts.
    fn has_shear(&self) -> bool;
    /// Pressures of the nodes.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: it has no pressure law. Any other: the law failed.
    fn pressure(&self, nodes: &PressureNodes, out: &mut PressureAnswer) -> Result;
    /// Yield stresses of the nodes.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: it has no shear law. Any other: the law failed.
    fn shear(&self, nodes: &ShearNodes, out: &mut ShearAnswer) -> Result;
    /// Lets the border to foreign code find its own table again.
    fn as_any(&self) -> &dyn std::any::Any;
}

/// The static side of a law in Rust, for `export_law!`. The constants declare which of both functions exist.
pub trait LawModule: 'static {
    /// Doubles per node that the soil keeps.
    const STATE_DOUBLES: usize = 0;
    /// Whether [`LawModule::pressure`] is written.
    const PRESSURE: bool = true;
    /// Whether [`LawModule::shear`] is written.
    const SHEAR: bool = true;
    /// Name, kind (law) and parameters; all of them are numbers.
    fn schema() -> Schema;
    /// Pressures of the nodes; `parameters` in the order of the schema.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: it has no pressure law. Any other: the law failed.
    fn pressure(_parameters: &[f64], _nodes: &PressureNodes, _out: &mut PressureAnswer) -> Result {
        Err(Error::Unsupported)
    }
    /// Yield stresses of the nodes.
    ///
    /// # Errors
    /// [`Error::Unsupported`]: it has no shear law. Any other: the law failed.
    fn shear(_parameters: &[f64], _nodes: &ShearNodes, _out: &mut ShearAnswer) -> Result {
        Err(Error::Unsupported)
    }
}
