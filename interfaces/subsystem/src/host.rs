//! Services of the host for a subsystem, from `instantiate` to its end.

use crate::error::{Error, Result};
use crate::node_law::NodeLaw;
use std::sync::Arc;

/// Severity of a log line.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum LogLevel {
    Error = 1,
    Warning = 2,
    Info = 3,
    Debug = 4,
}

/// Services of the host. Shared by all calls of the instance; no module makes threads or reads a clock.
pub trait Host: Send + Sync {
    /// Name of the instance in the scenario.
    fn name(&self) -> &str;
    /// A line for the run's log.
    fn log(&self, level: LogLevel, text: &str);
    /// Runs job(0) … job(n − 1), possibly on several threads; returns when all are done. Results must not
    /// depend on the order.
    fn parallel_for(&self, n: usize, job: &(dyn Fn(usize) + Sync)) {
        (0..n).for_each(job);
    }
    /// Whether the user requested a stop; long calls poll it.
    fn cancelled(&self) -> bool {
        false
    }
    /// Seed of the run, from `world.seed` and the instance's name.
    fn seed(&self) -> u64;
    /// Folder to which relative paths of the parameters refer (that of the scenario file).
    fn folder(&self) -> &str;
    /// Number of numbered states that `save_state` must keep.
    fn slots(&self) -> u32;
    /// Largest number of ground nodes that a step may show; a hint for the memory to reserve.
    fn max_nodes(&self) -> u32;
    /// Gravity in the world, m/s².
    fn gravity(&self) -> [f64; 3];
    /// The ground of the scenario at the start, for the soil that will own it.
    fn terrain(&self) -> Option<&dyn Terrain>;
    /// The law that the scenario names in the parameter `law.plugin` of this subsystem.
    fn law(&self) -> Option<Arc<dyn NodeLaw>> {
        None
    }
}

/// Ground at the start of the run; nodes (i, j), 0 ≤ i < nx, lie at `origin + (i, j)·spacing`.
pub trait Terrain: Send + Sync {
    /// World x, y of node (0, 0), m.
    fn origin(&self) -> [f64; 2];
    /// Distance of neighbouring nodes, m.
    fn spacing(&self) -> f64;
    /// Number of nodes along x and y.
    fn size(&self) -> [u32; 2];
    /// Heights of nodes (i0 … i0 + ni − 1) × (j0 … j0 + nj − 1), m, x fastest, into `out` (ni·nj values).
    /// Nodes outside the size repeat the nearest node of the edge.
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile;
}

/// Result of [`Terrain::heights`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TerrainTile {
    /// All the same; `out` is filled all the same.
    Uniform(f64),
    /// `out` holds the heights.
    Varied,
}

/// A host for tests and for programs that use a model without the coordinator.
#[derive(Default)]
pub struct Standalone {
    /// Gravity in the world, m/s².
    pub gravity: [f64; 3],
    /// Ground at the start.
    pub terrain: Option<Box<dyn Terrain>>,
    /// Folder for relative paths.
    pub folder: String,
}

impl Host for Standalone {
    fn name(&self) -> &str {
        "standalone"
    }
    fn log(&self, _: LogLevel, _: &str) {}
    fn seed(&self) -> u64 {
        1
    }
    fn folder(&self) -> &str {
        &self.folder
    }
    fn slots(&self) -> u32 {
        4
    }
    fn max_nodes(&self) -> u32 {
        4096
    }
    fn gravity(&self) -> [f64; 3] {
        self.gravity
    }
    fn terrain(&self) -> Option<&dyn Terrain> {
        self.terrain.as_deref()
    }
}

impl dyn Host + '_ {
    /// The terrain, or the error that this module needs one.
    ///
    /// # Errors
    /// [`Error::Failed`]: the scenario has no terrain.
    pub fn required_terrain(&self) -> Result<&dyn Terrain> {
        self.terrain().ok_or_else(|| {
            Error::Failed(
                "needs ground, but the scenario has no [terrain] table; add [terrain] with kind = \"flat\""
                    .into(),
            )
        })
    }
}
