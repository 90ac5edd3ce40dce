//! Relations of the positions, rates and accelerations of a step.
//!
//! The unknown is always the mean rate u = (x⁺ − x)/h of a body. Semi-implicit Euler: u is the rate at the end and
//! M(u − v) = h·f. Generalized-α (Chung and Hulbert 1993; on Lie groups with index-3 constraints: Arnold and Brüls
//! 2007; Brüls, Cardona and Arnold 2012), with α_m = (2ρ−1)/(ρ+1), α_f = ρ/(ρ+1), γ = ½ + α_f − α_m,
//! β = ¼(γ + ½)²:
//!
//! u = v + h(½ − β)a + hβa⁺, v⁺ = v + h(1 − γ)a + hγa⁺, (1 − α_m)a⁺ + α_m·a = (1 − α_f)v̇⁺ + α_f·v̇
//!
//! and equilibrium M·v̇⁺ + gyroscopic terms = f⁺ + J⁺ᵀλ⁺ at the end. As function of u this is M(u − …) = θ·h·f⁺
//! with θ = β(1 − α_f)/(1 − α_m): the matrix of the first-order step serves both, forces alone weigh θ.

use crate::math::{M3, V3};
use crate::motion::Motion;

/// Six rates or accelerations of a body: centre of mass, rotation; world axes.
pub(crate) type Six = [f64; 6];

/// The rule by which a step is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Integrator {
    /// First order in rates; impulses act directly. For impacts.
    SymplecticEuler,
    /// Second order; needs forces that change smoothly.
    GeneralizedAlpha(Weights),
    /// Second order; conserves energy and momentum to the last.
    EnergyMomentum,
}

impl Integrator {
    pub const NAMES: [&'static str; 3] = ["symplectic-euler", "generalized-alpha", "energy-momentum"];

    /// θ: the weight of a force of the step in the system for u.
    pub fn force_weight(&self) -> f64 {
        match self {
            Self::SymplecticEuler => 1.0,
            Self::GeneralizedAlpha(w) => w.theta(),
            Self::EnergyMomentum => 0.5,
        }
    }

    /// d(rate at the end)/du.
    pub fn rate_weight(&self) -> f64 {
        match self {
            Self::SymplecticEuler => 1.0,
            Self::GeneralizedAlpha(w) => w.gamma / w.beta,
            Self::EnergyMomentum => 2.0,
        }
    }

    /// When within the step forces along joint axes are taken, as share of the step.
    pub fn force_time(&self) -> f64 {
        if matches!(self, Self::EnergyMomentum) { 0.5 } else { 1.0 }
    }

    /// Whether accelerations belong to the state.
    pub fn is_second_order(&self) -> bool {
        !matches!(self, Self::SymplecticEuler)
    }
}

/// Coefficients of generalized-α.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Weights {
    alpha_m: f64,
    alpha_f: f64,
    beta: f64,
    gamma: f64,
}

/// State of a body in generalized-α.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Acceleration {
    /// a: the algorithmic one, which lags by (α_m − α_f)·h.
    pub algorithmic: Six,
    /// v̇, which is in equilibrium with the forces.
    pub real: Six,
}

impl Weights {
    /// For a spectral radius at infinity ρ in 0 … 1.
    pub fn new(rho: f64) -> Self {
        let (alpha_m, alpha_f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let gamma = 0.5 + alpha_f - alpha_m;
        Self { alpha_m, alpha_f, beta: 0.25 * (gamma + 0.5) * (gamma + 0.5), gamma }
    }

    fn theta(&self) -> f64 {
        self.beta * (1.0 - self.alpha_f) / (1.0 - self.alpha_m)
    }

    /// Mean rate if the algorithmic acceleration stays.
    pub fn predict(v: &Six, a: &Acceleration, h: f64) -> Six {
        std::array::from_fn(|k| v[k] + 0.5 * h * a.algorithmic[k])
    }

    /// Rate and accelerations at the end for the mean rate u.
    pub fn end(&self, u: &[f64], v: &Six, a: &Acceleration, h: f64) -> (Six, Acceleration) {
        let (mut rate, mut end) = ([0.0; 6], Acceleration::default());
        for k in 0..6 {
            let before = a.algorithmic[k];
            let after = (u[k] - v[k] - h * (0.5 - self.beta) * before) / (h * self.beta);
            rate[k] = v[k] + h * ((1.0 - self.gamma) * before + self.gamma * after);
            let mean = (1.0 - self.alpha_m) * after + self.alpha_m * before;
            end.algorithmic[k] = after;
            end.real[k] = (mean - self.alpha_f * a.real[k]) / (1.0 - self.alpha_f);
        }
        (rate, end)
    }
}

/// State of a body at the end of a step.
pub(super) struct BodyEnd {
    pub motion: Motion,
    /// Rotation vector of the step before the Cayley transform.
    pub turn: V3,
    pub acceleration: Acceleration,
}

/// Rates of a motion.
pub(super) fn rates(m: &Motion) -> Six {
    [m.v.x, m.v.y, m.v.z, m.w.x, m.w.y, m.w.z]
}

/// I·ω̇ + ω × I·ω in world axes.
pub(super) fn inertial_moment(inertia: &M3, m: &Motion, acceleration: &V3) -> V3 {
    let local = |v: &V3| m.q.inverse_transform_vector(v);
    let w = local(&m.w);
    m.q * (inertia * local(acceleration) + w.cross(&(inertia * w)))
}

terraglue_subsystem::persist!(Acceleration { algorithmic, real });

#[cfg(test)]
#[path = "../../tests/unit/scheme.rs"]
mod tests;
