//! Common parts of the second-order options: Newton on equilibrium and joints for the mean rates of the step.
//!
//! The matrix is the factor of the step, M and the rows J taken at the predicted motion; residuals are exact, so terms
//! that the matrix leaves out (gyroscopic terms, turning of the rows under load) cost iterations, not accuracy. Joints
//! are closed on the level of positions. The two rules are [`super::alpha`] and [`super::midpoint`].

use super::scheme::{Integrator, Six, Weights, rates};
use super::{AxisResult, Dynamics, Failure, alpha, midpoint};
use crate::dynamics::joint_rows::{coordinate, gap, mean_rows, rows};
use crate::state::State;

/// Most corrections of a step.
const MAX_CORRECTIONS: usize = 60;
/// After so many corrections, or when they grow, earlier ones help (see [`super::anderson`]).
const PLAIN: usize = 8;
/// Share of the largest rate that is rounding once corrections shrink no more: next to a singular pose gaps determine
/// rates badly.
const STALLED: f64 = 1e-7;
/// Corrections end when the rates change by less than this, relative to the largest.
const RATE_CHANGE: f64 = 1e-11;
/// Nor can they be more accurate than the gaps of joints: this many units in the last place, over h.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Rates below this are rest, m/s and rad/s.
const REST: f64 = 1e-14;

impl Dynamics {
    /// Linearises about the motion with unchanged accelerations.
    pub(super) fn prepare_second_order(&mut self, state: &State) -> Result<(), Failure> {
        self.start.accelerations.clone_from(&state.accelerations);
        self.start.loads.clone_from(&state.loads);
        if !state.accelerated && self.integrator != Integrator::EnergyMomentum {
            self.external.fill(0.0);
            self.accelerate(state)?;
        }
        for b in 0..self.start.bodies.len() {
            let at = self.kkt.body_at[b];
            let u = Weights::predict(&rates(&self.start.bodies[b]), &self.start.accelerations[b], self.h);
            self.start.free[at..at + 6].copy_from_slice(&u);
        }
        self.trial.solution.copy_from_slice(&self.start.free);
        self.find_ends_second_order();
        for b in 0..self.trial.ends.len() {
            self.kkt.turn_inertia(b, &self.model.bodies[b], &self.trial.ends[b].q);
        }
        let span = self.span(state, self.h, self.integrator.force_time());
        for (j, joint) in self.model.joints.iter().enumerate() {
            self.kkt.rows[j] = match self.integrator {
                Integrator::EnergyMomentum => mean_rows(joint, &self.start.bodies, &self.trial.ends),
                _ => rows(joint, &self.trial.ends),
            };
            self.branches.renew(j, joint, &state.joints[j], &span);
        }
        self.prepare_closures(state);
        Ok(())
    }

    /// Corrects the mean rates until forces balance and joints are closed on the present branches.
    pub(super) fn solve_branch_second_order(&mut self) -> Result<(), Failure> {
        self.trial.solution.copy_from_slice(&self.start.free);
        let noise = noise(self);
        let (mut least, mut last, mut mixed) = (f64::INFINITY, f64::INFINITY, None);
        for round in 0..MAX_CORRECTIONS {
            self.find_ends_second_order();
            self.residual_second_order();
            self.kkt.solver.substitute(&mut self.correction);
            if let Some(rounds) = &mut mixed {
                self.anderson.mix(*rounds, &self.trial.solution, &mut self.correction);
                *rounds += 1;
            }
            self.trial.solution.iter_mut().zip(&self.correction).for_each(|(s, c)| *s += c);
            let unknowns = 6 * self.start.bodies.len();
            let [change, rates] = [&self.correction, &self.trial.solution].map(|x| largest(&x[..unknowns]));
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
                    self.trial.solution.copy_from_slice(&self.start.free);
                }
            }
            (least, last) = (least.min(share), share);
        }
        Err(Failure::NotConverged { corrections: MAX_CORRECTIONS })
    }

    /// The free axis of a joint.
    pub(super) fn axis_result_second_order(&self, j: usize, free: usize) -> AxisResult {
        let joint = &self.model.joints[j];
        let rate = self.travel(j) / self.h;
        let rows = rows(joint, &self.trial.ends);
        let child = rates(&self.trial.ends[joint.child]);
        let parent = joint.parent.map(|p| rates(&self.trial.ends[p]));
        let end_rate = rows.rates(&child, parent.as_ref().map(|p| p.as_slice()))[free];
        AxisResult { rate, end_rate, mean_rate: rate, impulse: self.impulse_of(j, free) }
    }

    /// Change of the coordinate of joint j in the trial.
    pub(super) fn travel(&self, j: usize) -> f64 {
        coordinate(&self.model.joints[j], &self.trial.ends, self.start.angles[j]) - self.start.angles[j]
    }

    /// Poses, rates and accelerations at the end for the mean rates of the trial.
    pub(super) fn find_ends_second_order(&mut self) {
        for b in 0..self.trial.ends.len() {
            let (start, at) = (&self.start.bodies[b], self.kkt.body_at[b]);
            let u = &self.trial.solution[at..at + 6];
            let end = match &self.integrator {
                Integrator::SymplecticEuler => return,
                Integrator::GeneralizedAlpha(weights) => {
                    alpha::end(weights, start, &self.start.accelerations[b], u, self.h)
                }
                Integrator::EnergyMomentum => midpoint::end(start, u, self.h),
            };
            (self.trial.ends[b], self.trial.turns[b]) = (end.motion, end.turn);
            self.trial.accelerations[b] = end.acceleration;
        }
    }

    /// Fills `correction` with the residuals of equilibrium at the end and of closed joints.
    pub(super) fn residual_second_order(&mut self) {
        let weight = self.integrator.force_weight();
        let midpoint = self.integrator == Integrator::EnergyMomentum;
        self.correction.copy_from_slice(&self.external);
        for carried in &self.carried {
            let moment = carried.turned(&self.integrator, &self.trial.turns);
            let at = self.kkt.body_at[carried.body] + 3;
            self.correction[at..at + 3].iter_mut().zip(&moment).for_each(|(c, m)| *c += m);
        }
        for b in 0..self.trial.ends.len() {
            let (missing, at) = (equilibrium(self, b), self.kkt.body_at[b]);
            self.correction[at..at + 6].iter_mut().zip(missing).for_each(|(c, m)| *c += m);
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            if self.branches.broken[j] {
                continue;
            }
            let at = self.kkt.joint_at[j];
            let open = gap(joint, &self.trial.ends);
            let here = if midpoint {
                mean_rows(joint, &self.start.bodies, &self.trial.ends)
            } else {
                rows(joint, &self.trial.ends)
            };
            let (free, rigid) = (joint.free_row(), joint.rigid());
            for r in (0..6).filter(|r| rigid[*r] || free == Some(*r)) {
                let mut impulse = -self.trial.solution[at + r];
                if free == Some(r) {
                    match self.branches.row(j) {
                        Some((c, b)) => {
                            self.correction[at + r] = b - self.travel(j) / self.h - c / weight * impulse;
                        }
                        None => impulse = weight * self.branches.impulse(j),
                    }
                } else {
                    self.correction[at + r] = -open[r] / self.h;
                }
                if impulse != 0.0 {
                    self.kkt.push(&mut self.correction, joint, &here, r, impulse);
                }
            }
        }
        self.closing.miss_into(
            &self.model,
            &self.start,
            &self.trial,
            &self.kkt,
            (self.h, &self.integrator),
            &mut self.correction,
        );
    }
}

/// Accuracy of the rates of jointed bodies, m/s and rad/s.
fn noise(dynamics: &Dynamics) -> f64 {
    let jointed = dynamics.model.joints.iter().flat_map(|j| [Some(j.child), j.parent]).flatten();
    let looped = (0..dynamics.start.bodies.len()).filter(|_| dynamics.closing.any());
    let far = jointed.chain(looped).fold(0.0_f64, |m, b| m.max(1.0).max(dynamics.start.bodies[b].c.amax()));
    ROUNDING * far / dynamics.h + REST
}

/// Residual of the equilibrium of body b at the end of the trial.
fn equilibrium(dynamics: &Dynamics, b: usize) -> Six {
    let (body, gravity, load) =
        (&dynamics.model.bodies[b], &dynamics.model.gravity, &dynamics.start.loads[b]);
    let end = &dynamics.trial.ends[b];
    match &dynamics.integrator {
        Integrator::EnergyMomentum => {
            midpoint::equilibrium(body, gravity, load, (&dynamics.start.bodies[b], end), dynamics.h)
        }
        Integrator::SymplecticEuler | Integrator::GeneralizedAlpha(_) => {
            let real = &dynamics.trial.accelerations[b].real;
            alpha::equilibrium(body, gravity, load, (end, real), dynamics.impulse_per_force())
        }
    }
}

/// Largest translation and largest rotation among rates of bodies.
fn largest(rates: &[f64]) -> [f64; 2] {
    rates.chunks_exact(6).fold([0.0_f64; 2], |m, v| {
        let most = |k: usize| v[k..k + 3].iter().fold(m[k / 3], |m, v| m.max(v.abs()));
        [most(0), most(3)]
    })
}
