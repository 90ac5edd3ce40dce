//! Loose material on a lattice with the automaton's sweeps, without feet or steps.

use crate::process::Outcome;
use std::sync::Arc;
use terraglue_ground::{Surface, UNIT_M};
use terraglue_numerics::extremes::larger;
use terraglue_soil_cellular_automaton::{Sweeper, relax};
use terraglue_soil_contact::Ground;
use terraglue_subsystem::{Standalone, Terrain, TerrainTile};

/// The angle of repose of the figures, rad: 35°.
pub const PHI: f64 = 0.610_865_238_198_015_3;
/// A limit of curvature that nothing reaches, 1/m.
pub const UNLIMITED: f64 = 1e9;
/// 1 µm in units of height.
pub const MICROMETRE: i32 = 4;

/// Ground whose height is a function of the node.
pub struct Function<F> {
    /// Number of nodes.
    pub size: [u32; 2],
    /// Their distance, m.
    pub spacing: f64,
    /// Height of node (i, j), m.
    pub height: F,
}

impl<F: Fn(i64, i64) -> f64 + Send + Sync> Terrain for Function<F> {
    fn origin(&self) -> [f64; 2] {
        self.size.map(|n| -0.5 * f64::from(n - 1) * self.spacing)
    }
    fn spacing(&self) -> f64 {
        self.spacing
    }
    fn size(&self) -> [u32; 2] {
        self.size
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        let [nx, ny] = self.size.map(i64::from);
        let at = |k: usize| {
            let (i, j) = (i0 + (k % ni) as i64, j0 + (k / ni) as i64);
            (self.height)(i.clamp(0, nx - 1), j.clamp(0, ny - 1))
        };
        out.iter_mut().take(ni * nj).enumerate().for_each(|(k, out)| *out = at(k));
        if out[..ni * nj].iter().all(|h| *h == out[0]) {
            TerrainTile::Uniform(out[0])
        } else {
            TerrainTile::Varied
        }
    }
}

/// Ground and sweeps.
pub struct Field {
    /// Ground.
    pub ground: Ground,
    /// Sweeps.
    pub sweeper: Sweeper,
}

impl Field {
    /// Looks at the ground once.
    pub fn new(terrain: &dyn Terrain, repose: f64, curvature: f64) -> Outcome<Self> {
        let ground = Ground::new(terrain).map_err(|e| e.to_string())?;
        let mut sweeper = Sweeper::new(*ground.heights.lattice(), Arc::new(Standalone::default()), 0);
        sweeper.set_limits(repose, &[], curvature, [0.0; 2], terrain.spacing());
        sweeper.scan(&ground);
        Ok(Self { ground, sweeper })
    }

    /// Sweeps until a sweep changes no node by more than `least` units; how many it took. An error after `most`.
    pub fn rest(&mut self, least: i32, most: u32) -> Outcome<u32> {
        let start = self.sweeper.counts.sweeps;
        while self.sweeper.counts.sweeps - start < most {
            // an even number: the last sweep applies repose alone, the one before both
            if self.sweeper.sweep(&mut self.ground, 8) <= least {
                return Ok(self.sweeper.counts.sweeps - start);
            }
        }
        Err(format!("not at rest after {most} sweeps"))
    }

    /// The same by way of a coarse lattice; sweeps on the coarse and on the fine one. An error after `most`.
    pub fn relax(&mut self, most: u32) -> Outcome<[u32; 2]> {
        let sweeps = relax(&mut self.sweeper, &mut self.ground, most).map_err(|e| e.to_string())?;
        if sweeps.iter().any(|s| *s >= most) {
            return Err(format!("not at rest after {most} sweeps"));
        }
        Ok(sweeps)
    }

    /// Sum of all heights, units.
    pub fn total(&self) -> i64 {
        self.ground.heights.total_units()
    }
}

/// Largest |h_a − 2h_0 + h_b|/d² over all triples of a surface, 1/m.
pub fn largest_curvature(surface: &dyn Surface) -> f64 {
    let lattice = surface.lattice();
    let [nx, ny] = lattice.size.map(|n| n as i32);
    let straight = lattice.spacing * lattice.spacing;
    let mut worst: f64 = 0.0;
    for j in 1..ny - 1 {
        for i in 1..nx - 1 {
            for ([a, b], times) in [([1, 0], 1.0), ([0, 1], 1.0), ([1, 1], 2.0), ([1, -1], 2.0)] {
                let bent =
                    surface.height(i - a, j - b) - 2.0 * surface.height(i, j) + surface.height(i + a, j + b);
                worst = larger(worst, (bent.abs() - UNIT_M) / (times * straight));
            }
        }
    }
    worst
}
