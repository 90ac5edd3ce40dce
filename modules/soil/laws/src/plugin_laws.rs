//! A module as a law of pressure and as a law of shear.

use crate::build_up::{built_up, cohesion_and_friction};
use crate::first_loading::FirstLoading;
use crate::plugin::PluginLaw;
use crate::pressure_sinkage::PressureSinkage;
use crate::shear_strength::{ShearStrength, YieldAnswer, YieldNodes, build_up};
use terraglue_subsystem::{MOST_LAW_STATE, Result};

impl PressureSinkage for PluginLaw {
    fn under(&self, b: f64) -> FirstLoading {
        FirstLoading::Module(self.clone(), b)
    }

    fn state_doubles(&self) -> usize {
        PluginLaw::state_doubles(self)
    }

    fn is_gentle_at(&self, k_u: f64) -> bool {
        self.is_gentle(k_u)
    }
}

/// The shear law of a module.
#[derive(Clone, Debug, PartialEq)]
pub struct PluginShear {
    law: PluginLaw,
    cohesion: f64,
    friction: f64,
}

impl PluginShear {
    /// Takes the shear law of a module into use.
    ///
    /// # Errors
    /// The law has failed, or given an impossible answer.
    pub fn new(law: PluginLaw) -> Result<Self> {
        let state = [0.0; MOST_LAW_STATE];
        let state = &state[..law.state_doubles()];
        let [cohesion, friction] = cohesion_and_friction(|p, j| law.strength(p, j, state))?;
        Ok(Self { law, cohesion, friction })
    }
}

impl ShearStrength for PluginShear {
    fn cohesion(&self) -> f64 {
        self.cohesion
    }

    fn friction(&self) -> f64 {
        self.friction
    }

    fn yield_stress(&self, pressure: f64, slip: f64, kept: &[f64]) -> Result<(f64, [f64; 2])> {
        built_up(self.cohesion, pressure, |p| self.law.strength(p, slip, kept))
    }

    fn yield_stresses(&self, nodes: &YieldNodes, out: &mut YieldAnswer) -> Result {
        self.law.strengths(nodes, out)?;
        build_up(self, nodes, out)
    }
}
