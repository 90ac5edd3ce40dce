//! The choice among the laws of shear.

use crate::expression::ShearExpression;
use crate::janosi_hanamoto::JanosiHanamoto;
use crate::plugin_laws::PluginShear;
use crate::shear_strength::{ShearStrength, YieldAnswer, YieldNodes};
use terraglue_subsystem::Result;

/// The law of a soil.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum StrengthLaw {
    /// (c + p·tan φ)·(1 − e^(−j/K)).
    JanosiHanamoto(JanosiHanamoto),
    /// Written in the scenario, see [`crate::expression`].
    Expression(ShearExpression),
    /// A module of its own.
    Plugin(PluginShear),
}

impl ShearStrength for StrengthLaw {
    fn cohesion(&self) -> f64 {
        match self {
            Self::JanosiHanamoto(law) => law.cohesion(),
            Self::Expression(law) => law.cohesion(),
            Self::Plugin(law) => law.cohesion(),
        }
    }

    fn friction(&self) -> f64 {
        match self {
            Self::JanosiHanamoto(law) => law.friction(),
            Self::Expression(law) => law.friction(),
            Self::Plugin(law) => law.friction(),
        }
    }

    #[inline]
    fn yield_stress(&self, pressure: f64, slip: f64, kept: &[f64]) -> Result<(f64, [f64; 2])> {
        match self {
            Self::JanosiHanamoto(law) => law.yield_stress(pressure, slip, kept),
            Self::Expression(law) => law.yield_stress(pressure, slip, kept),
            Self::Plugin(law) => law.yield_stress(pressure, slip, kept),
        }
    }

    fn yield_stresses(&self, nodes: &YieldNodes, out: &mut YieldAnswer) -> Result {
        match self {
            Self::JanosiHanamoto(law) => law.yield_stresses(nodes, out),
            Self::Expression(law) => law.yield_stresses(nodes, out),
            Self::Plugin(law) => law.yield_stresses(nodes, out),
        }
    }
}
