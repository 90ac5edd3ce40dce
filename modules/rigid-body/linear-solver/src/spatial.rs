//! 6 × 6 inertias and 6-vectors of bodies: translation first, then rotation, about centres of mass, world axes.

use nalgebra::{Matrix3, Vector3};

/// A force and a moment, or the rates that belong to them.
pub type Wrench = [f64; 6];

/// A symmetric 6 × 6 matrix by rows.
pub(crate) type Inertia = [[f64; 6]; 6];

#[inline]
pub(crate) fn dot(a: &Wrench, b: &Wrench) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
}

/// a += factor·b.
#[inline]
pub(crate) fn add(a: &mut Wrench, factor: f64, b: &Wrench) {
    for k in 0..6 {
        a[k] += factor * b[k];
    }
}

/// Of a single body.
pub(crate) fn of_body(mass: f64, inertia: &Matrix3<f64>) -> Inertia {
    let mut a = [[0.0; 6]; 6];
    for k in 0..3 {
        a[k][k] = mass;
        for i in 0..3 {
            a[3 + i][3 + k] = inertia[(i, k)];
        }
    }
    a
}

#[inline]
pub(crate) fn times(a: &Inertia, v: &Wrench) -> Wrench {
    // By columns: the matrix is symmetric, and sums of columns vectorise.
    let mut out = [0.0; 6];
    for k in 0..6 {
        add(&mut out, v[k], &a[k]);
    }
    out
}

/// a −= factor·u·uᵀ.
#[inline]
pub(crate) fn deflate(a: &mut Inertia, factor: f64, u: &Wrench) {
    for k in 0..6 {
        add(&mut a[k], -factor * u[k], u);
    }
}

/// target += XᵀAX, where X moves rates from a point to the one that lies r further.
#[inline]
pub(crate) fn add_shifted(target: &mut Inertia, a: &Inertia, r: &Vector3<f64>) {
    let mut ax = *a;
    for row in &mut ax {
        let l = [row[0], row[1], row[2]];
        row[3] += r.y * l[2] - r.z * l[1];
        row[4] += r.z * l[0] - r.x * l[2];
        row[5] += r.x * l[1] - r.y * l[0];
    }
    for k in 0..6 {
        target[0][k] += ax[0][k];
        target[1][k] += ax[1][k];
        target[2][k] += ax[2][k];
        target[3][k] += ax[3][k] + r.y * ax[2][k] - r.z * ax[1][k];
        target[4][k] += ax[4][k] + r.z * ax[0][k] - r.x * ax[2][k];
        target[5][k] += ax[5][k] + r.x * ax[1][k] - r.y * ax[0][k];
    }
}

/// Xᵀ·p: the wrench p about the point that lies r further, about this one.
#[inline]
pub(crate) fn wrench_back(p: &Wrench, r: &Vector3<f64>) -> Wrench {
    [
        p[0],
        p[1],
        p[2],
        p[3] + r.y * p[2] - r.z * p[1],
        p[4] + r.z * p[0] - r.x * p[2],
        p[5] + r.x * p[1] - r.y * p[0],
    ]
}

/// X·v: rates of the point that lies r further.
#[inline]
pub(crate) fn rates_further(v: &Wrench, r: &Vector3<f64>) -> Wrench {
    [
        v[0] + v[4] * r.z - v[5] * r.y,
        v[1] + v[5] * r.x - v[3] * r.z,
        v[2] + v[3] * r.y - v[4] * r.x,
        v[3],
        v[4],
        v[5],
    ]
}

/// Six neighbouring unknowns.
#[inline]
pub(crate) fn at(x: &[f64], first: usize) -> Wrench {
    let s = &x[first..first + 6];
    [s[0], s[1], s[2], s[3], s[4], s[5]]
}
