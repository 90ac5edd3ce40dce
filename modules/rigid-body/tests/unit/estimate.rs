//! The estimate of contact forces on numbers alone.

use super::*;
use terraglue_subsystem::{Law, component};

/// Ports of three forces each, one after the other.
fn ports(count: u32, mu: f64) -> Vec<Port> {
    let law = Law { mu, ..Law::UNILATERAL };
    let port = |k: u32| Port {
        key: u64::from(k),
        kind: 0,
        side: 1,
        mask: component::FORCE,
        first: 3 * k,
        body: k,
        shape: k,
        first_node: 0,
        node_count: 0,
        origin: [0.0; 3],
        frame: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        extent: [0.0; 2],
        law,
    };
    (0..count).map(port).collect()
}

fn solved(ports: &[Port], g: &[f64], gap: &[f64]) -> (bool, Vec<f64>) {
    let mut t = vec![0.0; gap.len()];
    let unique = Estimator::default().solve(&Problem { ports, g, gap }, &mut t).expect("solvable");
    (unique, t)
}

/// To stick, the foot would have to pull at the ground; left open, it would enter it.
#[test]
fn a_foot_that_cannot_stick_and_press_slips() {
    let g = [1.0, 0.9, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0, 1.0];
    let (unique, t) = solved(&ports(1, 0.5), &g, &[-0.1, -1.0, 0.0]);
    assert!(unique, "the rounds have an end");
    let normal = 0.1 / 1.45;
    for (t, right) in t.iter().zip([normal, 0.5 * normal, 0.0]) {
        assert!((t - right).abs() < 1e-14, "{t} {right}");
    }
}

/// Numbers from 0 to 1, the same in every run.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[test]
fn feet_press_or_stay_open_and_stay_within_friction() {
    let (mut next, mut ended) = (numbers(), 0);
    for _ in 0..400 {
        let n = 12;
        let a: Vec<f64> = (0..n * n).map(|_| next() - 0.5).collect();
        let mut g = vec![0.0; n * n];
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let product: f64 = (0..n).map(|k| a[k * n + i] * a[k * n + j]).sum();
            g[j * n + i] = 0.2 * product + if i == j { 1.0 } else { 0.0 };
        }
        let gap: Vec<f64> = (0..n).map(|i| next() - if i % 3 == 0 { 0.7 } else { 0.5 }).collect();
        let list = ports(4, 0.6);
        let (unique, t) = solved(&list, &g, &gap);
        ended += u32::from(unique);
        let p = Problem { ports: &list, g: &g, gap: &gap };
        for first in (0..n).step_by(3) {
            let sideways = (t[first + 1].powi(2) + t[first + 2].powi(2)).sqrt();
            assert!(t[first] >= 0.0 && sideways <= 0.6 * t[first] * (1.0 + 1e-12) + 1e-15);
            let open = residual(&p, &t, first);
            assert!(open > -1e-8 && (t[first] == 0.0 || open.abs() < 1e-8), "{open} {}", t[first]);
        }
    }
    assert!(ended >= 399, "{ended} of 400 without sweeps");
}
