//! Generalized-α in maximal coordinates: rates at the end of the step, equilibrium there, a consistent start.

use super::scheme::{Acceleration, BodyEnd, Weights, inertial_moment, rates};
use super::{Dynamics, Failure};
use crate::dynamics::joint_rows::{gap, rows};
use crate::math::{V3, cayley};
use crate::model::Body;
use crate::motion::Motion;
use crate::state::{Load, State};

/// Time over which accelerations of the joints are differenced at the start, s.
const START_DIFFERENCE_S: f64 = 1e-4;

/// End of a body for the mean rate u, with its rates and accelerations there.
pub(super) fn end(weights: &Weights, start: &Motion, before: &Acceleration, u: &[f64], h: f64) -> BodyEnd {
    let (rate, acceleration) = weights.end(u, &rates(start), before, h);
    let turn = h * V3::new(u[3], u[4], u[5]);
    let mut q = cayley(&turn) * start.q;
    q.renormalize_fast();
    let c = start.c + h * V3::new(u[0], u[1], u[2]);
    let (v, w) = (V3::new(rate[0], rate[1], rate[2]), V3::new(rate[3], rate[4], rate[5]));
    BodyEnd { motion: Motion { c, q, v, w }, turn, acceleration }
}

/// θ·h·(forces − M·v̇⁺ − gyroscopic moments) of a body; `scale`: θ·h.
pub(super) fn equilibrium(
    body: &Body,
    gravity: &V3,
    load: &Load,
    (end, real): (&Motion, &[f64; 6]),
    scale: f64,
) -> [f64; 6] {
    let force = body.mass * (gravity - V3::from_row_slice(&real[..3])) + load.force;
    let moment = load.moment - inertial_moment(&body.inertia, end, &V3::from_row_slice(&real[3..]));
    std::array::from_fn(|k| scale * if k < 3 { force[k] } else { moment[k - 3] })
}

impl Dynamics {
    /// A step of no length: the accelerations at t under `external`, which holds N and N m here, into the start.
    pub fn stand_still(&mut self, state: &State) -> Result<(), Failure> {
        self.h = 0.0;
        self.start.take(state);
        self.accelerate(state)
    }

    /// Accelerations at the start under the forces there and `external` (N, N m), into the start.
    ///
    /// Rigid rows ask for J·v̇ = −J̇·v; the right-hand side is differenced from the gaps that open when all bodies
    /// go on at their rates for a moment, forwards and backwards.
    pub(super) fn accelerate(&mut self, state: &State) -> Result<(), Failure> {
        self.rhs.copy_from_slice(&self.external);
        for (b, body) in self.model.bodies.iter().enumerate() {
            let (m, load) = (&state.bodies[b], &state.loads[b]);
            self.kkt.turn_inertia(b, body, &m.q);
            let force = body.mass * self.model.gravity + load.force;
            let moment = load.moment - inertial_moment(&body.inertia, m, &V3::zeros());
            let at = self.kkt.body_at[b];
            for k in 0..3 {
                self.rhs[at + k] += force[k];
                self.rhs[at + 3 + k] += moment[k];
            }
        }
        self.hold_joints(state);
        self.closing.rest_into(&self.model, &self.start, &self.kkt, &mut self.rhs);
        drift(self, state);
        self.kkt.factor(&self.closing.cuts)?;
        self.kkt.factored = false;
        self.kkt.factor_count += 1;
        self.kkt.solver.solve(&self.rhs, &mut self.trial.solution)?;
        for b in 0..self.start.bodies.len() {
            let at = self.kkt.body_at[b];
            let real = std::array::from_fn(|k| self.trial.solution[at + k]);
            self.start.accelerations[b] = Acceleration { algorithmic: real, real };
        }
        Ok(())
    }

    /// Rows of the joints where bodies are: rigid ones hold, motors push as they do there.
    fn hold_joints(&mut self, state: &State) {
        let dt = START_DIFFERENCE_S;
        let span = self.span(state, dt, 1.0);
        for (j, joint) in self.model.joints.iter().enumerate() {
            let s = &state.joints[j];
            self.kkt.rows[j] = rows(joint, &state.bodies);
            let axis = &mut self.branches.axes[j];
            axis.renew(s, joint.limits, &span);
            let mode = axis.start(s.mode);
            let (rigid, free) = (joint.rigid(), joint.free_row());
            for r in 0..6 {
                let holds = !s.broken && (rigid[r] || free == Some(r));
                self.kkt.compliance[j][r] = holds.then_some(0.0);
            }
            let Some(free) = joint.free_row().filter(|_| !s.broken) else { continue };
            let torque = match axis.row(mode) {
                // A rigid motor, a stop or a brake: the axis keeps its rate.
                Some((0.0, _)) => continue,
                Some((c, b)) => ((b - s.velocity) / (c * dt)).clamp(-s.max_torque, s.max_torque),
                None => axis.impulse(mode) / dt,
            };
            self.kkt.compliance[j][free] = None;
            self.kkt.push(&mut self.rhs, joint, &self.kkt.rows[j], free, torque);
        }
    }
}

/// Takes from the right-hand side the opening of joints and loops when all bodies go on at their rates for a moment, forwards
/// and backwards.
fn drift(dynamics: &mut Dynamics, state: &State) {
    for dt in [START_DIFFERENCE_S, -START_DIFFERENCE_S] {
        for (end, m) in dynamics.trial.ends.iter_mut().zip(&state.bodies) {
            *end = Motion { c: m.c + dt * m.v, q: cayley(&(dt * m.w)) * m.q, ..*m };
        }
        for (j, joint) in dynamics.model.joints.iter().enumerate() {
            let at = dynamics.kkt.joint_at[j];
            let open = gap(joint, &dynamics.trial.ends);
            (0..6).for_each(|r| dynamics.rhs[at + r] -= open[r] / (dt * dt));
        }
        dynamics.closing.drift_into(
            &dynamics.model,
            &dynamics.start,
            &dynamics.trial.ends,
            &dynamics.kkt,
            dt,
            &mut dynamics.rhs,
        );
    }
}
