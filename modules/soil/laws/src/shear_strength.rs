//! The trait that each law of shear implements.
//!
//! A law gives the stress up to which soil is elastic; yielding is the same for all of them, see [`crate::ShearLaw`].
//! To add a law: a file of its name with a type that implements [`ShearStrength`], a variant of
//! [`StrengthLaw`](crate::StrengthLaw), and its numbers in [`crate::SoilParameters`].

use crate::build_up::is_building_up;
use terraglue_subsystem::Result;

/// Nodes under pressure. All slices have one entry per node, `kept` as many as the law keeps, node after node.
#[derive(Clone, Copy, Debug)]
pub struct YieldNodes<'a> {
    /// Pressures, Pa.
    pub pressure: &'a [f64],
    /// Slips since the contact began, m.
    pub slip: &'a [f64],
    /// State of a law with a state at them.
    pub kept: &'a [f64],
}

impl YieldNodes<'_> {
    /// State of the law at node k.
    #[inline]
    fn kept(&self, k: usize) -> &[f64] {
        let doubles = self.kept.len() / self.pressure.len().max(1);
        &self.kept[k * doubles..(k + 1) * doubles]
    }
}

/// Stresses at which nodes yield; all slices have one entry per node.
#[derive(Debug)]
pub struct YieldAnswer<'a> {
    /// Yield stress, Pa.
    pub stress: &'a mut [f64],
    /// Its derivative by the pressure.
    pub by_pressure: &'a mut [f64],
    /// Its derivative by the slip, Pa/m.
    pub by_slip: &'a mut [f64],
}

/// A law of shear: built in, text of a scenario or module.
pub trait ShearStrength {
    /// Largest stress without pressure, Pa.
    fn cohesion(&self) -> f64;

    /// d(largest stress)/dp of the fully mobilised soil, tan φ.
    fn friction(&self) -> f64;

    /// Stress (Pa) up to which soil under `pressure` (Pa) that has slipped by `slip` (m) is elastic, with its derivatives by
    /// both; `kept` is the memory of the node in a law with a state.
    ///
    /// # Errors
    /// The law has no answer.
    fn yield_stress(&self, pressure: f64, slip: f64, kept: &[f64]) -> Result<(f64, [f64; 2])>;

    /// The same for many nodes.
    ///
    /// # Errors
    /// The law has no answer at one of them.
    fn yield_stresses(&self, nodes: &YieldNodes, out: &mut YieldAnswer) -> Result {
        for (k, (p, slip)) in nodes.pressure.iter().zip(nodes.slip).enumerate() {
            let (stress, by) = self.yield_stress(*p, *slip, nodes.kept(k))?;
            (out.stress[k], [out.by_pressure[k], out.by_slip[k]]) = (stress, by);
        }
        Ok(())
    }
}

/// Asks once more at nodes whose strength without pressure is still building up, which a batch does not look at.
pub(crate) fn build_up(law: &impl ShearStrength, nodes: &YieldNodes, out: &mut YieldAnswer) -> Result {
    let cohesion = law.cohesion();
    for k in (0..nodes.pressure.len()).filter(|k| is_building_up(cohesion, nodes.pressure[*k])) {
        let (stress, by) = law.yield_stress(nodes.pressure[k], nodes.slip[k], nodes.kept(k))?;
        (out.stress[k], [out.by_pressure[k], out.by_slip[k]]) = (stress, by);
    }
    Ok(())
}
