//! Refuses PD control that is computed from the state at the start of a step and cannot be stable at its length.
//!
//! One joint with inertia I under τ = −kp·q − kd·u, held over the step: u⁺ = u + h·τ/I, q⁺ = q + h·u⁺ is stable as long
//! as h·(2·kd + h·kp)/I < 4 (Jury's criterion on z² − (2 − a − b)·z + 1 − a, a = h·kd/I, b = h²·kp/I). For several
//! joints I⁻¹ is the matrix J·K⁻¹·Jᵀ of their rates under unit impulses, and the largest eigenvalue counts.

use super::{Dynamics, Failure};
use crate::drive::Motor;
use crate::state::{JointState, State};

/// Steps of the power iteration; its value never exceeds the eigenvalue.
const ITERATIONS: usize = 40;
const LIMIT: f64 = 4.0;

/// h·(2·kd + h·kp) of a joint with such a motor, else 0.
fn weight(j: &JointState, h: f64) -> f64 {
    let explicit = j.motor == Motor::ExplicitPosition && !j.broken && j.blocked.is_none();
    if explicit { h * (2.0 * j.damping + h * j.stiffness) } else { 0.0 }
}

impl Dynamics {
    /// Checks the gains where they or the length of the step changed; the step is prepared.
    pub(super) fn check_explicit(&mut self, state: &State) -> Result<(), Failure> {
        let h = self.h;
        let now = || state.joints.iter().map(|j| weight(j, h));
        if self.explicit.iter().copied().eq(now()) {
            return Ok(());
        }
        self.explicit.clear();
        self.explicit.extend(now());
        if self.explicit.iter().all(|w| *w == 0.0) {
            return Ok(());
        }
        self.ensure_factor()?;
        let (largest, joint) = self.largest_eigenvalue();
        if largest < LIMIT {
            return Ok(());
        }
        self.explicit.clear();
        let joint = self.model.joints[joint].name.clone();
        Err(Failure::Explicit { joint, h, share: LIMIT / largest })
    }

    /// Of J·K⁻¹·Jᵀ·diag(weights), and the joint that moves most in it.
    fn largest_eigenvalue(&mut self) -> (f64, usize) {
        let n = self.explicit.len();
        // No pattern of a robot is orthogonal to this start.
        let mut x: Vec<f64> = (0..n).map(|j| 1.0 + 0.37 * ((7 * j) % 5) as f64).collect();
        let mut value = 0.0;
        for _ in 0..ITERATIONS {
            self.correction.fill(0.0);
            for j in 0..n {
                self.add_impulse(j, self.explicit[j] * x[j]);
            }
            self.kkt.solver.substitute(&mut self.correction);
            let y: Vec<f64> = (0..n).map(|j| self.free_rate_of(j)).collect();
            let product = |a: &[f64], b: &[f64]| (0..n).map(|j| self.explicit[j] * a[j] * b[j]).sum::<f64>();
            value = product(&x, &y) / product(&x, &x);
            let size = product(&y, &y).sqrt();
            if !(size > 0.0) {
                return (0.0, 0);
            }
            x = y.iter().map(|y| y / size).collect();
        }
        let most = |j: &usize| self.explicit[*j] * x[*j] * x[*j];
        let joint = (0..n).max_by(|a, b| most(a).total_cmp(&most(b))).unwrap_or(0);
        (value, joint)
    }

    /// Adds an impulse along the free axis of a joint to `correction`.
    fn add_impulse(&mut self, j: usize, impulse: f64) {
        let joint = &self.model.joints[j];
        let Some(free) = joint.free_row().filter(|_| impulse != 0.0) else { return };
        let parent = joint.parent.map(|p| (p, self.rows[j].on_parent(free)));
        for (body, row) in [Some((joint.child, self.rows[j].on_child(free))), parent].into_iter().flatten() {
            let at = self.kkt.body_at[body];
            self.correction[at..at + 6].iter_mut().zip(row).for_each(|(c, r)| *c += impulse * r);
        }
    }

    /// Rate of the free axis of a joint in `correction`; 0 where it is not weighed.
    fn free_rate_of(&self, j: usize) -> f64 {
        let free = self.model.joints[j].free_row().filter(|_| self.explicit[j] > 0.0);
        free.map_or(0.0, |free| self.rates(j, &self.correction)[free])
    }
}
