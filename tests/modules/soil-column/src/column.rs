//! One column: power law on first loading, straight unloading, closed inverse; Coulomb friction with an elastic
//! stick branch.

/// Below this force (N) the tangent of the power law is taken at it: for n > 1 it grows without bound at 0.
const REGULARISED_N: f64 = 1e-3;

/// T = K·zⁿ on first loading; below the deepest point a straight line of slope k_u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnLaw {
    /// K, N/mⁿ.
    pub k: f64,
    /// n, dimensionless.
    pub n: f64,
    /// Unloading stiffness, N/m; never taken below the tangent of loading at the deepest point.
    pub k_u: f64,
    /// Tangential stiffness while the foot sticks, N/m.
    pub k_t: f64,
    /// Coulomb coefficient, dimensionless.
    pub mu: f64,
}

impl ColumnLaw {
    /// Force of first loading at depth z (m), N.
    pub fn loading(&self, z: f64) -> f64 {
        if z > 0.0 { self.k * libm::pow(z, self.n) } else { 0.0 }
    }

    /// Slope of first loading, N/m.
    fn loading_slope(&self, z: f64) -> f64 {
        let force = self.loading(z).max(REGULARISED_N);
        let z = libm::pow(force / self.k, 1.0 / self.n);
        self.n * force / z
    }

    /// Stiffness of unloading from z_max, N/m.
    fn unloading_slope(&self, z_max: f64) -> f64 {
        self.k_u.max(self.loading_slope(z_max))
    }

    /// Depth at which a column that was once z_max deep carries nothing, m.
    pub fn free_depth(&self, z_max: f64) -> f64 {
        (z_max - self.loading(z_max) / self.unloading_slope(z_max)).max(0.0)
    }

    /// Normal force (N) at depth z and its slope (N/m).
    pub fn force(&self, z_max: f64, z: f64) -> (f64, f64) {
        if z >= z_max && z > 0.0 {
            return (self.loading(z), self.loading_slope(z));
        }
        let slope = self.unloading_slope(z_max);
        let force = self.loading(z_max) - slope * (z_max - z);
        if force > 0.0 { (force, slope) } else { (0.0, 0.0) }
    }

    /// Depth (m) at a normal force and its slope (m/N): the inverse of [`Self::force`] on the closed branch.
    pub fn depth(&self, z_max: f64, force: f64) -> (f64, f64) {
        let most = self.loading(z_max);
        if force <= most && z_max > 0.0 {
            let slope = self.unloading_slope(z_max);
            return (z_max - (most - force.max(0.0)) / slope, 1.0 / slope);
        }
        let z = libm::pow(force.max(0.0) / self.k, 1.0 / self.n);
        (z, 1.0 / self.loading_slope(z))
    }

    /// Tangential force on the body (N): the elastic trial force t0 − k_t·x, returned to the cone mu·T_n. The
    /// second value is |trial| where the foot slides, else 0.
    pub fn friction(&self, t0: [f64; 2], x: [f64; 2], t_n: f64) -> ([f64; 2], f64) {
        let trial = [t0[0] - self.k_t * x[0], t0[1] - self.k_t * x[1]];
        let (size, bound) = (libm::hypot(trial[0], trial[1]), self.mu * t_n.max(0.0));
        if bound <= 0.0 {
            return ([0.0; 2], f64::MIN_POSITIVE);
        }
        if size <= bound {
            return (trial, 0.0);
        }
        ([trial[0] * bound / size, trial[1] * bound / size], size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: ColumnLaw = ColumnLaw { k: 8340.0, n: 1.3, k_u: 2e5, k_t: 1e5, mu: 0.6 };

    #[test]
    fn depth_inverts_force_on_both_branches() {
        for z_max in [0.0, 1e-4, 0.02] {
            for force in [1e-2, 1.0, 30.0, 200.0] {
                let (z, compliance) = LAW.depth(z_max, force);
                let (back, slope) = LAW.force(z_max, z);
                assert!((back - force).abs() < 1e-10 * force, "{z_max} {force}: {back}");
                assert!((compliance * slope - 1.0).abs() < 1e-9, "{z_max} {force}: {compliance} {slope}");
            }
        }
    }

    #[test]
    fn slopes_are_derivatives() {
        for (z_max, z) in [(0.0, 0.01), (0.02, 0.0199), (0.02, 0.03)] {
            let (_, slope) = LAW.force(z_max, z);
            let d = 1e-8;
            let numeric = (LAW.force(z_max, z + d).0 - LAW.force(z_max, z - d).0) / (2.0 * d);
            assert!((slope - numeric).abs() < 1e-5 * slope, "{slope} {numeric}");
        }
    }

    #[test]
    fn unloading_never_pulls_and_ends_at_the_free_depth() {
        let z_max = 0.02;
        let free = LAW.free_depth(z_max);
        assert!(free > 0.0 && free < z_max);
        assert_eq!(LAW.force(z_max, free - 1e-6), (0.0, 0.0));
        assert!(LAW.force(z_max, free + 1e-6).0 > 0.0);
    }

    #[test]
    fn friction_sticks_then_slides_against_the_motion() {
        let (stick, trial) = LAW.friction([0.0; 2], [1e-5, 0.0], 10.0);
        assert_eq!((stick, trial), ([-1.0, 0.0], 0.0));
        let (slide, trial) = LAW.friction([0.0; 2], [0.0, 1e-3], 10.0);
        assert!((slide[1] + 6.0).abs() < 1e-12 && (trial - 100.0).abs() < 1e-9);
    }
}
