//! Cost of the two rules: ground that flows everywhere, ground at rest, a column that collapses to a cone.
//!
//! `cargo bench -p terraglue-soil-cellular-automaton`
#![allow(missing_docs)]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use std::sync::Arc;
use terraglue_soil_cellular_automaton::{Sweeper, relax};
use terraglue_soil_contact::Ground;
use terraglue_subsystem::{Standalone, Terrain, TerrainTile};

const SPACING: f64 = 0.01;
/// 35°, rad.
const REPOSE: f64 = 0.610_865_238_198_015_3;
const UNLIMITED: f64 = 1e9;

fn main() {
    divan::main();
}

/// Ground whose height in m is a function of the node.
struct Shape<F> {
    size: u32,
    height: F,
}

impl<F: Fn(f64, f64) -> f64 + Send + Sync> Terrain for Shape<F> {
    fn origin(&self) -> [f64; 2] {
        [0.0; 2]
    }
    fn spacing(&self) -> f64 {
        SPACING
    }
    fn size(&self) -> [u32; 2] {
        [self.size; 2]
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        let last = i64::from(self.size) - 1;
        for (k, out) in out.iter_mut().take(ni * nj).enumerate() {
            let (i, j) = (i0 + (k % ni) as i64, j0 + (k / ni) as i64);
            *out = (self.height)(i.clamp(0, last) as f64, j.clamp(0, last) as f64);
        }
        TerrainTile::Varied
    }
}

fn ground(size: u32, curvature: f64, height: impl Fn(f64, f64) -> f64 + Send + Sync) -> (Ground, Sweeper) {
    let ground = Ground::new(&Shape { size, height }).expect("heights within the range");
    let mut sweeper = Sweeper::new(*ground.heights.lattice(), Arc::new(Standalone::default()), 0);
    sweeper.set_limits(REPOSE, &[], curvature, [0.0; 2], SPACING);
    sweeper.scan(&ground);
    (ground, sweeper)
}

/// 64 sweeps of a rough slope of 50° with 256 × 256 nodes.
#[divan::bench(sample_count = 20)]
fn flowing(bencher: Bencher) {
    let rough = |i: f64, j: f64| 1e-3 * (12.9898 * i + 78.233 * j).sin();
    let slope = || ground(256, UNLIMITED, move |i, j| 0.012 * i + rough(i, j));
    let (mut g, mut s) = slope();
    s.sweep(&mut g, 64);
    let visits = s.counts.visited;
    bencher.counter(ItemsCount::new(visits)).with_inputs(slope).bench_local_refs(|(g, s)| s.sweep(g, 64));
}

/// Looking through 256 × 256 nodes that neither rule would move.
#[divan::bench]
fn at_rest(bencher: Bencher) {
    let (ground, mut sweeper) = ground(256, 40.0, |i, j| 0.02 * libm::sin(0.05 * i) * libm::cos(0.04 * j));
    bencher.counter(ItemsCount::new(256u32 * 256)).bench_local(|| sweeper.scan(black_box(&ground)));
}

/// A column collapses to a cone of so many cells radius, sweep by sweep.
#[divan::bench(args = [32], sample_count = 20)]
fn collapse(bencher: Bencher, radius: u32) {
    bencher.with_inputs(|| released(radius)).bench_local_refs(|(g, s)| while s.sweep(g, 8) > 4 {});
}

/// The same by way of a coarse lattice.
#[divan::bench(args = [32, 64], sample_count = 20)]
fn collapse_settled(bencher: Bencher, radius: u32) {
    bencher.with_inputs(|| released(radius)).bench_local_refs(|(g, s)| relax(s, g, 100_000));
}

fn released(radius: u32) -> (Ground, Sweeper) {
    let half = f64::from(radius / 4);
    let volume = std::f64::consts::FRAC_PI_3 * (f64::from(radius) * SPACING).powi(3) * REPOSE.tan();
    let height = volume / ((2.0 * half + 1.0) * SPACING).powi(2);
    let middle = f64::from(2 * radius);
    ground(4 * radius + 1, UNLIMITED, move |i, j| {
        if (i - middle).abs() <= half && (j - middle).abs() <= half { height } else { 0.0 }
    })
}
