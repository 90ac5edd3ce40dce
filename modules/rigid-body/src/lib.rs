//! Rigid bodies in maximal coordinates with Lagrange multipliers and complementarity contact.
//!
//! [`RigidBody`] is the module; everything else is reached through the subsystem interface. The map:
//!
//! | file | what |
//! |---|---|
//! | `module`, `schema`, `objects`, `placement` | from parameters and robot files to an instance on the ground |
//! | `cut` | one part of a robot that a scenario divides at joints |
//! | `robot` | an instance and the calls of the interface |
//! | `model`, `joint`, `state`, `motion`, `motor` | constant data and state |
//! | `dynamics` | one step: its start, the whole KKT matrix with the rows of the joints, branches of the axes, trial, corrections |
//! | `drive` | forces along the free axis of a joint: motor, friction, limits, brake |
//! | `closure` | connections beyond the tree: loops, rods, springs, couplings |
//! | `actuator` | windings, gears, friction, heat, battery, energy |
//! | `contact` | ports, the rigid estimate T*, contacts among own bodies |
//! | `lcp` | pivoting methods, from the crate `contact-solver` |
//! | `balance` | energy and gaps of the committed state |
//! | `variables`, `initial`, `scene` | variables, settings (also of the motion before the start), actions and the scene |
//!
//! Deliberately absent: ground and soil. The robot knows its ports only.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod actuator;
mod balance;
mod closure;
mod contact;
mod cut;
mod drive;
mod dynamics;
mod initial;
mod joint;
pub use terraglue_contact_solver::lcp;
mod math;
mod model;
mod module;
mod motion;
mod motor;
mod objects;
mod placement;
mod robot;
mod scene;
mod schema;
mod state;
mod variables;

pub use module::RigidBody;
