//! Vectors along n, t1, t2 of a port, and the stiffness between them.

/// A 6 × 6 stiffness, rows: components of the wrench on the soil, columns: components of X.
pub type Stiffness = [[f64; 6]; 6];

/// Displacement along n, t1, t2 of a point at `arm` for X = (u, θ): u + θ × arm.
#[inline]
pub fn displacement(arm: [f64; 3], x: &[f64; 6]) -> [f64; 3] {
    let [u_n, u_1, u_2, w_n, w_1, w_2] = *x;
    let [r_n, r_1, r_2] = arm;
    [u_n + w_1 * r_2 - w_2 * r_1, u_1 + w_2 * r_n - w_n * r_2, u_2 + w_n * r_1 - w_1 * r_n]
}

/// Scalar product of vectors along n, t1, t2.
#[inline]
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
