//! Reactions of the joints of the tree: the multipliers of their rows, the motor's share included, as force and moment.

use super::scheme::Integrator;
use super::{Dynamics, joint_rows};
use crate::math::V3;

impl Dynamics {
    /// Results that the commit needs beyond a trial: rates at the end of the step, impulses of rigid rows.
    pub fn complete(&mut self) {
        if !self.integrator.is_second_order() {
            (0..self.trial.ends.len()).for_each(|b| self.find_rates(b));
            self.complete_impulses();
        }
    }

    /// Impulses of rigid rows, where trials leave them out.
    pub(super) fn complete_impulses(&mut self) {
        if self.lean {
            self.kkt.complete(&self.rhs, &mut self.trial.solution);
        }
    }

    /// Force (N) at the joint's anchor and moment (N m) about it that the joint exerts on the child, world axes; the
    /// parent feels the opposite. `axis`: impulse along the free axis, N m s or N s. Mean of the step in first order,
    /// at its end (generalized-α) or in its middle in second.
    pub fn reaction(&self, j: usize, axis: f64) -> [f64; 6] {
        if self.branches.broken[j] {
            return [0.0; 6];
        }
        let joint = &self.model.joints[j];
        let rows = match self.integrator {
            Integrator::SymplecticEuler => self.kkt.rows[j],
            Integrator::GeneralizedAlpha(_) => joint_rows::rows(joint, &self.trial.ends),
            Integrator::EnergyMomentum => joint_rows::mean_rows(joint, &self.start.bodies, &self.trial.ends),
        };
        let (at, rigid, free) = (self.kkt.joint_at[j], joint.rigid(), joint.free_row());
        let mut sum = [V3::zeros(); 2];
        for r in 0..6 {
            let force = if free == Some(r) {
                axis / self.h
            } else if rigid[r] {
                -self.trial.solution[at + r] / self.impulse_per_force()
            } else {
                continue;
            };
            sum[r / 3] += force * rows.directions[r];
        }
        let [f, m] = sum;
        [f.x, f.y, f.z, m.x, m.y, m.z]
    }
}
