//! One step by generalized-α in maximal coordinates: Newton on equilibrium and joints at the end of the step.
//!
//! The matrix is the factor of the step, M and the rows J taken at the predicted end; residuals are exact, so what
//! the matrix leaves out (gyroscopic terms, turning of the rows under load) costs iterations, not accuracy. Joints
//! are closed on the level of positions.

use super::scheme::{Acceleration, Integrator, Six, Weights};
use super::{AxisResult, Dynamics, Failure, GAP_TOLERANCE};
use crate::drive::Axis;
use crate::dynamics::joint_rows::{coordinate, gap, rows};
use crate::math::{V3, cayley};
use crate::state::{Motion, State};

/// Most corrections of a step.
const MAX_CORRECTIONS: usize = 40;
/// Corrections end when the rates change by less than this, relative to the largest.
const RATE_CHANGE: f64 = 1e-11;
/// Nor can they be known better than positions can be stored: this many units in the last place, over h.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Time over which accelerations of the joints are differenced at the start, s.
const START_DIFFERENCE_S: f64 = 1e-4;

/// Rates of a motion.
fn rates(m: &Motion) -> Six {
    [m.v.x, m.v.y, m.v.z, m.w.x, m.w.y, m.w.z]
}

impl Dynamics {
    fn weights(&self) -> Weights {
        match self.integrator {
            Integrator::GeneralizedAlpha(weights) => weights,
            Integrator::SymplecticEuler => Weights::new(1.0),
        }
    }

    /// Linearises about the motion with unchanged accelerations.
    pub(super) fn prepare_second_order(&mut self, state: &State) -> Result<(), Failure> {
        self.start_accelerations.clone_from(&state.accelerations);
        self.angles.clear();
        self.angles.extend(state.joints.iter().map(|j| j.angle));
        self.forces.clone_from(&state.forces);
        if !state.accelerated {
            self.external.fill(0.0);
            self.accelerate(state)?;
        }
        for b in 0..self.starts.len() {
            let at = self.kkt.body_at[b];
            let u = Weights::predict(&rates(&self.starts[b]), &self.start_accelerations[b], self.h);
            self.free[at..at + 6].copy_from_slice(&u);
        }
        self.solution.copy_from_slice(&self.free);
        self.find_ends_second_order();
        for b in 0..self.ends.len() {
            let r = self.ends[b].q.to_rotation_matrix();
            self.inertia[b] = r * self.model.bodies[b].inertia * r.transpose();
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            let s = &state.joints[j];
            self.broken[j] = s.broken;
            self.rows[j] = rows(joint, &self.ends);
            self.axes[j] = Axis::new(s, joint.limits, state.supply.limit, self.h);
            self.modes[j] = self.axes[j].start(s.mode);
        }
        Ok(())
    }

    /// Corrects the mean rates until forces balance and joints are closed on the present branches.
    pub(super) fn solve_branch_second_order(&mut self) -> Result<(), Failure> {
        self.solution.copy_from_slice(&self.free);
        let far = self.starts.iter().fold(1.0_f64, |m, s| m.max(s.c.amax()));
        let noise = ROUNDING * far / self.h;
        for _ in 0..MAX_CORRECTIONS {
            self.find_ends_second_order();
            self.residual_second_order();
            self.kkt.solver.substitute(&mut self.correction);
            self.solution.iter_mut().zip(&self.correction).for_each(|(s, c)| *s += c);
            let bodies = 6 * self.starts.len();
            let largest = |x: &[f64]| x[..bodies].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            if largest(&self.correction) <= RATE_CHANGE * largest(&self.solution) + noise {
                self.find_ends_second_order();
                return self.check_gaps();
            }
        }
        Err(Failure::NotConverged { corrections: MAX_CORRECTIONS })
    }

    /// The free axis of a joint.
    pub(super) fn axis_result_second_order(&self, j: usize, free: usize) -> AxisResult {
        let joint = &self.model.joints[j];
        let rate = (coordinate(joint, &self.ends, self.angles[j]) - self.angles[j]) / self.h;
        let rows = rows(joint, &self.ends);
        let child = rates(&self.ends[joint.child]);
        let parent = joint.parent.map(|p| rates(&self.ends[p]));
        let end_rate = rows.rates(&child, parent.as_ref().map(|p| p.as_slice()))[free];
        let impulse = match self.axes[j].row(self.modes[j]) {
            Some(_) => -self.solution[self.kkt.joint_at[j] + free] / self.integrator.force_weight(),
            None => self.axes[j].impulse(self.modes[j]),
        };
        AxisResult { rate, end_rate, mean_rate: rate, impulse }
    }

    fn check_gaps(&mut self) -> Result<(), Failure> {
        match self.gaps_into_correction() {
            (_, gap) if gap <= 1e3 * GAP_TOLERANCE => Ok(()),
            (j, gap) => Err(Failure::Gap { joint: self.model.joints[j].name.clone(), gap }),
        }
    }

    /// Poses, rates and accelerations at the end for the mean rates in `solution`.
    fn find_ends_second_order(&mut self) {
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

    /// Fills `correction` with what is missing to equilibrium at the end and to closed joints.
    fn residual_second_order(&mut self) {
        let weight = self.integrator.force_weight();
        let scale = weight * self.h;
        self.correction.copy_from_slice(&self.external);
        for (b, body) in self.model.bodies.iter().enumerate() {
            let (end, real) = (&self.ends[b], &self.end_accelerations[b].real);
            let force = body.mass * (self.model.gravity - V3::from_row_slice(&real[..3])) + self.forces[b];
            let moment = -inertial_moment(&body.inertia, end, &V3::from_row_slice(&real[3..]));
            let at = self.kkt.body_at[b];
            for k in 0..3 {
                self.correction[at + k] += scale * force[k];
                self.correction[at + 3 + k] += scale * moment[k];
            }
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            if self.broken[j] {
                continue;
            }
            let at = self.kkt.joint_at[j];
            let open = gap(joint, &self.ends);
            let end_rows = rows(joint, &self.ends);
            let free = joint.free_row();
            for r in 0..6 {
                let mut impulse = -self.solution[at + r];
                if free == Some(r) {
                    match self.axes[j].row(self.modes[j]) {
                        Some((c, b)) => {
                            let travel = coordinate(joint, &self.ends, self.angles[j]) - self.angles[j];
                            self.correction[at + r] = b - travel / self.h - c / weight * impulse;
                        }
                        None => impulse = weight * self.axes[j].impulse(self.modes[j]),
                    }
                } else {
                    self.correction[at + r] = -open[r] / self.h;
                }
                if impulse == 0.0 {
                    continue;
                }
                add(&mut self.correction, self.kkt.body_at[joint.child], impulse, &end_rows.on_child(r));
                if let Some(parent) = joint.parent {
                    add(&mut self.correction, self.kkt.body_at[parent], impulse, &end_rows.on_parent(r));
                }
            }
        }
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
            let force = body.mass * self.model.gravity + state.forces[b];
            let moment = -inertial_moment(&body.inertia, m, &V3::zeros());
            let at = self.kkt.body_at[b];
            for k in 0..3 {
                self.rhs[at + k] += force[k];
                self.rhs[at + 3 + k] += moment[k];
            }
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            let s = &state.joints[j];
            self.rows[j] = rows(joint, &state.bodies);
            let axis = Axis::new(s, joint.limits, state.supply.limit, dt);
            let mode = axis.start(s.mode);
            for r in 0..6 {
                self.compliance[j][r] = if s.broken { None } else { Some(0.0) };
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
        for direction in [1.0, -1.0] {
            self.drift(&state.bodies, direction * dt);
            for (j, joint) in self.model.joints.iter().enumerate() {
                let at = self.kkt.joint_at[j];
                let open = gap(joint, &self.ends);
                (0..6).for_each(|r| self.rhs[at + r] -= open[r] / (dt * dt));
            }
        }
        self.kkt.factor(&self.inertia, &self.rows, &self.compliance)?;
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

/// I·ω̇ + ω × I·ω in world axes.
fn inertial_moment(inertia: &crate::math::M3, m: &Motion, acceleration: &V3) -> V3 {
    let local = |v: &V3| m.q.inverse_transform_vector(v);
    let w = local(&m.w);
    m.q * (inertia * local(acceleration) + w.cross(&(inertia * w)))
}

fn add(x: &mut [f64], at: usize, impulse: f64, row: &Six) {
    x[at..at + 6].iter_mut().zip(row).for_each(|(x, r)| *x += impulse * r);
}
