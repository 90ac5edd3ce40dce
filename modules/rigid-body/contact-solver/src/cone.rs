//! Projections on the disc and on Coulomb's cone |r_t| ≤ μ·r_n.

/// Euclidean norm of a tangential vector.
pub(crate) fn norm2(v: [f64; 2]) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

/// The point nearest to (r_n, r_t1, r_t2) with |r_t| ≤ μ·r_n.
pub fn project(mu: f64, r: [f64; 3]) -> [f64; 3] {
    let tangential = norm2([r[1], r[2]]);
    if r[0] >= 0.0 && tangential <= mu * r[0] {
        return r;
    }
    let along = r[0] + mu * tangential;
    if along <= 0.0 {
        return [0.0; 3];
    }
    let normal = along / (1.0 + mu * mu);
    let factor = mu * normal / tangential;
    [normal, factor * r[1], factor * r[2]]
}

#[cfg(test)]
mod tests {
    use super::project;

    #[test]
    fn projections_stay_inside_return_to_the_tip_and_meet_the_surface_at_right_angles() {
        assert_eq!(project(0.5, [1.0, 0.3, 0.0]), [1.0, 0.3, 0.0]);
        assert_eq!(project(0.5, [-1.0, 0.0, 1.0]), [0.0; 3]);
        let p = project(0.5, [1.0, 0.0, 2.0]);
        assert!((p[2] - 0.5 * p[0]).abs() < 1e-15);
        // The remainder is orthogonal to the generator (1, μ).
        assert!(((1.0 - p[0]) + 0.5 * (2.0 - p[2])).abs() < 1e-15);
        assert_eq!(project(0.0, [1.0, 3.0, 0.0]), [1.0, 0.0, 0.0]);
        assert_eq!(project(0.0, [-1.0, 0.0, 0.0]), [0.0; 3]);
    }
}
