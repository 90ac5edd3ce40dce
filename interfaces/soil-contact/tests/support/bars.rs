//! What every soil on a height field must hold, called by the tests of each.
#![allow(dead_code, clippy::unwrap_used)]

use super::support::*;
use terraglue_subsystem::{Geometry, Module};

const FOOT: Geometry = Geometry::Sphere { radius: 0.03 };

/// A ball of 5 kg comes to rest: T1 = m·g, no drift, at a depth where the law carries it.
pub fn ball_rests<M: Module>(config: &str, iterative: bool) {
    let mut rig = Rig::new(soil::<M>(config, 65, 0.01, flat), FOOT, 5.0, 0.031);
    let step = |rig: &mut Rig| if iterative { rig.iterative_step() } else { rig.cooperative_step() };
    // gravity grows slowly: released at once, the ball would sink twice as deep
    for k in 0..2000 {
        rig.gravity = 9.81 * (f64::from(k) / 1500.0).min(1.0);
        step(&mut rig);
    }
    let (start, weight) = (rig.position, 5.0 * 9.81);
    for _ in 0..1000 {
        step(&mut rig);
        assert!((rig.t[0] - weight).abs() < 1e-8 * weight, "T1 = {} at {}", rig.t[0], rig.index);
    }
    let drift = (0..3).map(|k| (rig.position[k] - start[k]).abs()).fold(0.0, f64::max);
    assert!(drift <= 1e-9, "drift {drift}");
    // the depth is the law's own: it carries the weight there, hardly more, and nothing a millimetre higher
    rig.set_ports();
    let here = rig.under_motion(&[0.0; 3])[0];
    let higher = rig.under_motion(&[1e-3, 0.0, 0.0])[0];
    assert!(here >= weight * (1.0 - 1e-8) && here < 1.1 * weight && higher == 0.0, "{here} {higher}");
    assert!((read(&*rig.soil, "max_sinkage") - rig.sunk()).abs() < 2e-4, "sunk {}", rig.sunk());
    println!("sunk {:.3} mm, F {here:.2} N, evaluations {}", 1e3 * rig.sunk(), rig.evaluations);
}
