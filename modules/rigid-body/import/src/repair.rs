//! Replacement of an inertia tensor that no body can have.

use crate::inertia::{flaw, shown};
use crate::model::{Body, Shape};
use crate::solid::evenly;
use nalgebra::{Matrix3, SymmetricEigen};

/// A body is at least this part of its size thick, squared: rods and sheets keep an inertia that can be inverted.
const THINNEST: f64 = 1e-6;

/// Radius of the ball that replaces a body of unknown shape, m.
const BALL: f64 = 0.01;

/// Gives a body an inertia that it can have; returns the fault and the replacement, if there was one.
pub(crate) fn repair(body: &mut Body) -> Option<String> {
    let flaw = flaw(&body.inertia)?;
    let (used, how) = if body.inertia == Matrix3::zeros() {
        in_place_of_none(body.mass, &body.shapes)
    } else {
        (nearest(&body.inertia), "the nearest that a body can have")
    };
    body.inertia = used;
    let [xx, xy, xz] = [0, 1, 2].map(|k| used[(0, k)]);
    let [yy, yz, zz] = [used[(1, 1)], used[(1, 2)], used[(2, 2)]];
    Some(format!(
        "{flaw}; used instead is {how}: {}; ixx = {xx:.6e}, ixy = {xy:.6e}, ixz = {xz:.6e}, iyy = {yy:.6e}, iyz = {yz:.6e}, \
         izz = {zz:.6e} about the centre of mass in the link's axes",
        shown(&used)
    ))
}

/// The tensor whose covariance is the nearest without negative eigenvalues, in the norm of Frobenius.
fn nearest(tensor: &Matrix3<f64>) -> Matrix3<f64> {
    let covariance = Matrix3::from_diagonal_element(0.5 * tensor.trace()) - tensor;
    let parts = SymmetricEigen::new(covariance);
    let total: f64 = parts.eigenvalues.iter().map(|v| v.max(0.0)).sum();
    let clamped = parts.eigenvalues.map(|v| v.max(THINNEST * total));
    let v = parts.eigenvectors;
    let covariance = v * Matrix3::from_diagonal(&clamped) * v.transpose();
    Matrix3::from_diagonal_element(covariance.trace()) - covariance
}

/// Inertia of the collision shapes, else of the visual ones, filled evenly; else of a small ball.
fn in_place_of_none(mass: f64, shapes: &[Shape]) -> (Matrix3<f64>, &'static str) {
    let of = |collides: bool| evenly(mass, shapes.iter().filter(move |s| s.collides == collides));
    match of(true).or_else(|| of(false)).filter(|i| flaw(&i.tensor).is_none()) {
        Some(filled) => (filled.tensor, "that of its shapes filled evenly"),
        None => (
            Matrix3::from_diagonal_element(0.4 * mass * BALL * BALL),
            "that of a ball of 1 cm radius, for it has no shape that encloses anything",
        ),
    }
}
