//! Bodies whose contact is a line or a point no broader than a few cells: pressed straight down, wherever they lie on the lattice.
#![allow(dead_code, clippy::unwrap_used)]

use super::support::{Fixture, LETE, flat, read, soil};
use terraglue_subsystem::{Geometry, Module};

/// A body: how it is turned about its own axes (quaternion w x y z), and its height above its lowest point then, m.
pub struct Body {
    pub geometry: Geometry,
    pub turned: [f64; 4],
    pub above: f64,
}

fn about(axis: usize, angle: f64) -> [f64; 4] {
    let mut q = [(0.5 * angle).cos(), 0.0, 0.0, 0.0];
    q[1 + axis] = (0.5 * angle).sin();
    q
}

fn times(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// A box of 60 × 100 × 60 mm on one of its long edges.
pub fn edge() -> Body {
    let geometry = Geometry::Box { half_extents: [0.03, 0.05, 0.03] };
    Body { geometry, turned: about(1, std::f64::consts::FRAC_PI_4), above: 0.03 * 2f64.sqrt() }
}

/// A lying capsule of 20 mm radius, 100 mm from ball to ball.
pub fn capsule() -> Body {
    let geometry = Geometry::Capsule { half_length: 0.05, radius: 0.02 };
    Body { geometry, turned: about(1, std::f64::consts::FRAC_PI_2), above: 0.02 }
}

/// A cube of 80 mm, corner first.
pub fn corner() -> Body {
    let geometry = Geometry::Box { half_extents: [0.04; 3] };
    let tip = times(about(1, (0.5f64.sqrt()).atan()), about(0, std::f64::consts::FRAC_PI_4));
    Body { geometry, turned: tip, above: 0.04 * 3f64.sqrt() }
}

/// A sphere of 20 mm.
pub fn ball() -> Body {
    Body { geometry: Geometry::Sphere { radius: 0.02 }, turned: [1.0, 0.0, 0.0, 0.0], above: 0.02 }
}

/// Force up and along x (N) on a body that was pressed to `depth` (m) at the place `at`.
pub fn forces<M: Module>(body: &Body, spacing: f64, depth: f64, at: [f64; 2]) -> [f64; 2] {
    let mut fixture = placed::<M>(body, spacing, (0.0, at));
    let mut t = Vec::new();
    for _ in 0..100 {
        t = fixture.prescribed_step(&[-0.01 * depth, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
    [t[0], t[1]]
}

/// The depth that the soil reports of a body that was pressed to `depth` (m) at a `place`.
pub fn told<M: Module>(body: &Body, spacing: f64, depth: f64, place: (f64, [f64; 2])) -> f64 {
    let mut fixture = placed::<M>(body, spacing, place);
    for _ in 0..100 {
        fixture.prescribed_step(&[-0.01 * depth, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
    read(&*fixture.soil, "contact1.sinkage")
}

fn placed<M: Module>(body: &Body, spacing: f64, (yaw, at): (f64, [f64; 2])) -> Fixture {
    let size = (0.24 / spacing) as u32 | 1;
    let shown = format!("{}, \"contacts_shown\": 1}}", LETE.trim_end_matches('}'));
    let mut fixture =
        Fixture::new(soil::<M>(&shown, size, spacing, flat), body.geometry.clone(), 1.0, body.above);
    fixture.orientation = times(about(2, yaw), body.turned);
    fixture.turned = true;
    fixture.position = [at[0], at[1], body.above];
    fixture
}

/// Depth (m) at which the body carries `load` (N), pressed in steps of `step` (m); turned about the vertical and put
/// at a `place`.
pub fn pressed<M: Module>(body: &Body, spacing: f64, load: f64, step: f64, place: (f64, [f64; 2])) -> f64 {
    let mut fixture = placed::<M>(body, spacing, place);
    let down = [-step, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut before = (0.0, 0.0);
    for k in 1..4000 {
        let now = (step * f64::from(k), fixture.prescribed_step(&down)[0]);
        if now.1 >= load {
            return before.0 + (now.0 - before.0) * (load - before.1) / (now.1 - before.1);
        }
        before = now;
    }
    f64::NAN
}
