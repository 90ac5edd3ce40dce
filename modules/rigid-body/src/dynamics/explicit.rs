//! Refuses PD control that is computed from the state at the start of a step and cannot be stable at its length.
//!
//! One joint with inertia I under τ = −kp·q − kd·u, held over the step: u⁺ = u + h·τ/I, q⁺ = q + h·u⁺ is stable as long
//! as h·(2·kd + h·kp)/I < 4 (Jury's criterion on z² − (2 − a − b)·z + 1 − a, a = h·kd/I, b = h²·kp/I). For several
//! joints I⁻¹ is the matrix J·K⁻¹·Jᵀ of their rates under unit impulses, and the largest eigenvalue counts.

use super::kkt::Kkt;
use super::{Dynamics, Failure};
use crate::joint::Joint;
use crate::motor::Motor;
use crate::state::{JointState, State};

/// Steps of the power iteration; its value never exceeds the eigenvalue.
const ITERATIONS: usize = 40;
const LIMIT: f64 = 4.0;

/// h·(2·kd + h·kp) of a joint with such a motor, else 0.
fn weight(j: &JointState, h: f64) -> f64 {
    let explicit = j.motor == Motor::ExplicitPosition && !j.broken && j.blocked.is_none();
    if explicit { h * (2.0 * j.damping + h * j.stiffness) } else { 0.0 }
}

/// The gains of explicit motors that were checked last.
pub(crate) struct ExplicitGains {
    /// Weight of the motor of each joint; 0: no motor.
    weights: Vec<f64>,
}

impl ExplicitGains {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self { weights: vec![0.0; joints] }
    }

    /// Takes over the gains at a step of length h; whether any are to be checked that were not.
    fn take(&mut self, state: &State, h: f64) -> bool {
        let now = || state.joints.iter().map(|j| weight(j, h));
        if self.weights.iter().copied().eq(now()) {
            return false;
        }
        self.weights.clear();
        self.weights.extend(now());
        self.weights.iter().any(|w| *w != 0.0)
    }

    /// Largest eigenvalue of J·K⁻¹·Jᵀ·diag(weights), and the joint that moves most in it; `buffer`: as long as the unknowns.
    fn largest_eigenvalue(&self, joints: &[Joint], kkt: &Kkt, buffer: &mut [f64]) -> (f64, usize) {
        let (n, weights) = (self.weights.len(), &self.weights);
        let free = |j: usize| joints[j].free_row();
        // No pattern of a robot is orthogonal to this start.
        let mut x: Vec<f64> = (0..n).map(|j| 1.0 + 0.37 * ((7 * j) % 5) as f64).collect();
        let mut value = 0.0;
        for _ in 0..ITERATIONS {
            buffer.fill(0.0);
            for j in 0..n {
                let impulse = weights[j] * x[j];
                if let Some(free) = free(j).filter(|_| impulse != 0.0) {
                    kkt.push(buffer, &joints[j], &kkt.rows[j], free, impulse);
                }
            }
            kkt.solver.substitute(buffer);
            // 0 where a joint is not weighed
            let rate = |j: usize| {
                let free = free(j).filter(|_| weights[j] > 0.0);
                free.map_or(0.0, |free| kkt.rates(j, &joints[j], buffer)[free])
            };
            let y: Vec<f64> = (0..n).map(rate).collect();
            let product = |a: &[f64], b: &[f64]| (0..n).map(|j| weights[j] * a[j] * b[j]).sum::<f64>();
            value = product(&x, &y) / product(&x, &x);
            let size = product(&y, &y).sqrt();
            if !(size > 0.0) {
                return (0.0, 0);
            }
            x = y.iter().map(|y| y / size).collect();
        }
        let most = |j: &usize| weights[*j] * x[*j] * x[*j];
        let joint = (0..n).max_by(|a, b| most(a).total_cmp(&most(b))).unwrap_or(0);
        (value, joint)
    }
}

impl Dynamics {
    /// Checks the gains where they or the length of the step changed; the step is prepared.
    pub(super) fn check_explicit(&mut self, state: &State) -> Result<(), Failure> {
        let h = self.h;
        if !self.explicit.take(state, h) {
            return Ok(());
        }
        self.ensure_factor()?;
        let (largest, joint) =
            self.explicit.largest_eigenvalue(&self.model.joints, &self.kkt, &mut self.correction);
        if largest < LIMIT {
            return Ok(());
        }
        self.explicit.weights.clear();
        let joint = self.model.joints[joint].name.clone();
        Err(Failure::Explicit { joint, h, share: LIMIT / largest })
    }
}
