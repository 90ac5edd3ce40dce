//! Walks a robot with legs of four joints: inverse kinematics, gait patterns, posture feedback.
//!
//! [`Gait`] is the module. It knows the robot only through variables: it reads `roll`, `pitch` and `yaw` of the
//! body and `L.contact_force` of each leg L, and offers `J.angle_target` for each joint J.
//!
//! # How a target comes about
//! 1. [`walker`]: a command (speed, turn rate, heading) becomes a planar twist of the body, within the legs' reach.
//! 2. [`pattern`]: each leg runs through its own cycle, first on the ground, then in the air.
//! 3. [`foot`]: on the ground a foot stays where it is in the world, so it moves against the twist in the body frame;
//!    in the air it flies to where its next stance has to begin, until it presses on the ground.
//! 4. [`posture`]: the measured tilt raises the feet of the high side and lowers those of the low side.
//! 5. [`geometry`]: foot positions become joint angles, the last link vertical in the body frame.
//!
//! # Frames and signs
//! Body frame: x forward, y left, z up. Roll, pitch and yaw are z-y-x Euler angles (rad): positive roll lifts the left
//! side, positive pitch lowers the nose, positive yaw turns left.

#![warn(clippy::unwrap_used)]

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod command;
pub mod foot;
mod gait;
pub mod geometry;
pub mod load;
mod overlays;
mod parameters;
pub mod pattern;
pub mod plane;
pub mod posture;
mod variables;
pub mod walker;

pub use gait::Gait;
pub use parameters::{Settings, schema, settings};
