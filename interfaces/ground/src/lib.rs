//! The height field that soils shape and everybody reads, with the exact lower surface of every shape.
//!
//! * [`Lattice`]: where the nodes lie, and how they are grouped into tiles of 32 × 32.
//! * [`HeightField`]: heights of material in fixed point, so that moving material loses nothing; untouched ground costs
//!   nothing.
//! * [`TileMap`]: any state per node in the same tiles, for soils.
//! * [`Placed`]: a shape at a pose: its exact underside, support point and bounding box.
//! * [`nodes_below`]: the nodes of a contact patch with their covered areas; [`nodes_below_parts`]: of several shapes in one.
//! * [`fit_plane`]: height and normal of the ground below a footprint.
//!
//! Nothing here depends on soil; contact detection, soils and sensors share it.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod coverage;
mod excerpt;
mod footprint;
mod height_field;
mod identity;
mod joined;
mod lattice;
mod math;
mod outline;
mod plane;
mod pool;
mod shape;
mod snapshot;
mod tile_map;

pub use coverage::{disc_in_rectangle, polygon_in_rectangle};
pub use footprint::nodes_below;
pub use height_field::{HeightError, HeightField, UNIT_M};
pub use joined::{Part, bounds_of, nodes_below_parts};
pub use lattice::{Lattice, TILE_EDGE, TILE_NODES};
pub use math::{Rotation, compose};
pub use plane::{Plane, PlaneFit, fit_plane};
pub use shape::{Aabb, Placed, STEEPEST_SLOPE, aabb, lower_surface};
pub use snapshot::HeightSnapshot;
pub use tile_map::{TileMap, TileMapSnapshot};

/// Ground that can be read node by node: a [`HeightField`], a field of a soil, a terrain.
pub trait Surface {
    /// Lattice of its nodes.
    fn lattice(&self) -> &Lattice;
    /// Height of node (i, j), m. Indices outside the lattice read the nearest node of the edge.
    fn height(&self, i: i32, j: i32) -> f64;
    /// Heights of the nodes (i, j), (i + 1, j) …, as many as `out` has places.
    fn heights(&self, i: i32, j: i32, out: &mut [f64]) {
        for (i, out) in (i..).zip(out) {
            *out = self.height(i, j);
        }
    }
}
