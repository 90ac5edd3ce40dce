//! One contact, exactly: open, sticking, or sliding against the force.
//!
//! Sliding: u_t = −α·r_t with α ≥ 0, u_n = 0, |r_t| = μ·r_n. With the normal eliminated this is one equation in α,
//! whose sign at α = 0 (no sticking solution inside the cone) and at α → ∞ (no friction) differ, so a root is always
//! found; it is the quartic of Bonnefon and Daviet (2011), taken by bracketing instead of by formula because the
//! coefficients of the quartic cancel for stiff contacts.

use crate::cone::norm2;

/// r for u = W·r + q with the 3 × 3 block `w` (row-major) of one contact.
pub(crate) fn solve(w: &[f64; 9], q: [f64; 3], mu: f64) -> [f64; 3] {
    if q[0] >= 0.0 {
        return [0.0; 3];
    }
    let inverse = 1.0 / w[0];
    if mu == 0.0 {
        return [-q[0] * inverse, 0.0, 0.0];
    }
    let schur = |i: usize, j: usize| w[3 * i + j] - w[3 * i] * w[j] * inverse;
    let s = [schur(1, 1), schur(1, 2), schur(2, 1), schur(2, 2)];
    let b = [q[1] - w[3] * q[0] * inverse, q[2] - w[6] * q[0] * inverse];
    let sigma = 0.5 * (s[0] + s[3]);
    if sigma <= 0.0 || sigma.is_nan() {
        return [-q[0] * inverse, 0.0, 0.0];
    }
    // p in [0, 1): α = σ·p/(1 − p).
    let at = |p: f64| {
        let (a, d) = ((1.0 - p) * s[0] + sigma * p, (1.0 - p) * s[3] + sigma * p);
        let (o1, o2) = ((1.0 - p) * s[1], (1.0 - p) * s[2]);
        let factor = -(1.0 - p) / (a * d - o1 * o2);
        let t = [factor * (d * b[0] - o1 * b[1]), factor * (a * b[1] - o2 * b[0])];
        let normal = -(q[0] + w[1] * t[0] + w[2] * t[1]) * inverse;
        ([normal, t[0], t[1]], norm2(t) - mu * normal)
    };
    let (stick, excess) = at(0.0);
    if excess <= 0.0 {
        return stick;
    }
    let p = root(|p| at(p).1, excess, mu * q[0] * inverse);
    let slide = at(p).0;
    let (size, normal) = (norm2([slide[1], slide[2]]), slide[0].max(0.0));
    let factor = if size > 0.0 { mu * normal / size } else { 0.0 };
    [normal, factor * slide[1], factor * slide[2]]
}

/// Root in [0, 1] of a function that is positive at 0 and negative at 1 (Illinois, guarded by bisection).
fn root(f: impl Fn(f64) -> f64, at_0: f64, at_1: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let (mut f_low, mut f_high) = (at_0, at_1);
    let mut last = 0;
    for step in 0..100 {
        let secant = high - f_high * (high - low) / (f_high - f_low);
        let inside = secant > low && secant < high && step % 4 != 3;
        let p = if inside { secant } else { 0.5 * (low + high) };
        let value = f(p);
        if value == 0.0 || high - low <= 2e-16 {
            return p;
        }
        let side = if value > 0.0 { 1 } else { -1 };
        if side > 0 {
            (low, f_low) = (p, value);
            f_high *= if last == side { 0.5 } else { 1.0 };
        } else {
            (high, f_high) = (p, value);
            f_low *= if last == side { 0.5 } else { 1.0 };
        }
        last = side;
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::solve;
    use crate::problem::Problem;

    fn residual(w: &[f64; 9], q: [f64; 3], mu: f64) -> f64 {
        let r = solve(w, q, mu);
        let problem = Problem::new(w, &q, std::slice::from_ref(&mu)).expect("a problem");
        let mut u = [0.0; 3];
        problem.velocity(&r, &mut u);
        problem.residual(&r, &u)
    }

    #[test]
    fn open_sticking_and_sliding_contacts_are_exact() {
        let w = [1.3, 0.2, -0.1, 0.2, 0.9, 0.3, -0.1, 0.3, 2.0];
        for q in [[1.0, 5.0, 0.0], [-1.0, 0.1, 0.1], [-1.0, 5.0, -2.0], [-1e-9, 1.0, 0.0], [-1.0, 1e-9, 0.0]]
        {
            for mu in [0.0, 1e-3, 0.5, 3.0] {
                assert!(residual(&w, q, mu) < 1e-14, "{q:?} {mu} {}", residual(&w, q, mu));
            }
        }
    }

    #[test]
    fn friction_that_presses_the_rod_into_the_ground_still_has_an_answer() {
        // Painlevé: a slip that friction turns into pressure.
        let w = [0.4, -0.9, 0.0, -0.9, 2.6, 0.0, 0.0, 0.0, 1.0];
        assert!(residual(&w, [-1e-3, -4.0, 0.0], 2.0) < 1e-14);
        assert!(residual(&w, [-1e-3, 4.0, 0.0], 2.0) < 1e-14);
    }
}
