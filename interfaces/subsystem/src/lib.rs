//! Interface of everything that the coordinator steps: bodies, soils, controllers, FMUs.
//!
//! A plugin author reads this crate and nothing else. There are two traits: [`Module`], the static side (description,
//! parameters, construction), and [`Subsystem`], an instance.
//!
//! # Life of a subsystem
//! 1. [`Module::schema`] lists the parameters; the host checks the scenario against it.
//! 2. [`Module::instantiate`] may allocate and read files below [`Host::folder`]. No later call does,
//!    except when a count exceeds every earlier one.
//! 3. Every step [t, t + h]: inputs are set; [`Subsystem::set_ports`]; any number of **trials**
//!    ([`Subsystem::estimate_forces`], [`Subsystem::solve_compatibility`], [`Subsystem::advance`]), each
//!    from the committed state at t, in any order, none visible from outside; then one
//!    [`Subsystem::commit`], which makes the last trial of `advance` or `solve_compatibility` the state at t + h.
//! 4. After all subsystems have committed, those with [`Capabilities::SEES`] get one [`Subsystem::observe`] with the committed
//!    [`World`], whose states lie between t and t + h.
//! 5. `get`, `body_states`, fields, streams, overlays and `energy` refer to the committed state only.
//!
//! # Packed vectors
//! T, X, V and A hold one entry per carried component of every port in the order of [`Step::ports`]; port p
//! owns `first .. first + mask.count_ones()`, in the order n, t1, t2, mn, mt1, mt2. T is the wrench on
//! side 1 (N, N m); side 2 feels −T. X, V, A are the subsystem's own motion in the port frame, from its
//! origin (m, rad as rotation vector, per s, per s²). Derivatives are per wrench **on itself**: positive
//! semi-definite for a passive subsystem on either side.
//!
//! SI units everywhere; the world frame is right-handed with z up.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod advice;
pub mod bytes;
mod capability;
mod config;
pub mod cooperation;
mod energy;
mod error;
mod feed_through;
mod field;
pub mod files;
mod host;
mod joint;
mod material;
mod mount;
mod node_law;
mod overlay;
mod port;
mod pose;
mod scene;
mod schema;
mod slots;
mod stream;
mod subsystem;
mod trial;
pub mod unit;
mod value_table;
mod variable;
mod world;

pub use advice::Advice;
pub use capability::Capabilities;
pub use config::Config;
pub use energy::Energy;
pub use error::{Error, Result};
pub use feed_through::FeedThrough;
pub use field::{FieldInfo, FieldTile, TileValues};
pub use host::{Host, LogLevel, Standalone, Terrain, TerrainTile};
pub use joint::{JointKind, JointVariables, SceneJoint};
pub use material::{Material, MaterialClass};
pub use mount::Mount;
pub use node_law::{
    LawModule, MOST_LAW_STATE, NodeLaw, PressureAnswer, PressureNodes, ShearAnswer, ShearNodes,
};
pub use overlay::{Figure, Overlay};
pub use port::{Law, Node, Port, PortKind, component};
pub use pose::{BodyState, Pose};
pub use scene::{Geometry, Scene, SceneBody, SceneShape};
pub use schema::{Kind, Parameter, ParameterType, Schema, Usual};
pub use slots::Slots;
pub use stream::{Message, StreamInfo};
pub use subsystem::{Module, Subsystem};
pub use trial::{Batch, Estimate, Input, Level, Motion, Response, Step, flag};
pub use value_table::ValueTable;
pub use variable::{Action, Causality, Effect, ValueType, Values, ValuesMut, Variable, element_name};
pub use world::{BodyRef, GROUND, Ray, RayHit, RayMask, ShapeRef, World};
