//! Shear of the soil under a loaded area: elastic until it slips, then at the yield stress of its law.
//!
//! A law gives the stress of a monotone shear displacement j, e.g. S·(1 − e^(−j/K)) (Janosi and Hanamoto 1961). Taken
//! literally this creeps under a constant load and never sticks, so it is used here as the hardening of an elastic–plastic
//! law: the stress is elastic, τ = k_t·u, up to the yield stress Y(j) = S·(1 − e^(−j/K)), where j is the accumulated slip;
//! above it the slip grows until |τ| = Y(j + Δj) (backward Euler, radial return; Simo and Hughes 1998, §1.4 for isotropic
//! hardening). Monotone loading follows the law up to the elastic part τ/k_t of the displacement (relative deviation
//! S/(K·k_t), below 1e-3); on reversal the soil is stiff, and under a constant load nothing moves.
//! k_t = 0.82·k_u: tangential over normal stiffness of an elastic contact, 2(1 − ν)/(2 − ν) with ν = 0.3
//! (Mindlin 1949).

/// Ratio of tangential to normal elastic stiffness, 2(1 − ν)/(2 − ν) at ν = 0.3 (Mindlin 1949).
const MINDLIN_RATIO: f64 = 1.4 / 1.7;

/// A stress so little above the yield stress is on it: a foot that slid and now stands does not slip by rounding.
pub(crate) const ON_YIELD: f64 = 1.0 + 1e-13;

use crate::expression::ShearExpression;
use crate::janosi_hanamoto::JanosiHanamoto;
use crate::plugin::PluginLaw;
use crate::plugin_laws::PluginShear;
use crate::shear_strength::ShearStrength;
use crate::strength_law::StrengthLaw;
use terraglue_subsystem::Result;

/// The shear law of a soil above its elastic stiffness.
#[derive(Clone, Debug, PartialEq)]
pub struct ShearLaw {
    /// Up to which stress the soil is elastic.
    pub law: StrengthLaw,
    /// Shear deformation modulus K, m.
    pub modulus: f64,
    /// Elastic tangential stiffness k_t, Pa/m.
    pub stiffness: f64,
    /// Direction of travel along t1 and t2 with a modulus of its own; see [`ShearLaw::travelling`].
    pub travel: Option<Travel>,
}

/// Shear moduli along and across a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Unit vector along t1 and t2.
    pub heading: [f64; 2],
    /// Modulus along it over the one across.
    pub ratio: f64,
}

/// Shear history of a node. The default is untouched soil, and soil after lift-off.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ShearState {
    /// Elastic displacement of the foot against the soil along t1 and t2, m; the stress on the soil is k_t times it.
    pub elastic: [f64; 2],
    /// Accumulated slip j, m.
    pub slip: f64,
}

/// Answer of the shear law to a displacement increment.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ShearResponse {
    /// Stress on the soil along t1, t2, Pa.
    pub stress: [f64; 2],
    /// dτ/ds, Pa/m: (11, 12, 22), symmetric.
    pub tangent: [f64; 3],
    /// dτ/dp at fixed displacement.
    pub by_pressure: [f64; 2],
    /// History afterwards.
    pub state: ShearState,
    /// Energy turned into heat per area, J/m².
    pub dissipated: f64,
}

impl ShearLaw {
    /// From cohesion (Pa), angle of friction (rad), deformation modulus (m) and normal elastic stiffness k_u (Pa/m).
    pub fn new(cohesion: f64, phi: f64, modulus: f64, k_u: f64) -> Self {
        let (friction, stiffness) = (libm::tan(phi), MINDLIN_RATIO * k_u);
        let law = StrengthLaw::JanosiHanamoto(JanosiHanamoto { cohesion, friction, modulus });
        Self { law, modulus, stiffness, travel: None }
    }

    /// The same above a soil of the normal elastic stiffness k_u (Pa/m).
    pub fn above(&self, k_u: f64) -> Self {
        Self { stiffness: MINDLIN_RATIO * k_u, ..self.clone() }
    }

    /// The same with a yield stress that a scenario writes, see [`crate::expression`].
    pub fn with_expression(self, law: ShearExpression) -> Self {
        Self { law: StrengthLaw::Expression(law), ..self }
    }

    /// The same with the yield stress of a module.
    ///
    /// # Errors
    /// The module has failed, or given an impossible answer.
    pub fn with_plugin(self, law: PluginLaw) -> Result<Self> {
        Ok(Self { law: StrengthLaw::Plugin(PluginShear::new(law)?), ..self })
    }

    /// d(largest stress)/dp of the fully mobilised soil, tan φ.
    pub fn friction(&self) -> f64 {
        self.law.friction()
    }

    /// Whether many nodes at a time are better than one after the other.
    #[inline]
    pub fn is_batched(&self) -> bool {
        !matches!(self.law, StrengthLaw::JanosiHanamoto(_))
    }

    /// The same with the deformation modulus `across` (m) across the unit vector `heading` (along t1, t2). Slip in a
    /// direction e counts √((e_along/K)² + (e_across/K_across)²) per length, in units of 1/K, so that each direction
    /// alone follows Janosi and Hanamoto with its own modulus (Ishigami et al. 2007, J. Field Robotics 24, eq. 14–15,
    /// have the two moduli).
    pub fn travelling(&self, heading: [f64; 2], across: Option<f64>) -> Self {
        let travel = across.map(|across| Travel { heading, ratio: self.modulus / across });
        Self { travel, ..self.clone() }
    }

    /// Weight of a slip along `u`.
    #[inline]
    pub(crate) fn weight(&self, u: [f64; 2], length: f64) -> f64 {
        let Some(Travel { heading, ratio }) = self.travel else { return 1.0 };
        let along = (u[0] * heading[0] + u[1] * heading[1]) / length;
        let across = (1.0 - along * along).max(0.0);
        (along * along + ratio * ratio * across).sqrt()
    }

    /// Stress up to which soil under the pressure p (Pa) that has slipped by `slip` (m) is elastic, Pa; `mobilised` is
    /// [`ShearLaw::mobilised`] of the slip, and `kept` the memory of the node in a law with a state.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn yield_stress(&self, p: f64, slip: f64, mobilised: f64, kept: &[f64]) -> Result<f64> {
        match &self.law {
            StrengthLaw::JanosiHanamoto(law) => Ok(law.strength(p).0 * mobilised),
            other => Ok(other.yield_stress(p, slip, kept)?.0),
        }
    }

    /// Share of the strength that a slip j (m) has mobilised; 0 under laws that count the slip themselves.
    #[inline]
    pub fn mobilised(&self, slip: f64) -> f64 {
        match &self.law {
            StrengthLaw::JanosiHanamoto(law) => law.mobilised(slip),
            _ => 0.0,
        }
    }

    /// Slip (m) that mobilises as much as soil of which a part has slipped by `slip` (m) and the rest has not: their mean of e^(−j/K). A law of a
    /// scenario or a module takes K of the soil, too.
    #[inline]
    pub fn mean_slip(&self, slip: f64, part: f64) -> f64 {
        -self.modulus * libm::log1p(part * libm::expm1(-slip / self.modulus))
    }

    /// Stress, tangents and new history after the foot has moved by `s` (m, along t1, t2) under the pressure p.
    ///
    /// On the yield stress the tangent is the elastic one, that of going back. This holds for untouched soil at s = 0, too,
    /// where the stress is 0 = Y(0), although there the derivative is that of slipping soil in every direction, near S/K: an
    /// iteration that starts there makes a first step along the ground that is too short, never one that is too long.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn respond(&self, state: &ShearState, p: f64, s: [f64; 2]) -> Result<ShearResponse> {
        self.respond_kept(state, &[], self.mobilised(state.slip), p, s)
    }

    /// [`ShearLaw::respond`] where `mobilised` = [`ShearLaw::mobilised`] of the state's slip is known already; `kept` is the
    /// memory of the node in a law with a state.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn respond_kept(
        &self,
        state: &ShearState,
        kept: &[f64],
        mobilised: f64,
        p: f64,
        s: [f64; 2],
    ) -> Result<ShearResponse> {
        if p <= 0.0 {
            return Ok(ShearResponse::default());
        }
        match &self.law {
            StrengthLaw::JanosiHanamoto(law) => Ok(self.respond_by(law, state, mobilised, p, s)),
            other => self.respond_by_any(other, state, kept, p, s),
        }
    }

    /// The same by Janosi and Hanamoto.
    #[inline]
    fn respond_by(
        &self,
        law: &JanosiHanamoto,
        state: &ShearState,
        mobilised: f64,
        p: f64,
        s: [f64; 2],
    ) -> ShearResponse {
        let u = [state.elastic[0] + s[0], state.elastic[1] + s[1]];
        let length = (u[0] * u[0] + u[1] * u[1]).sqrt();
        let trial = self.stiffness * length;
        let (strength, by_p) = law.strength(p);
        if trial <= strength * mobilised * ON_YIELD {
            return self.elastic(u, state.slip);
        }
        let weight = self.weight(u, length);
        let (step, left) = law.return_map(self.stiffness, trial, strength, weight, 1.0 - mobilised);
        let answer = Plastic {
            step,
            slip: state.slip + weight * step,
            hardening: weight * left * strength / law.modulus,
            by_p: (1.0 - left) * by_p,
        };
        self.plastic(u, length, &answer)
    }

    pub(crate) fn elastic(&self, u: [f64; 2], slip: f64) -> ShearResponse {
        ShearResponse {
            stress: [self.stiffness * u[0], self.stiffness * u[1]],
            tangent: [self.stiffness, 0.0, self.stiffness],
            by_pressure: [0.0; 2],
            state: ShearState { elastic: u, slip },
            dissipated: 0.0,
        }
    }

    pub(crate) fn plastic(&self, u: [f64; 2], length: f64, answer: &Plastic) -> ShearResponse {
        let Plastic { step, slip, hardening, by_p } = *answer;
        let k = self.stiffness;
        let stress = (k * (length - step)).max(0.0);
        let along = k * hardening / (k + hardening);
        let across = stress / length;
        let e = [u[0] / length, u[1] / length];
        let d = along - across;
        let scale = k / (k + hardening) * by_p;
        ShearResponse {
            stress: [stress * e[0], stress * e[1]],
            tangent: [across + d * e[0] * e[0], d * e[0] * e[1], across + d * e[1] * e[1]],
            by_pressure: [scale * e[0], scale * e[1]],
            state: ShearState { elastic: [stress / k * e[0], stress / k * e[1]], slip },
            dissipated: stress * step,
        }
    }

    /// Elastic energy per area, J/m².
    pub fn elastic_energy(&self, state: &ShearState) -> f64 {
        0.5 * self.stiffness * (state.elastic[0] * state.elastic[0] + state.elastic[1] * state.elastic[1])
    }
}

/// Effect of a slip increment: its length, the slip counted since the contact began, d(yield)/d(length) and d(yield)/dp
/// at fixed slip.
pub(crate) struct Plastic {
    pub step: f64,
    pub slip: f64,
    pub hardening: f64,
    pub by_p: f64,
}

terraglue_subsystem::persist!(ShearState { elastic, slip });

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lunar() -> ShearLaw {
        ShearLaw::new(170.0, 35f64.to_radians(), 0.018, 4e8)
    }

    fn respond(law: &ShearLaw, state: &ShearState, p: f64, s: [f64; 2]) -> ShearResponse {
        law.respond(state, p, s).expect("the built-in law always answers")
    }

    #[test]
    fn a_part_that_has_slipped_mobilises_its_part() {
        let law = lunar();
        for (slip, part) in [(0.0, 0.3), (1e-9, 0.5), (0.004, 0.0), (0.02, 0.25), (0.3, 1.0)] {
            let mean = law.mean_slip(slip, part);
            assert!(
                (law.mobilised(mean) - part * law.mobilised(slip)).abs() < 1e-15,
                "{slip} {part}: {mean}"
            );
            assert!((0.0..=slip * (1.0 + 1e-12)).contains(&mean), "{slip} {part}: {mean}");
        }
    }

    /// Largest stress.
    fn strength(law: &ShearLaw, p: f64) -> f64 {
        law.yield_stress(p, 0.0, 1.0, &[]).expect("the built-in law always answers")
    }

    #[test]
    fn monotone_loading_follows_janosi_and_hanamoto() {
        let (law, p) = (lunar(), 5000.0);
        let s = 170.0 + p * 35f64.to_radians().tan();
        let mut state = ShearState::default();
        for k in 1..=500 {
            let r = respond(&law, &state, p, [0.8e-4, 0.6e-4]);
            state = r.state;
            let j = f64::from(k) * 1e-4;
            let expected = s * (1.0 - (-j / 0.018f64).exp());
            let stress = r.stress[0].hypot(r.stress[1]);
            assert!((stress - expected).abs() < 1.5e-3 * expected, "{j}: {stress} {expected}");
            assert!((r.stress[0] * 0.6 - r.stress[1] * 0.8).abs() < 1e-6);
        }
    }

    #[test]
    fn each_direction_follows_its_own_modulus() {
        let (law, p) = (lunar().travelling([0.6, 0.8], Some(0.006)), 5000.0);
        let s = strength(&law, p);
        for (direction, modulus) in [([0.6, 0.8], 0.018f64), ([-0.8, 0.6], 0.006)] {
            let mut state = ShearState::default();
            for k in 1..=300 {
                let r = respond(&law, &state, p, direction.map(|d| 1e-4 * d));
                state = r.state;
                let expected = s * (1.0 - (-f64::from(k) * 1e-4 / modulus).exp());
                let stress = r.stress[0].hypot(r.stress[1]);
                assert!((stress - expected).abs() < 5e-3 * expected, "{k}: {stress} {expected}");
            }
        }
    }

    #[test]
    fn reversal_is_stiff_and_a_held_load_stays() {
        let (law, p) = (lunar(), 5000.0);
        let state = respond(&law, &ShearState::default(), p, [0.005, 0.0]).state;
        let back = respond(&law, &state, p, [-1e-7, 0.0]);
        assert_eq!(back.state.slip, state.slip);
        assert!((back.tangent[0] - law.stiffness).abs() < 1e-6);
        let held = respond(&law, &state, p, [0.0, 0.0]);
        assert!((held.state.elastic[0] - state.elastic[0]).abs() < 1e-15);
        assert!(held.state.slip - state.slip < 1e-15);
    }

    #[test]
    fn lift_off_forgets() {
        let law = lunar();
        let state = respond(&law, &ShearState::default(), 5000.0, [0.005, 0.0]).state;
        assert_eq!(respond(&law, &state, 0.0, [0.0, 0.0]).state, ShearState::default());
    }

    proptest! {
        #[test]
        fn tangents_are_derivatives(a in -0.01..0.01f64, b in -0.01..0.01f64, slip in 0.0..0.02f64,
                                    ua in -1e-5..1e-5f64, p in 50.0..20000.0f64) {
            let law = lunar();
            let state = ShearState { elastic: [ua, 0.3 * ua], slip };
            let r = respond(&law, &state, p, [a, b]);
            let d = 1e-9;
            let x = respond(&law, &state, p, [a + d, b]);
            let m = respond(&law, &state, p, [a - d, b]);
            prop_assume!((x.state.slip > slip) == (m.state.slip > slip));
            for k in 0..2 {
                let numeric = (x.stress[k] - m.stress[k]) / (2.0 * d);
                let exact = r.tangent[k];
                prop_assert!((numeric - exact).abs() < 1e-3 * law.stiffness.min(r.tangent[0].abs() + 1e4));
            }
            let (x, m) = (respond(&law, &state, p + 0.01, [a, b]), respond(&law, &state, p - 0.01, [a, b]));
            prop_assume!((x.state.slip > slip) == (m.state.slip > slip));
            for k in 0..2 {
                let numeric = (x.stress[k] - m.stress[k]) / 0.02;
                prop_assert!((numeric - r.by_pressure[k]).abs() < 1e-4, "{numeric} {}", r.by_pressure[k]);
            }
        }

        #[test]
        fn stress_never_exceeds_the_strength_and_slip_dissipates(
            a in -0.05..0.05f64, b in -0.05..0.05f64, slip in 0.0..0.05f64, p in 0.0..20000.0f64) {
            let law = lunar();
            let r = respond(&law, &ShearState { elastic: [0.0; 2], slip }, p, [a, b]);
            let stress = r.stress[0].hypot(r.stress[1]);
            prop_assert!(stress <= strength(&law, p) * (1.0 + 1e-12));
            let before = if p > 0.0 { slip } else { 0.0 };
            prop_assert!(r.dissipated >= 0.0 && r.state.slip >= before);
        }
    }
}
