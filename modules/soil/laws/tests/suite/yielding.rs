//! The way back to the yield stress of a module asks it a few times only, wherever a node stands.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use terraglue_soil_law::{PluginLaw, ShearLaw, ShearResponse, ShearState, Sheared};
use terraglue_subsystem::{NodeLaw, PressureAnswer, PressureNodes, Result, ShearAnswer, ShearNodes};

/// Janosi and Hanamoto (1961), counting its calls.
struct Counted(AtomicUsize);

const COHESION: f64 = 170.0;
const MU: f64 = 0.7;
const K: f64 = 0.018;

impl NodeLaw for Counted {
    fn name(&self) -> &str {
        "counted"
    }
    fn has_pressure(&self) -> bool {
        false
    }
    fn has_shear(&self) -> bool {
        true
    }
    fn pressure(&self, _: &PressureNodes, _: &mut PressureAnswer) -> Result {
        Ok(())
    }
    fn shear(&self, nodes: &ShearNodes, out: &mut ShearAnswer) -> Result {
        self.0.fetch_add(1, Ordering::Relaxed);
        for (k, (p, j)) in nodes.pressure.iter().zip(nodes.slip).enumerate() {
            let (strength, mobilised) = (COHESION + MU * p, -libm::expm1(-j / K));
            out.stress[k] = strength * mobilised;
            out.by_pressure[k] = MU * mobilised;
            out.by_slip[k] = strength * (1.0 - mobilised) / K;
        }
        Ok(())
    }
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }
}

/// Rounds in which Newton's method inside a bracket is home from anywhere.
const ROUNDS: usize = 12;

/// Slips so small that the rounding of the stress is a good part of them: those of an iteration that has nearly arrived.
#[test]
fn a_node_on_the_yield_stress_is_answered_in_a_few_rounds() {
    let counted = Arc::new(Counted(AtomicUsize::new(0)));
    let law = ShearLaw::new(COHESION, 0.61, K, 4e8).with_plugin(PluginLaw::new(counted.clone()));
    let law = law.expect("it answers");
    for k in 1..2000 {
        let (slip, p) = (0.06 * f64::from(k) / 2000.0, 300.0 + 10.0 * f64::from(k));
        let strength = (COHESION + MU * p) * -libm::expm1(-slip / K);
        let state = ShearState { elastic: [strength / law.stiffness, 0.0], slip };
        for slide in [1e-16, 1e-15, 3e-14, 6e-12, 1e-9, 4e-4] {
            let before = counted.0.load(Ordering::Relaxed);
            let mut out = [ShearResponse::default()];
            let nodes = Sheared { states: &[state], kept: &[], pressure: &[p], slide: &[[slide, 0.0]] };
            law.respond_many(&nodes, &mut out).expect("it answers");
            let rounds = counted.0.load(Ordering::Relaxed) - before;
            assert!(rounds <= ROUNDS, "{rounds} rounds from the slip {slip} m, dragged by {slide} m");
            let now = (COHESION + MU * p) * -libm::expm1(-out[0].state.slip / K);
            assert!((out[0].stress[0] - now).abs() <= 1e-12 * now, "{slip} m, {slide} m: {:?}", out[0]);
        }
    }
}
