//! Where a machine stands among trees: stems from laser scans, a local tree map, its match with a global map, and when not to trust it.
//!
//! One file for each stage, in the words of the paper:
//! 1. `filter.rs`: points at infinity, points without company, the machine itself.
//! 2. `ground.rs`: the ground below.
//! 3. `rings.rs`, `arcs.rs`, `stems.rs`: pieces of beams on circles, and stems of which they are parts; `slices.rs` for clouds without
//!    beams.
//! 4. `local_map.rs`: the map of a scanner, of several, and of several turns.
//! 5. `tree_map.rs`, `matching/`: the global map, and the pose of the local map in it.
//! 6. `track.rs`: the pose over time, from odometry, GNSS and matches.

#![warn(clippy::unwrap_used)]

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod arcs;
mod detect;
mod filter;
mod ground;
mod local_map;
mod matching;
mod pose;
mod rings;
mod scan;
mod slices;
mod stems;
mod track;
mod tree_map;

pub use arcs::Arc;
pub use detect::{Detection, Detector, Nothing, Station};
pub use filter::{Dropped, Filter, Volume};
pub use ground::Ground;
pub use local_map::{LocalTree, SAME_TREE_M, add_sightings, merged};
pub use matching::{Answer, Found, Located, MatchModel, Matcher, PairIndex, Prior, Reason};
pub use pose::{Pose2, wrapped};
pub use rings::Rings;
pub use scan::{NO_BODY, NO_RING, Point, Scan};
pub use stems::{Revolution, Stem, StemRules};
pub use track::{Estimate, Fix, TrackRules, TrackState, Tracker};
pub use tree_map::{MapError, MapTree, TreeMap};
