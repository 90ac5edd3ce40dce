//! Generalized-α in maximal coordinates: rates at the end of the step, equilibrium there, a consistent start.

use super::scheme::{Acceleration, Integrator, Weights};
use super::second_order::{add, inertial_moment, rates};
use super::{Dynamics, Failure};
use crate::dynamics::joint_rows::{gap, rows};
use crate::math::{V3, cayley};
use crate::state::{Motion, State};

/// Time over which accelerations of the joints are differenced at the start, s.
const START_DIFFERENCE_S: f64 = 1e-4;

impl Dynamics {
    fn weights(&self) -> Weights {
        match self.integrator {
            Integrator::GeneralizedAlpha(weights) => weights,
            _ => Weights::new(1.0),
        }
    }

    /// Poses, rates and accelerations at the end for the mean rates in `solution`.
    pub(super) fn find_ends_alpha(&mut self) {
        let (weights, h) = (self.weights(), self.h);
        for b in 0..self.ends.len() {
            let (start, at) = (&self.starts[b], self.kkt.body_at[b]);
            let u = &self.solution[at..at + 6];
            let (rate, end) = weights.end(u, &rates(start), &self.start_accelerations[b], h);
            self.turns[b] = h * V3::new(u[3], u[4], u[5]);
            let mut q = cayley(&self.turns[b]) * start.q;
            q.renormalize_fast();
            let c = start.c + h * V3::new(u[0], u[1], u[2]);
            let (v, w) = (V3::new(rate[0], rate[1], rate[2]), V3::new(rate[3], rate[4], rate[5]));
            self.ends[b] = Motion { c, q, v, w };
            self.end_accelerations[b] = end;
        }
    }

    /// Adds θ·h·(forces − M·v̇⁺ − gyroscopic moments) of a body to `correction`.
    pub(super) fn equilibrium_alpha(&mut self, b: usize) {
        let body = &self.model.bodies[b];
        let scale = self.integrator.force_weight() * self.h;
        let (end, real) = (&self.ends[b], &self.end_accelerations[b].real);
        let load = &self.loads[b];
        let force = body.mass * (self.model.gravity - V3::from_row_slice(&real[..3])) + load.force;
        let moment = load.moment - inertial_moment(&body.inertia, end, &V3::from_row_slice(&real[3..]));
        let at = self.kkt.body_at[b];
        for k in 0..3 {
            self.correction[at + k] += scale * force[k];
            self.correction[at + 3 + k] += scale * moment[k];
        }
    }

    /// A step of no length: the accelerations at t under `external`, which holds N and N m here, into
    /// `start_accelerations`.
    pub fn stand_still(&mut self, state: &State) -> Result<(), Failure> {
        self.h = 0.0;
        self.starts.clone_from(&state.bodies);
        self.accelerate(state)
    }

    /// Accelerations at the start under the forces there and `external` (N, N m), into `start_accelerations`.
    ///
    /// Rigid rows ask for J·v̇ = −J̇·v; the right-hand side is differenced from the gaps that open when all bodies
    /// go on at their rates for a moment, forwards and backwards.
    pub(super) fn accelerate(&mut self, state: &State) -> Result<(), Failure> {
        let dt = START_DIFFERENCE_S;
        self.rhs.copy_from_slice(&self.external);
        for (b, body) in self.model.bodies.iter().enumerate() {
            let m = &state.bodies[b];
            let r = m.q.to_rotation_matrix();
            self.inertia[b] = r * body.inertia * r.transpose();
            let load = &state.loads[b];
            let force = body.mass * self.model.gravity + load.force;
            let moment = load.moment - inertial_moment(&body.inertia, m, &V3::zeros());
            let at = self.kkt.body_at[b];
            for k in 0..3 {
                self.rhs[at + k] += force[k];
                self.rhs[at + 3 + k] += moment[k];
            }
        }
        let span = self.span(state, dt, 1.0);
        for (j, joint) in self.model.joints.iter().enumerate() {
            let s = &state.joints[j];
            self.rows[j] = rows(joint, &state.bodies);
            let axis = &mut self.axes[j];
            axis.renew(s, joint.limits, &span);
            let mode = axis.start(s.mode);
            let (rigid, free) = (joint.rigid(), joint.free_row());
            for r in 0..6 {
                let holds = !s.broken && (rigid[r] || free == Some(r));
                self.compliance[j][r] = holds.then_some(0.0);
            }
            let Some(free) = joint.free_row().filter(|_| !s.broken) else { continue };
            let torque = match axis.row(mode) {
                // A rigid motor, a stop or a brake: the axis keeps its rate.
                Some((0.0, _)) => continue,
                Some((c, b)) => ((b - s.velocity) / (c * dt)).clamp(-s.max_torque, s.max_torque),
                None => axis.impulse(mode) / dt,
            };
            self.compliance[j][free] = None;
            add(&mut self.rhs, self.kkt.body_at[joint.child], torque, &self.rows[j].on_child(free));
            if let Some(parent) = joint.parent {
                add(&mut self.rhs, self.kkt.body_at[parent], torque, &self.rows[j].on_parent(free));
            }
        }
        self.closures_at_rest();
        for direction in [1.0, -1.0] {
            self.drift(&state.bodies, direction * dt);
            for (j, joint) in self.model.joints.iter().enumerate() {
                let at = self.kkt.joint_at[j];
                let open = gap(joint, &self.ends);
                (0..6).for_each(|r| self.rhs[at + r] -= open[r] / (dt * dt));
            }
            self.closures_drift(dt);
        }
        self.kkt.factor(&self.inertia, &self.rows, &self.compliance, &self.closing.cuts)?;
        self.factored = false;
        self.factor_count += 1;
        self.kkt.solver.solve(&self.rhs, &mut self.solution)?;
        for b in 0..self.starts.len() {
            let at = self.kkt.body_at[b];
            let real = std::array::from_fn(|k| self.solution[at + k]);
            self.start_accelerations[b] = Acceleration { algorithmic: real, real };
        }
        Ok(())
    }

    /// All bodies go on at their rates for a time, into `ends`.
    fn drift(&mut self, bodies: &[Motion], dt: f64) {
        for (end, m) in self.ends.iter_mut().zip(bodies) {
            *end = Motion { c: m.c + dt * m.v, q: cayley(&(dt * m.w)) * m.q, ..*m };
        }
    }
}
