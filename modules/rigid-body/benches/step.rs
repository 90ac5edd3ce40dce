//! Cost of a step of the hexapod (25 bodies, 24 joints, 18 contact components), split by part.
//!
//! `cargo bench -p terraglue-rigid-body`. A step of the co-operational pass is `whole_step`; each further trial of
//! an iterative strategy costs one `advance_again`.
#![allow(missing_docs)]

#[path = "../tests/suite/common/mod.rs"]
mod common;

use common::Fixture;
use divan::{Bencher, black_box};
use terraglue_subsystem::Level;

fn main() {
    divan::main();
}

/// Standing on six feet after the first steps.
fn standing() -> Fixture {
    let mut fixture = Fixture::hexapod(0.33, 1.62, 1e-3);
    for _ in 0..50 {
        fixture.ground_step();
    }
    fixture
}

/// Linearisation, factorisation and one solve: the cost of the first trial of a step.
#[divan::bench]
fn prepare_factor_solve(bencher: Bencher) {
    let mut fixture = standing();
    let ports = fixture.ports();
    let t = vec![1.0; 3 * ports.len()];
    let target = fixture.get("LF_j1.angle_target");
    bencher.bench_local(|| {
        // A change of any input makes a new step of it.
        fixture.set("LF_j1.angle_target", target);
        black_box(fixture.advance(&ports, &t))
    });
}

/// A further trial with the same factor: one right-hand side and the corrections of the joints.
#[divan::bench]
fn advance_again(bencher: Bencher) {
    let mut fixture = standing();
    let ports = fixture.ports();
    let t = vec![1.0; 3 * ports.len()];
    bencher.bench_local(|| black_box(fixture.advance(&ports, &t)));
}

/// G for 18 components, linearisation and factor included.
#[divan::bench]
fn prepare_factor_compliance(bencher: Bencher) {
    let mut fixture = standing();
    let ports = fixture.ports();
    let target = fixture.get("LF_j1.angle_target");
    let mut g = vec![0.0; 18 * 18];
    bencher.bench_local(|| {
        fixture.set("LF_j1.angle_target", target);
        let step = terraglue_subsystem::Step {
            ports: &ports,
            n: 18,
            ..terraglue_subsystem::Step::free(fixture.t, fixture.h, fixture.index)
        };
        fixture.robot.interface_jacobian(&step, Level::Position, &mut g)
    });
}

/// x_free, G and T*, all included.
#[divan::bench]
fn estimate(bencher: Bencher) {
    let mut fixture = standing();
    let ports = fixture.ports();
    let target = fixture.get("LF_j1.angle_target");
    bencher.bench_local(|| {
        fixture.set("LF_j1.angle_target", target);
        black_box(fixture.estimate(&ports).is_ok())
    });
}

/// Ports, estimate, advance, commit.
#[divan::bench]
fn whole_step(bencher: Bencher) {
    let mut fixture = standing();
    bencher.bench_local(|| black_box(fixture.ground_step()));
}
