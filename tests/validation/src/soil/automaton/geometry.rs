//! The underside of every shape against the definition of the shape, any orientation.

use super::feet::{Dice, shape};
use crate::{Context, Figure, Limit};
use terraglue_ground::{Placed, Rotation};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{Geometry, Pose};

const NAMES: [&str; 5] = ["sphere", "box", "capsule", "cylinder", "convex_mesh"];
/// Distance of the points at which the vertical line is tried, m.
const SCAN: f64 = 2e-4;
/// Half the height that is scanned, m.
const REACH: f64 = 0.08;

/// Whether a point of the shape's frame lies inside, by the definition of the shape.
fn inside(geometry: &Geometry, p: [f64; 3]) -> bool {
    let across = p[0].hypot(p[1]);
    match geometry {
        Geometry::Sphere { radius } => across.hypot(p[2]) <= *radius,
        Geometry::Box { half_extents: h } => (0..3).all(|k| p[k].abs() <= h[k]),
        Geometry::Capsule { half_length, radius } => {
            across.hypot((p[2].abs() - half_length).max(0.0)) <= *radius
        }
        Geometry::Cylinder { half_length, radius } => across <= *radius && p[2].abs() <= *half_length,
        Geometry::ConvexMesh { points, triangles } => triangles.iter().all(|t| {
            let [a, b, c] = t.map(|k| points[k as usize]);
            let edge = |q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| q[k] - a[k]) };
            let (u, v, w) = (edge(b), edge(c), edge(p));
            // on the inner side of a triangle that is counter-clockwise from outside
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            (0..3).map(|k| normal[k] * w[k]).sum::<f64>() <= 0.0
        }),
        Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
            let up = 0.5 * (1.0 + p[2] / half_length);
            p[2].abs() <= *half_length && across <= (1.0 - up) * radius_bottom + up * radius_top
        }
        Geometry::Ellipsoid { semi_axes: a } => (0..3).map(|k| (p[k] / a[k]).powi(2)).sum::<f64>() <= 1.0,
        // it has no inside, and soil does not meet it
        Geometry::Mesh { .. } => false,
    }
}

/// Lower end of the vertical line inside the shape by trying points and halving; `None`: none of them is inside.
fn found(geometry: &Geometry, rotation: &Rotation, [x, y]: [f64; 2]) -> Option<f64> {
    let hit = |z: f64| inside(geometry, rotation.to_shape([x, y, z]));
    let z = |k: u32| SCAN * f64::from(k) - REACH;
    let first = (1..(2.0 * REACH / SCAN) as u32).find(|k| hit(z(*k)))?;
    let (mut out, mut within) = (z(first - 1), z(first));
    while within - out > 1e-12 {
        let middle = 0.5 * (out + within);
        if hit(middle) { within = middle } else { out = middle }
    }
    Some(within)
}

/// Largest error over random orientations and points, m; a line that only the scan finds counts as a metre.
fn worst(kind: u32, orientations: u32) -> f64 {
    let (geometry, mut dice) = (shape(kind), Dice(4711 + u64::from(kind)));
    let mut worst: f64 = 0.0;
    for _ in 0..orientations {
        let pose = Pose { position: [0.0; 3], orientation: dice.turn() };
        let (placed, rotation) = (Placed::new(&geometry, &pose), Rotation::from_quaternion(pose.orientation));
        for _ in 0..40 {
            let at = [dice.roll(-0.05, 0.05), dice.roll(-0.05, 0.05)];
            worst = match (placed.lower(at[0], at[1]), found(&geometry, &rotation, at)) {
                (Some(exact), Some(found)) => larger(worst, (exact - found).abs()),
                (None, Some(_)) => 1.0,
                // a chord shorter than the scan's step
                _ => worst,
            };
        }
    }
    worst
}

/// One figure per shape.
pub fn figures(context: &Context) -> Vec<Figure> {
    let orientations = if context.quick { 100 } else { 5000 };
    let figure = |(kind, name): (u32, &&str)| {
        let what = format!(
            "largest error of the underside, µm, at {} points below {orientations} random orientations",
            40 * orientations
        );
        let id = format!("soil.automaton.underside.{name}");
        Figure::new(id, 1e6 * worst(kind, orientations), Limit::AtMost(1.0), what)
    };
    (0..).zip(&NAMES).map(figure).collect()
}
