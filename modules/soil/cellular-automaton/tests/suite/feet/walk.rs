//! Feet that walk in prescribed motion: the tripod gait by which the cost of a soil is measured.

use super::Feet;
use terraglue_subsystem::{Geometry, Pose};

const RADIUS: f64 = 0.04;
const STRIDE: f64 = 0.16;
const SPEED: f64 = 0.32;
/// Start of the walk, m.
const START: f64 = -4.0;
const HIPS: [([f64; 2], f64); 6] = [
    ([0.3, 0.25], 0.0),
    ([0.0, 0.3], 0.5),
    ([-0.3, 0.25], 0.0),
    ([0.3, -0.25], 0.5),
    ([0.0, -0.3], 0.0),
    ([-0.3, -0.25], 0.5),
];
/// Between two walkers, m.
const APART: f64 = 5.0;

/// Pose of foot k of a walk at time t (s): cycle 1 s, half of it on the ground and 2 cm in it.
fn pose(k: usize, t: f64) -> Pose {
    let ([hip_x, hip_y], phase) = HIPS[k % 6];
    let u = (t + phase).fract();
    let x0 = START + SPEED * (t - u) + hip_x + 0.5 * STRIDE;
    let (x, z) = if u < 0.5 {
        (x0, RADIUS - 0.02 * (u / 0.1).min(1.0))
    } else {
        let w = 2.0 * u - 1.0;
        (x0 + SPEED * w, RADIUS - 0.02 + 0.1 * libm::sin(std::f64::consts::PI * w) + 0.02 * w)
    };
    Pose { position: [x, hip_y + APART * (k / 6) as f64, z], ..Pose::IDENTITY }
}

/// Walks with `feet` feet for `seconds`; `clock` (s) is read before and after every step. Seconds per step.
pub fn walk(fixture: &mut Feet, feet: usize, seconds: f64, clock: impl FnMut() -> f64) -> Vec<f64> {
    walk_with(fixture, feet, seconds, clock, |_| ())
}

/// The same; `look` is called after every step.
pub fn walk_with(
    fixture: &mut Feet,
    feet: usize,
    seconds: f64,
    mut clock: impl FnMut() -> f64,
    mut look: impl FnMut(&Feet),
) -> Vec<f64> {
    for k in 0..feet {
        fixture.add(&Geometry::Sphere { radius: RADIUS }, pose(k, 0.0));
    }
    let steps = (seconds / super::H).round() as u32;
    (1..=steps)
        .map(|step| {
            let t = f64::from(step) * super::H;
            let before = clock();
            fixture.step(|k| pose(k, t));
            let spent = clock() - before;
            look(fixture);
            spent
        })
        .collect()
}
