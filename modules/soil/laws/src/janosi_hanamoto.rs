//! The law of Janosi and Hanamoto: Mohr–Coulomb strength, mobilised by slip.
//!
//! Strength S = c + p·tan φ (Coulomb 1776). A monotone shear displacement j mobilises S·(1 − e^(−j/K)) of it (Janosi and
//! Hanamoto 1961, Proc. 1st Int. Conf. Terrain-Vehicle Systems).

use crate::build_up::BUILD_UP;
use crate::shear_strength::ShearStrength;
use terraglue_subsystem::Result;

/// Strength of Mohr and Coulomb, mobilised by slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JanosiHanamoto {
    /// Cohesion c, Pa.
    pub cohesion: f64,
    /// tan φ.
    pub friction: f64,
    /// Shear deformation modulus K, m.
    pub modulus: f64,
}

impl JanosiHanamoto {
    /// Full strength S at pressure p and its derivative, Pa. Cohesion builds up over the first c/10 of pressure,
    /// so that the strength does not jump where the foot begins to touch.
    #[inline]
    pub fn strength(&self, p: f64) -> (f64, f64) {
        let p = p.max(0.0);
        if BUILD_UP * p < self.cohesion {
            (p * (self.friction + BUILD_UP), self.friction + BUILD_UP)
        } else {
            (self.cohesion + p * self.friction, self.friction)
        }
    }

    /// Share of the strength that a slip j (m) has mobilised, 1 − e^(−j/K).
    #[inline]
    pub fn mobilised(&self, slip: f64) -> f64 {
        if slip == 0.0 { 0.0 } else { -libm::expm1(-slip / self.modulus) }
    }

    /// Solves trial − k_t·Δj = S·(1 − e^(−(j + w·Δj)/K)) for the slip increment Δj (m), which counts `weight` = w; k_t is
    /// `stiffness` (Pa/m). The left side minus the right is convex and falling, so Newton from Δj = 0 (where the exponential is
    /// `left`) climbs to the root without passing it, and the error of a step is below the square of the one before. Returns Δj
    /// and e^(−(j + w·Δj)/K).
    pub(crate) fn return_map(
        &self,
        stiffness: f64,
        trial: f64,
        strength: f64,
        weight: f64,
        mut left: f64,
    ) -> (f64, f64) {
        let (mut step, before) = (0.0, left);
        for _ in 0..30 {
            let residual = trial - stiffness * step - strength * (1.0 - left);
            let change = residual / (stiffness + weight * strength / self.modulus * left);
            step += change;
            left = before * decay(weight * step / self.modulus);
            if change <= 1e-8 * step {
                break;
            }
        }
        (step, left)
    }
}

impl ShearStrength for JanosiHanamoto {
    fn cohesion(&self) -> f64 {
        self.cohesion
    }

    fn friction(&self) -> f64 {
        self.friction
    }

    #[inline]
    fn yield_stress(&self, pressure: f64, slip: f64, _kept: &[f64]) -> Result<(f64, [f64; 2])> {
        let ((strength, by_p), mobilised) = (self.strength(pressure), self.mobilised(slip));
        let by_slip = strength * (1.0 - mobilised) / self.modulus;
        Ok((strength * mobilised, [by_p * mobilised, by_slip]))
    }
}

/// Up to here seven terms of the series of e^(−x) reach rounding: x⁸/8! is below 3e-17.
const SMALL: f64 = 1.0 / 32.0;

/// e^(−x) for x ≥ 0; the slip of a step is mostly so small a part of the modulus that its series is enough.
#[inline]
fn decay(x: f64) -> f64 {
    if x > SMALL || x.is_nan() {
        return libm::exp(-x);
    }
    let from_third = 1.0 - x * (0.25 - x * (1.0 / 20.0 - x * (1.0 / 120.0 - x * (1.0 / 840.0))));
    1.0 - x * (1.0 - x * (0.5 - x * (1.0 / 6.0) * from_third))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_decay_is_the_exponential() {
        for k in 0..=4000 {
            let x = f64::from(k) / 64_000.0;
            assert!((decay(x) / libm::exp(-x) - 1.0).abs() < 4e-16, "{x}");
        }
    }

    #[test]
    fn the_slopes_are_the_derivatives() {
        let law = JanosiHanamoto { cohesion: 170.0, friction: 0.7, modulus: 0.018 };
        let at = |p, j| law.yield_stress(p, j, &[]).expect("an answer");
        for (p, j) in [(5.0, 1e-3), (400.0, 4e-3), (5000.0, 0.03)] {
            let (_, [by_p, by_j]) = at(p, j);
            let (dp, dj) = (1e-3, 1e-8);
            assert!(((at(p + dp, j).0 - at(p - dp, j).0) / (2.0 * dp) - by_p).abs() < 1e-6, "{p} {j}");
            let slope = (at(p, j + dj).0 - at(p, j - dj).0) / (2.0 * dj);
            assert!((slope / by_j - 1.0).abs() < 1e-5, "{p} {j}: {slope} {by_j}");
        }
    }
}
