//! Pressure under a contact of one size as a function of sinkage, with elastic unloading.
//!
//! First loading follows the law. Below the largest depth reached the soil is elastic: p = p_max − k_u·(z_max − z), never
//! tension (Wong 1984, "repetitive normal load").
//! No soil is stiffer in first loading than in unloading, so for n < 1, where a power law starts with an
//! infinite slope, the line p = k_u·z holds up to where it meets the power law. For n > 1, whose slope grows without bound,
//! it goes on straight where the slope has come to 0.99 k_u: beyond, unloading would give back more than was put in. So do
//! laws as text and as modules.

use crate::first_loading::FirstLoading;
use crate::inverse;
use crate::plugin::PluginLaw;
use crate::straight::{STIFFEST, Straight};
use terraglue_subsystem::Result;

/// p(z) for one contact: a power law, a program or a module, elastic below the largest depth.
#[derive(Clone, Debug, PartialEq)]
pub struct PressureCurve {
    /// Of a law that is no power law, modulus and exponent of the power law that touches it at 1 cm.
    modulus: f64,
    exponent: f64,
    unloading: f64,
    /// Depth up to which the elastic line holds in first loading, m; 0 for n ≥ 1.
    elastic_limit: f64,
    /// Depth from which first loading goes on straight, m; infinite where nothing sinks as deep. 0 where n = 1 and the modulus
    /// itself is bounded.
    stiff_limit: f64,
    /// Continuation there of a law that is no power law.
    straight: Straight,
    law: FirstLoading,
}

/// Depth at which a law that is no power law is compared with one, m.
const TYPICAL_DEPTH: f64 = 0.01;
/// Depth that no contact reaches, m.
const BOTTOMLESS: f64 = 1e3;

impl PressureCurve {
    /// p = modulus·z^exponent with unloading stiffness `k_u` (Pa/m).
    pub fn new(modulus: f64, exponent: f64, k_u: f64) -> Self {
        let elastic_limit =
            if exponent < 1.0 { libm::pow(modulus / k_u, 1.0 / (1.0 - exponent)) } else { 0.0 };
        let stiff_limit = if exponent > 1.0 {
            let z = libm::pow(STIFFEST * k_u / (exponent * modulus), 1.0 / (exponent - 1.0));
            if z < BOTTOMLESS { z } else { f64::INFINITY }
        } else if exponent == 1.0 && modulus > STIFFEST * k_u {
            0.0
        } else {
            f64::INFINITY
        };
        let modulus = if exponent == 1.0 { modulus.min(STIFFEST * k_u) } else { modulus };
        let law = FirstLoading::Power { modulus, exponent };
        Self { modulus, exponent, unloading: k_u, elastic_limit, stiff_limit, straight: Straight::NONE, law }
    }

    /// The curve of a law that is no power law. `gentle`: it is nowhere stiffer than unloading beyond the elastic limit. A law
    /// with a state covers unloading, too, and is evaluated through [`PressureCurve::keeper`] alone.
    ///
    /// # Errors
    /// The law has no answer.
    pub fn of(law: FirstLoading, k_u: f64, gentle: bool) -> Result<Self> {
        let mut out = Self {
            modulus: 0.0,
            exponent: 1.0,
            unloading: k_u,
            elastic_limit: 0.0,
            stiff_limit: f64::INFINITY,
            straight: Straight::NONE,
            law,
        };
        if out.keeper().is_some() {
            return Ok(out);
        }
        let (p, slope) = out.law.at(TYPICAL_DEPTH)?;
        out.exponent = slope * TYPICAL_DEPTH / p;
        out.modulus = p * libm::pow(TYPICAL_DEPTH, -out.exponent);
        out.elastic_limit = inverse::elastic_limit(&|z| out.law.at(z), k_u)?;
        if !gentle {
            out.straight = Straight::find(&|z, p, slope| out.law.look(z, p, slope), out.elastic_limit, k_u);
            out.stiff_limit = out.straight.begin();
        }
        Ok(out)
    }

    /// Pressure and slope of a law that is no power law beyond the elastic limit.
    #[inline]
    fn beyond(&self, z: f64) -> Result<(f64, f64)> {
        let own = self.law.at(z)?;
        Ok(if z > self.stiff_limit { self.straight.bend(z, own) } else { own })
    }

    /// Whether first loading is better evaluated for many nodes at a time.
    #[inline]
    pub fn is_batched(&self) -> bool {
        !matches!(self.law, FirstLoading::Power { .. })
    }

    /// First loading of a law that is no power law beyond the elastic limit at all depths of a chunk: pressures and slopes.
    #[inline]
    pub(crate) fn beyond_many(&self, z: &[f64], p: &mut [f64], slope: &mut [f64]) -> Result {
        self.law.at_all(z, p, slope)?;
        if self.stiff_limit < f64::INFINITY {
            for ((z, p), slope) in z.iter().zip(p).zip(slope).filter(|((z, _), _)| **z > self.stiff_limit) {
                (*p, *slope) = self.straight.bend(*z, (*p, *slope));
            }
        }
        Ok(())
    }

    /// The module with a state that answers for all pressures, and the size of the contact, m.
    #[inline]
    pub fn keeper(&self) -> Option<(&PluginLaw, f64)> {
        match &self.law {
            FirstLoading::Module(law, b) if law.state_doubles() > 0 => Some((law, *b)),
            _ => None,
        }
    }
    /// Depth up to which first loading is elastic, m.
    pub fn elastic_limit(&self) -> f64 {
        self.elastic_limit
    }

    /// Depth from which first loading goes on straight, m, since the law is stiffer than unloading there; infinite where it
    /// is not.
    pub fn straight_from(&self) -> f64 {
        self.stiff_limit
    }

    /// Pressure where first loading begins to go on straight, Pa.
    fn stiff_pressure(&self) -> f64 {
        STIFFEST * self.unloading * self.stiff_limit / self.exponent
    }

    /// Stiffness of unloading and reloading, Pa/m.
    pub fn unloading(&self) -> f64 {
        self.unloading
    }

    /// Pressure of first loading at depth z, Pa; 0 for z ≤ 0.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn virgin(&self, z: f64) -> Result<f64> {
        Ok(self.first_loading(z)?.0)
    }

    /// Pressure (Pa) and slope (Pa/m) of first loading at depth z (m); both 0 for z < 0.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn first_loading(&self, z: f64) -> Result<(f64, f64)> {
        if z <= self.elastic_limit {
            Ok((self.unloading * z.max(0.0), if z < 0.0 { 0.0 } else { self.unloading }))
        } else if self.is_batched() {
            self.beyond(z)
        } else {
            Ok(self.power_law(z))
        }
    }

    /// Pressure and slope of a power law beyond the elastic limit.
    #[inline]
    fn power_law(&self, z: f64) -> (f64, f64) {
        if self.exponent == 1.0 {
            (self.modulus * z, self.modulus)
        } else if z > self.stiff_limit {
            let steepest = STIFFEST * self.unloading;
            (self.stiff_pressure() + steepest * (z - self.stiff_limit), steepest)
        } else {
            let p = self.modulus * libm::pow(z, self.exponent);
            (p, self.exponent * p / z)
        }
    }

    /// Depth at which first loading gives the pressure p ≥ 0, m.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn virgin_depth(&self, p: f64) -> Result<f64> {
        Ok(if p <= self.unloading * self.elastic_limit {
            p.max(0.0) / self.unloading
        } else if self.is_batched() {
            let alike = libm::pow(p / self.modulus, 1.0 / self.exponent);
            inverse::depth(&|z| self.beyond(z), p, self.elastic_limit, alike)?
        } else if self.exponent == 1.0 {
            p / self.modulus
        } else if p > self.stiff_pressure() {
            self.stiff_limit + (p - self.stiff_pressure()) / (STIFFEST * self.unloading)
        } else {
            libm::pow(p / self.modulus, 1.0 / self.exponent)
        })
    }

    /// Pressure and slope dp/dz at depth z of soil pressed to z_max before, where p_max is that of first loading there.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn at(&self, z: f64, z_max: f64, p_max: f64) -> Result<(f64, f64)> {
        if z > z_max {
            return self.first_loading(z);
        }
        let p = p_max - self.unloading * (z_max - z);
        Ok(if p > 0.0 { (p, self.unloading) } else { (0.0, 0.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ANSWERS: &str = "a power law always answers";

    fn virgin(curve: &PressureCurve, z: f64) -> f64 {
        curve.virgin(z).expect(ANSWERS)
    }

    fn curves() -> impl Strategy<Value = PressureCurve> {
        (3.0e4..2.0e7, 0.11..1.7).prop_map(|(k, n)| PressureCurve::new(k, n, 4e8))
    }

    /// Exponents above 1 over elastic lines that are hardly stiffer than the law, or softer.
    fn soft_lines() -> impl Strategy<Value = PressureCurve> {
        (3.0e4..2.0e7, 1.01..2.8, 3.0..8.0f64)
            .prop_map(|(k, n, k_u)| PressureCurve::new(k, n, 10f64.powf(k_u)))
    }

    proptest! {
        #[test]
        fn soil_gives_back_no_more_than_was_put_in(curve in soft_lines(), a in 1e-6..0.5f64, b in 1e-6..0.5f64) {
            let (from, to) = (a.min(b), a.max(b));
            let [p_from, p_to] = [from, to].map(|z| virgin(&curve, z));
            prop_assert!(curve.first_loading(to).expect(ANSWERS).1 <= curve.unloading());
            prop_assert!((curve.virgin_depth(p_to).expect(ANSWERS) - to).abs() <= 1e-9 * to);
            // first loading does more work than the elastic line takes up
            let steps = 4000;
            let p = |k: i32| virgin(&curve, from + (to - from) * f64::from(k) / f64::from(steps));
            let work: f64 = (1..=steps).map(|k| 0.5 * (p(k) + p(k - 1)) * (to - from) / f64::from(steps)).sum();
            let stored = (p_to * p_to - p_from * p_from) / (2.0 * curve.unloading());
            prop_assert!(stored <= work * (1.0 + 1e-5), "{stored} {work}");
        }

        #[test]
        fn the_inverse_undoes_the_law(curve in curves(), z in 1e-9..0.2f64) {
            let back = curve.virgin_depth(virgin(&curve, z)).expect(ANSWERS);
            prop_assert!((back - z).abs() <= 1e-12 + 1e-12 * z, "{back} {z}");
        }

        #[test]
        fn the_slope_is_the_derivative(curve in curves(), z in 1e-3..0.2f64, z_max in 0.0..0.1f64) {
            let p_max = virgin(&curve, z_max);
            let d = 1e-7;
            prop_assume!((z - z_max).abs() > 2.0 * d && (z - curve.elastic_limit).abs() > 2.0 * d);
            prop_assume!((z - (z_max - p_max / curve.unloading())).abs() > 2.0 * d);
            let at = |z| curve.at(z, z_max, p_max).expect(ANSWERS);
            let (_, slope) = at(z);
            let numeric = (at(z + d).0 - at(z - d).0) / (2.0 * d);
            prop_assert!((slope - numeric).abs() <= 1e-4 * slope.abs() + 1.0, "{slope} {numeric}");
        }

        #[test]
        fn pressure_is_monotone_and_never_tension(curve in curves(), a in -0.1..0.2f64, b in -0.1..0.2f64,
                                                  z_max in 0.0..0.1f64) {
            let p_max = virgin(&curve, z_max);
            let [low, high] = [a.min(b), a.max(b)].map(|z| curve.at(z, z_max, p_max).expect(ANSWERS).0);
            prop_assert!(0.0 <= low && low <= high);
        }
    }
}
