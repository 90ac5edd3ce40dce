//! Pressure under a loaded area as a function of sinkage, with elastic unloading.
//!
//! Virgin loading follows a power law p = K·zⁿ (Bekker 1956: K = k_c/b + k_φ). Below the largest depth reached the
//! soil is elastic: p = p_max − k_u·(z_max − z), never tension (Wong 1984, "repetitive normal load").
//! The families differ in how the power law depends on the size b of the contact; see [`PressureLaw`].
//! No soil is stiffer in virgin loading than in unloading, so for n < 1, where the power law starts with an
//! infinite slope, the line p = k_u·z holds up to where it meets the power law. For n > 1, whose slope grows without bound,
//! it goes on straight where the slope has come to 0.99 k_u: beyond, unloading would give back more than was put in. So do
//! laws as text and as modules.

use crate::expression::{PressureExpression, Program, curve};
use crate::plugin::PluginLaw;
use crate::slip_sinkage::SlipSinkage;
use crate::straight::{STIFFEST, Straight};

/// A family of pressure–sinkage laws; [`PressureLaw::curve`] fixes one for the size of a contact.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PressureLaw {
    /// p = (k_c/b + k_φ)·zⁿ (Bekker 1956).
    Bekker {
        /// Cohesive modulus k_c, N/m^(n+1).
        k_c: f64,
        /// Frictional modulus k_φ, N/m^(n+2).
        k_phi: f64,
        /// Exponent n.
        n: f64,
    },
    /// p = (c·k_c' + γ·b·k_φ')·(z/b)ⁿ (Reece 1965, eq. 6): for n < 1 the pressure at a depth rises with the size,
    /// for n > 1 it falls.
    Reece {
        /// c·k_c', Pa.
        cohesive: f64,
        /// γ·k_φ', Pa/m.
        frictional: f64,
        /// Exponent n.
        n: f64,
    },
    /// p = (c·N_c + γ·b·N_γ)·(z/z_r)ⁿ: the cohesion and the width term of bearing capacity (Terzaghi 1943, ch. VIII)
    /// mobilised with the depth, whatever the size. At a given depth the pressure rises with the size at any n, as
    /// plates on dry sand show; Bekker with k_c ≥ 0 cannot do that.
    Bearing {
        /// c·N_c, pressure at the depth z_r under a contact without width, Pa.
        cohesive: f64,
        /// γ·N_γ, Pa/m.
        frictional: f64,
        /// Reference depth z_r, m.
        reference: f64,
        /// Exponent n.
        n: f64,
    },
    /// Written in the scenario, see [`crate::expression`].
    Expression(PressureExpression),
    /// A module of its own.
    Plugin(PluginLaw),
}

/// Names of the families as a scenario writes them.
pub const PRESSURE_LAWS: [&str; 3] = ["bekker", "reece", "bearing"];

impl PressureLaw {
    /// The curve under a contact of smaller dimension `b` (m; radius of a disc, short side of a rectangle) with
    /// the unloading stiffness `k_u` (Pa/m).
    pub fn curve(&self, b: f64, k_u: f64) -> PressureCurve {
        self.curve_in_slip(b, k_u, &SlipSinkage::None, 0.0)
    }

    /// The same under a contact that slips by `slip` (0: rolls or stands, 1: spins on the spot), which sinks deeper
    /// as `sinkage` says.
    pub fn curve_in_slip(&self, b: f64, k_u: f64, sinkage: &SlipSinkage, slip: f64) -> PressureCurve {
        let (modulus, n) = match self {
            Self::Bekker { k_c, k_phi, n } => (k_c / b + k_phi, *n),
            Self::Reece { cohesive, frictional, n } => ((cohesive + frictional * b) * libm::pow(b, -n), *n),
            Self::Bearing { cohesive, frictional, reference, n } => {
                ((cohesive + frictional * b) * libm::pow(*reference, -n), *n)
            }
            Self::Plugin(law) => return PressureCurve::of_law(law.clone(), b, k_u),
            Self::Expression(law) => {
                let program = law.at_size(b);
                match program.power_law() {
                    Some(law) => law,
                    None => {
                        let gentle = law.is_gentle_at(k_u);
                        return PressureCurve::of_shape(Shape::Program(program), k_u, gentle);
                    }
                }
            }
        };
        let (modulus, n) = sinkage.apply(modulus, n, slip);
        PressureCurve::new(modulus, n, k_u)
    }
}

/// Depth and size at which [`PressureLaw::unloading`] looks at a law, m.
const LOOK: [f64; 2] = [0.02, 0.05];
/// Stiffness of unloading over the secant of first loading there: LETE sand, whose k_u = A_u·z_u with A_u = 503 MPa/m² (Wong
/// 1984; Wong 2010, table 4.1) is 10.1 MPa/m at 2 cm, where k_c = 1.16 kN/m^1.611, k_φ = 475 kN/m^2.611 and n = 0.611 of the same
/// tests give a secant of 2.28 MPa/m.
const UNLOADING: f64 = 4.4;
/// Stiffness of unloading under a law that answers for unloading itself, Pa/m; its shear springs back with it.
const KEEPERS: f64 = 1e7;

impl PressureLaw {
    /// Stiffness of unloading and reloading where nobody gives one, Pa/m: 4.4 times that of first loading down to 2 cm
    /// under a contact of 5 cm, as Wong (1984) measured in sand.
    pub fn unloading(&self) -> f64 {
        let [depth, size] = LOOK;
        if matches!(self, Self::Plugin(law) if law.state_doubles() > 0) {
            return KEEPERS;
        }
        UNLOADING * self.raw(size, depth) / depth
    }

    /// The law itself at a depth z (m) under a contact of size b (m), whatever unloading does, Pa.
    fn raw(&self, b: f64, z: f64) -> f64 {
        match self {
            Self::Plugin(law) => law.at(b, z).0,
            Self::Expression(law) => {
                let program = law.at_size(b);
                program.power_law().map_or_else(|| program.depth(z).0, |(k, n)| k * libm::pow(z, n))
            }
            _ => {
                let p = self.curve(b, 1e18);
                p.modulus * libm::pow(z, p.exponent)
            }
        }
    }
}

/// First loading beyond the elastic limit.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // one per contact and step; a box would allocate
enum Shape {
    /// modulus·z^exponent.
    Power,
    /// Written in the scenario.
    Program(Program),
    /// A module of its own, under a contact of this size.
    Law(PluginLaw, f64),
}

/// p(z) for one contact: a power law, a program or a module, elastic below the largest depth.
#[derive(Clone, Debug, PartialEq)]
pub struct PressureCurve {
    modulus: f64,
    exponent: f64,
    unloading: f64,
    /// Depth up to which the elastic line holds in virgin loading, m; 0 for n ≥ 1.
    elastic_limit: f64,
    /// Depth from which first loading goes on straight, m; infinite where nothing sinks as deep. 0 where n = 1 and the modulus
    /// itself is bounded.
    stiff_limit: f64,
    /// How a law that is no power law goes on there.
    straight: Straight,
    /// Where it is no power law, `modulus` and `exponent` are those of the power law that touches it at 1 cm.
    shape: Shape,
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
        let straight = Straight::NONE;
        Self { modulus, exponent, unloading: k_u, elastic_limit, stiff_limit, straight, shape: Shape::Power }
    }

    /// First loading by a module under a contact of size `b` (m). A law with a state answers for unloading, too, and is
    /// asked by [`PressureCurve::keeper`] alone.
    pub fn of_law(law: PluginLaw, b: f64, k_u: f64) -> Self {
        if law.state_doubles() > 0 {
            return Self { modulus: b, ..Self::bare(Shape::Law(law, b), k_u) };
        }
        let gentle = law.is_gentle_at(k_u);
        Self::of_shape(Shape::Law(law, b), k_u, gentle)
    }

    fn bare(shape: Shape, k_u: f64) -> Self {
        Self {
            modulus: 0.0,
            exponent: 1.0,
            unloading: k_u,
            elastic_limit: 0.0,
            stiff_limit: f64::INFINITY,
            straight: Straight::NONE,
            shape,
        }
    }

    /// `gentle`: nowhere stiffer than unloading beyond the elastic limit.
    fn of_shape(shape: Shape, k_u: f64, gentle: bool) -> Self {
        let mut out = Self::bare(shape, k_u);
        let (p, slope) = out.beyond(TYPICAL_DEPTH);
        out.exponent = slope * TYPICAL_DEPTH / p;
        out.modulus = p * libm::pow(TYPICAL_DEPTH, -out.exponent);
        out.elastic_limit = curve::elastic_limit(&|z| out.beyond(z), k_u);
        if !gentle {
            let look = |z: &[f64], p: &mut [f64], slope: &mut [f64]| match &out.shape {
                Shape::Law(law, b) => law.look(*b, z, p, slope),
                _ => out.beyond_many(z, p, slope),
            };
            out.straight = Straight::find(&look, out.elastic_limit, k_u);
            out.stiff_limit = out.straight.begin();
        }
        out
    }

    /// Pressure and slope of first loading beyond the elastic limit.
    #[inline]
    fn beyond(&self, z: f64) -> (f64, f64) {
        let own = match &self.shape {
            Shape::Power if self.exponent == 1.0 => return (self.modulus * z, self.modulus),
            Shape::Power => {
                let p = self.modulus * libm::pow(z, self.exponent);
                return (p, self.exponent * p / z);
            }
            Shape::Program(program) => program.depth(z),
            Shape::Law(law, b) => law.at(*b, z),
        };
        if z > self.stiff_limit { self.straight.bend(z, own) } else { own }
    }

    /// Whether first loading is better evaluated for many nodes at a time.
    #[inline]
    pub fn is_batched(&self) -> bool {
        !matches!(self.shape, Shape::Power)
    }

    /// First loading beyond the elastic limit at all depths of a chunk: pressures and slopes.
    #[inline]
    pub(crate) fn beyond_many(&self, z: &[f64], p: &mut [f64], slope: &mut [f64]) {
        match &self.shape {
            Shape::Program(program) => program.eval_all([z], p, [slope]),
            Shape::Law(law, b) => law.first_loading(*b, z, p, slope),
            Shape::Power => {
                for ((z, p), slope) in z.iter().zip(&mut *p).zip(&mut *slope) {
                    (*p, *slope) = self.beyond(*z);
                }
            }
        }
        if self.is_batched() && self.stiff_limit < f64::INFINITY {
            for ((z, p), slope) in z.iter().zip(p).zip(slope).filter(|((z, _), _)| **z > self.stiff_limit) {
                (*p, *slope) = self.straight.bend(*z, (*p, *slope));
            }
        }
    }

    /// The module with a state that answers for all pressures, and the size of the contact.
    #[inline]
    pub fn keeper(&self) -> Option<(&PluginLaw, f64)> {
        match &self.shape {
            Shape::Law(law, b) if law.state_doubles() > 0 => Some((law, *b)),
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
    #[inline]
    pub fn virgin(&self, z: f64) -> f64 {
        if z <= self.elastic_limit {
            self.unloading * z.max(0.0)
        } else if self.is_batched() {
            self.beyond(z).0
        } else if self.exponent == 1.0 {
            self.modulus * z
        } else if z > self.stiff_limit {
            self.stiff_pressure() + STIFFEST * self.unloading * (z - self.stiff_limit)
        } else {
            self.modulus * libm::pow(z, self.exponent)
        }
    }

    /// Slope of first loading where the pressure at depth z is p, Pa/m; 0 for z < 0 and for n > 1 at z = 0.
    #[inline]
    pub fn virgin_slope(&self, z: f64, p: f64) -> f64 {
        if z < 0.0 {
            0.0
        } else if z <= self.elastic_limit {
            self.unloading
        } else if self.is_batched() {
            self.beyond(z).1
        } else if self.exponent == 1.0 {
            self.modulus
        } else if z > self.stiff_limit {
            STIFFEST * self.unloading
        } else if z == 0.0 {
            0.0
        } else {
            self.exponent * p / z
        }
    }

    /// Depth at which first loading gives the pressure p ≥ 0, m.
    pub fn virgin_depth(&self, p: f64) -> f64 {
        if p <= self.unloading * self.elastic_limit {
            p.max(0.0) / self.unloading
        } else if self.is_batched() {
            let alike = libm::pow(p / self.modulus, 1.0 / self.exponent);
            curve::depth(&|z| self.beyond(z), p, self.elastic_limit, alike)
        } else if self.exponent == 1.0 {
            p / self.modulus
        } else if p > self.stiff_pressure() {
            self.stiff_limit + (p - self.stiff_pressure()) / (STIFFEST * self.unloading)
        } else {
            libm::pow(p / self.modulus, 1.0 / self.exponent)
        }
    }

    /// Pressure and slope dp/dz at depth z of soil pressed to z_max before, where p_max = virgin(z_max).
    #[inline]
    pub fn at(&self, z: f64, z_max: f64, p_max: f64) -> (f64, f64) {
        if z > z_max {
            if self.is_batched() && z > self.elastic_limit {
                return self.beyond(z);
            }
            let p = self.virgin(z);
            return (p, self.virgin_slope(z, p));
        }
        let p = p_max - self.unloading * (z_max - z);
        if p > 0.0 { (p, self.unloading) } else { (0.0, 0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
            let [p_from, p_to] = [from, to].map(|z| curve.virgin(z));
            prop_assert!(curve.virgin_slope(to, p_to) <= curve.unloading());
            prop_assert!((curve.virgin_depth(p_to) - to).abs() <= 1e-9 * to);
            // first loading does more work than the elastic line takes up
            let steps = 4000;
            let p = |k: i32| curve.virgin(from + (to - from) * f64::from(k) / f64::from(steps));
            let work: f64 = (1..=steps).map(|k| 0.5 * (p(k) + p(k - 1)) * (to - from) / f64::from(steps)).sum();
            let stored = (p_to * p_to - p_from * p_from) / (2.0 * curve.unloading());
            prop_assert!(stored <= work * (1.0 + 1e-5), "{stored} {work}");
        }

        #[test]
        fn the_inverse_undoes_the_law(curve in curves(), z in 1e-9..0.2f64) {
            let back = curve.virgin_depth(curve.virgin(z));
            prop_assert!((back - z).abs() <= 1e-12 + 1e-12 * z, "{back} {z}");
        }

        #[test]
        fn the_slope_is_the_derivative(curve in curves(), z in 1e-3..0.2f64, z_max in 0.0..0.1f64) {
            let p_max = curve.virgin(z_max);
            let d = 1e-7;
            prop_assume!((z - z_max).abs() > 2.0 * d && (z - curve.elastic_limit).abs() > 2.0 * d);
            prop_assume!((z - (z_max - p_max / curve.unloading())).abs() > 2.0 * d);
            let (_, slope) = curve.at(z, z_max, p_max);
            let numeric = (curve.at(z + d, z_max, p_max).0 - curve.at(z - d, z_max, p_max).0) / (2.0 * d);
            prop_assert!((slope - numeric).abs() <= 1e-4 * slope.abs() + 1.0, "{slope} {numeric}");
        }

        #[test]
        fn pressure_is_monotone_and_never_tension(curve in curves(), a in -0.1..0.2f64, b in -0.1..0.2f64,
                                                  z_max in 0.0..0.1f64) {
            let p_max = curve.virgin(z_max);
            let (low, high) = (curve.at(a.min(b), z_max, p_max).0, curve.at(a.max(b), z_max, p_max).0);
            prop_assert!(0.0 <= low && low <= high);
        }
    }

    #[test]
    fn reece_and_bearing_are_their_formulas() {
        let (b, z, n) = (0.04, 0.013, 1.3);
        let reece = PressureLaw::Reece { cohesive: 900.0, frictional: 4e5, n }.curve(b, 4e8).virgin(z);
        assert!((reece / ((900.0 + 4e5 * b) * (z / b).powf(n)) - 1.0).abs() < 1e-12, "{reece}");
        let law = PressureLaw::Bearing { cohesive: 2e4, frictional: 1e6, reference: 0.1, n };
        let bearing = law.curve(b, 4e8).virgin(z);
        assert!((bearing / ((2e4 + 1e6 * b) * (z / 0.1).powf(n)) - 1.0).abs() < 1e-12, "{bearing}");
        assert!(law.curve(0.05, 4e8).virgin(z) > bearing);
    }

    #[test]
    fn bekker_at_one_centimetre() {
        let law = PressureLaw::Bekker { k_c: 1400.0, k_phi: 820_000.0, n: 1.0 };
        let p = law.curve(0.05, 4e8).virgin(0.01);
        assert!((p - 8480.0).abs() < 1e-9, "{p}");
    }
}
