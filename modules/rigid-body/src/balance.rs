//! Energy of the committed state, and the gaps of its joints: the criteria of a run.

use crate::actuator::Drivetrain;
use crate::closure::Poses;
use crate::dynamics::joint_rows::gap;
use crate::model::Model;
use crate::state::State;
use terraglue_subsystem::Energy;

/// Kinetic and potential energy, and the sums that the state keeps. The energy drawn by the motors is unknown without a
/// drive train with losses: the work of an ideal motor is no measure of the energy that a supply has to give.
pub(crate) fn energy(model: &Model, state: &State) -> Energy {
    let (mut kinetic, mut potential) = (0.0, 0.0);
    for (body, m) in model.bodies.iter().zip(&state.bodies) {
        let w = m.q.inverse_transform_vector(&m.w);
        kinetic += 0.5 * (body.mass * m.v.norm_squared() + w.dot(&(body.inertia * w)));
        // Rates and positions of the scheme are half a step apart; the ledger is kept at the time of the rates.
        potential -= body.mass * model.gravity.dot(&(m.c - state.stagger * m.v));
    }
    for (s, joint) in state.joints.iter().zip(&model.joints).filter(|(s, _)| !s.broken) {
        if joint.moves() {
            let (spring, armature) = s.actuator.stored(s.angle);
            (potential, kinetic) = (potential + spring, kinetic + armature);
        }
    }
    potential += state.closures.iter().filter(|s| !s.broken).map(|s| s.stored).sum::<f64>();
    let modelled = state.joints.iter().any(|s| s.actuator.kind != Drivetrain::Ideal);
    let electrical = if modelled { state.energy.electrical } else { f64::NAN };
    Energy { kinetic, potential, electrical, ..state.energy }
}

/// Largest gap of a joint or a loop closure, in any of its rows, m or rad.
pub(crate) fn widest_gap(model: &Model, state: &State) -> f64 {
    let joints = model.joints.iter().zip(&state.joints).filter(|(_, s)| !s.broken);
    let mut widest = joints.flat_map(|(joint, _)| gap(joint, &state.bodies)).fold(0.0, wider);
    if model.closures.is_empty() {
        return widest;
    }
    let near: Vec<f64> = state.joints.iter().map(|j| j.angle).collect();
    let poses = Poses { joints: &model.joints, before: None, bodies: &state.bodies, near: &near };
    let loops = model.closures.iter().zip(&state.closures).filter(|(_, s)| !s.broken);
    for (closure, _) in loops.filter(|(c, _)| c.spring().is_none()) {
        let mut open = [0.0; 6];
        closure.values(&poses, &mut open[..closure.len()]);
        widest = open.into_iter().fold(widest, wider);
    }
    widest
}

fn wider(widest: f64, gap: f64) -> f64 {
    widest.max(gap.abs())
}
