//! A second of six walking feet on 20 × 20 m: contact geometry, forces and material, 1000 steps.
//!
//! `cargo bench -p terraglue-soil-cellular-automaton --bench feet`; `cargo xtask validate soil` splits it into steps.
#![allow(missing_docs)]

#[path = "../tests/suite/feet/mod.rs"]
mod feet;
#[path = "../../contact/tests/support/mod.rs"]
#[allow(unused_imports)]
mod support;

use divan::Bencher;
use feet::{Feet, instance, walk::walk};
use std::sync::Arc;
use support::{LUNAR, Shaped};
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::Standalone;

fn main() {
    divan::main();
}

/// Millimetres between nodes.
#[divan::bench(args = [10, 5], sample_count = 10)]
fn six_feet(bencher: Bencher, spacing: u32) {
    let ground = || {
        let spacing = f64::from(spacing) * 1e-3;
        let nodes = (20.0 / spacing) as u32 + 1;
        let level = Shaped { size: [nodes; 2], spacing, height: |_, _| 0.0 };
        let host = Standalone { terrain: Some(Box::new(level)), ..Standalone::default() };
        Feet::new(instance::<SoilCellularAutomaton>(LUNAR, Arc::new(host)))
    };
    bencher.with_inputs(ground).bench_local_refs(|fixture| walk(fixture, 6, 1.0, || 0.0));
}
