//! Cost of a step of the hexapod (25 bodies, 24 joints, 18 contact components), split by part.
//!
//! `cargo bench -p terraglue-rigid-body`. A step of the co-operational pass is `whole_step`; each further trial of
//! an iterative strategy costs one `advance_again`.
#![allow(missing_docs)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::Rig;
use divan::{Bencher, black_box};
use terraglue_subsystem::Level;

fn main() {
    divan::main();
}

/// Standing on six feet after the first steps.
fn standing() -> Rig {
    let mut rig = Rig::hexapod(0.33, 1.62, 1e-3);
    for _ in 0..50 {
        rig.ground_step();
    }
    rig
}

/// Linearisation, factorisation and one solve: what the first trial of a step costs.
#[divan::bench]
fn prepare_factor_solve(bencher: Bencher) {
    let mut rig = standing();
    let ports = rig.ports();
    let t = vec![1.0; 3 * ports.len()];
    let target = rig.get("LF_j1.angle_target");
    bencher.bench_local(|| {
        // A change of any input makes a new step of it.
        rig.set("LF_j1.angle_target", target);
        black_box(rig.advance(&ports, &t))
    });
}

/// A further trial with the same factor: one right-hand side and the corrections of the joints.
#[divan::bench]
fn advance_again(bencher: Bencher) {
    let mut rig = standing();
    let ports = rig.ports();
    let t = vec![1.0; 3 * ports.len()];
    bencher.bench_local(|| black_box(rig.advance(&ports, &t)));
}

/// G for 18 components, linearisation and factor included.
#[divan::bench]
fn prepare_factor_compliance(bencher: Bencher) {
    let mut rig = standing();
    let ports = rig.ports();
    let target = rig.get("LF_j1.angle_target");
    let mut g = vec![0.0; 18 * 18];
    bencher.bench_local(|| {
        rig.set("LF_j1.angle_target", target);
        let step = terraglue_subsystem::Step {
            ports: &ports,
            n: 18,
            ..terraglue_subsystem::Step::free(rig.t, rig.h, rig.index)
        };
        rig.robot.interface_jacobian(&step, Level::Position, &mut g)
    });
}

/// x_free, G and T*, all included.
#[divan::bench]
fn estimate(bencher: Bencher) {
    let mut rig = standing();
    let ports = rig.ports();
    let target = rig.get("LF_j1.angle_target");
    bencher.bench_local(|| {
        rig.set("LF_j1.angle_target", target);
        black_box(rig.estimate(&ports).is_ok())
    });
}

/// Ports, estimate, advance, commit.
#[divan::bench]
fn whole_step(bencher: Bencher) {
    let mut rig = standing();
    bencher.bench_local(|| black_box(rig.ground_step()));
}
