//! What the second-order options share: Newton on equilibrium and joints for the mean rates of the step.
//!
//! The matrix is the factor of the step, M and the rows J taken at the predicted motion; residuals are exact, so what
//! the matrix leaves out (gyroscopic terms, turning of the rows under load) costs iterations, not accuracy. Joints
//! are closed on the level of positions. The two rules are [`super::alpha`] and [`super::midpoint`].

use super::scheme::{Integrator, Six, Weights};
use super::{AxisResult, Dynamics, Failure};
use crate::dynamics::joint_rows::{coordinate, gap, mean_rows, rows};
use crate::math::V3;
use crate::state::{Motion, State};

/// Most corrections of a step.
const MAX_CORRECTIONS: usize = 60;
/// After so many corrections, or when they grow, earlier ones help (see [`super::anderson`]).
const PLAIN: usize = 8;
/// Where corrections shrink no more, so much of the largest rate is rounding: next to a singular pose gaps tell rates
/// badly.
const STALLED: f64 = 1e-7;
/// Corrections end when the rates change by less than this, relative to the largest.
const RATE_CHANGE: f64 = 1e-11;
/// Nor can they be known better than the gaps of joints can be told: this many units in the last place, over h.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Rates below this are rest, m/s and rad/s.
const REST: f64 = 1e-14;
/// Rates of a motion.
pub(super) fn rates(m: &Motion) -> Six {
    [m.v.x, m.v.y, m.v.z, m.w.x, m.w.y, m.w.z]
}

impl Dynamics {
    /// Linearises about the motion with unchanged accelerations.
    pub(super) fn prepare_second_order(&mut self, state: &State) -> Result<(), Failure> {
        self.start_accelerations.clone_from(&state.accelerations);
        self.angles.clear();
        self.angles.extend(state.joints.iter().map(|j| j.angle));
        self.loads.clone_from(&state.loads);
        if !state.accelerated && self.integrator != Integrator::EnergyMomentum {
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
        let span = self.span(state, self.h, self.integrator.force_time());
        for (j, joint) in self.model.joints.iter().enumerate() {
            let s = &state.joints[j];
            self.broken[j] = s.broken;
            self.rows[j] = match self.integrator {
                Integrator::EnergyMomentum => mean_rows(joint, &self.starts, &self.ends),
                _ => rows(joint, &self.ends),
            };
            self.axes[j].renew(s, joint.limits, &span);
            self.modes[j] = self.axes[j].start(s.mode);
        }
        self.prepare_closures(state);
        Ok(())
    }

    /// Corrects the mean rates until forces balance and joints are closed on the present branches.
    pub(super) fn solve_branch_second_order(&mut self) -> Result<(), Failure> {
        self.solution.copy_from_slice(&self.free);
        let noise = self.noise();
        let (mut least, mut last, mut mixed) = (f64::INFINITY, f64::INFINITY, None);
        for round in 0..MAX_CORRECTIONS {
            self.find_ends_second_order();
            self.residual_second_order();
            self.kkt.solver.substitute(&mut self.correction);
            if let Some(rounds) = &mut mixed {
                self.anderson.mix(*rounds, &self.solution, &mut self.correction);
                *rounds += 1;
            }
            self.solution.iter_mut().zip(&self.correction).for_each(|(s, c)| *s += c);
            let (change, rates) = (self.largest(&self.correction), self.largest(&self.solution));
            if (0..2).all(|k| change[k] <= RATE_CHANGE * rates[k] + noise) {
                self.find_ends_second_order();
                return self.check_gaps();
            }
            let share = (0..2).fold(0.0_f64, |m, k| m.max(change[k] / (rates[k] + REST)));
            if mixed.is_some() && share <= STALLED && share > 0.5 * least {
                self.find_ends_second_order();
                return self.check_gaps();
            }
            if mixed.is_none() && (share > last || round >= PLAIN) {
                mixed = Some(0);
                if share > STALLED {
                    self.solution.copy_from_slice(&self.free);
                }
            }
            (least, last) = (least.min(share), share);
        }
        Err(Failure::NotConverged { corrections: MAX_CORRECTIONS })
    }

    /// To what rates of jointed bodies can be told, m/s and rad/s.
    fn noise(&self) -> f64 {
        let jointed = self.model.joints.iter().flat_map(|j| [Some(j.child), j.parent]).flatten();
        let looped = (0..self.starts.len()).filter(|_| self.closes());
        let far = jointed.chain(looped).fold(0.0_f64, |m, b| m.max(1.0).max(self.starts[b].c.amax()));
        ROUNDING * far / self.h + REST
    }

    /// Largest translation and largest rotation among the unknowns of the bodies.
    fn largest(&self, x: &[f64]) -> [f64; 2] {
        x[..6 * self.starts.len()].chunks_exact(6).fold([0.0_f64; 2], |m, v| {
            let most = |k: usize| v[k..k + 3].iter().fold(m[k / 3], |m, v| m.max(v.abs()));
            [most(0), most(3)]
        })
    }

    /// The free axis of a joint.
    pub(super) fn axis_result_second_order(&self, j: usize, free: usize) -> AxisResult {
        let joint = &self.model.joints[j];
        let rate = self.travel(j) / self.h;
        let rows = rows(joint, &self.ends);
        let child = rates(&self.ends[joint.child]);
        let parent = joint.parent.map(|p| rates(&self.ends[p]));
        let end_rate = rows.rates(&child, parent.as_ref().map(|p| p.as_slice()))[free];
        AxisResult { rate, end_rate, mean_rate: rate, impulse: self.impulse_of(j, free) }
    }

    /// Change of the coordinate of joint j in the trial.
    pub(super) fn travel(&self, j: usize) -> f64 {
        coordinate(&self.model.joints[j], &self.ends, self.angles[j]) - self.angles[j]
    }

    pub(super) fn find_ends_second_order(&mut self) {
        match self.integrator {
            Integrator::EnergyMomentum => self.find_ends_midpoint(),
            _ => self.find_ends_alpha(),
        }
    }

    /// Fills `correction` with what is missing to equilibrium at the end and to closed joints.
    pub(super) fn residual_second_order(&mut self) {
        let weight = self.integrator.force_weight();
        let midpoint = self.integrator == Integrator::EnergyMomentum;
        self.correction.copy_from_slice(&self.external);
        self.turn_carried();
        for b in 0..self.ends.len() {
            if midpoint {
                self.equilibrium_midpoint(b);
            } else {
                self.equilibrium_alpha(b);
            }
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            if self.broken[j] {
                continue;
            }
            let at = self.kkt.joint_at[j];
            let open = gap(joint, &self.ends);
            let here =
                if midpoint { mean_rows(joint, &self.starts, &self.ends) } else { rows(joint, &self.ends) };
            let (free, rigid) = (joint.free_row(), joint.rigid());
            for r in (0..6).filter(|r| rigid[*r] || free == Some(*r)) {
                let mut impulse = -self.solution[at + r];
                if free == Some(r) {
                    match self.axes[j].row(self.modes[j]) {
                        Some((c, b)) => {
                            self.correction[at + r] = b - self.travel(j) / self.h - c / weight * impulse;
                        }
                        None => impulse = weight * self.axes[j].impulse(self.modes[j]),
                    }
                } else {
                    self.correction[at + r] = -open[r] / self.h;
                }
                if impulse == 0.0 {
                    continue;
                }
                add(&mut self.correction, self.kkt.body_at[joint.child], impulse, &here.on_child(r));
                if let Some(parent) = joint.parent {
                    add(&mut self.correction, self.kkt.body_at[parent], impulse, &here.on_parent(r));
                }
            }
        }
        self.closures_second_order();
    }
}

/// I·ω̇ + ω × I·ω in world axes.
pub(super) fn inertial_moment(inertia: &crate::math::M3, m: &Motion, acceleration: &V3) -> V3 {
    let local = |v: &V3| m.q.inverse_transform_vector(v);
    let w = local(&m.w);
    m.q * (inertia * local(acceleration) + w.cross(&(inertia * w)))
}

pub(super) fn add(x: &mut [f64], at: usize, impulse: f64, row: &Six) {
    x[at..at + 6].iter_mut().zip(row).for_each(|(x, r)| *x += impulse * r);
}
