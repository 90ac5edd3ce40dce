//! The mean force on all feet together, which over a few steps is the weight of the robot on its ground.

use crate::geometry::LEGS;

/// Time over which the mean is taken, s.
const WINDOW_S: f64 = 1.0;

/// A mean that forgets; before a whole window has passed, the mean of all so far.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Load {
    mean: f64,
    passed_s: f64,
}

impl Load {
    /// Takes in the forces (N) over the next `dt` s. Forces in the wrong direction count as zero.
    pub fn advance(&mut self, forces: &[Option<f64>; LEGS], dt: f64) {
        let sum: f64 = forces.iter().flatten().map(|f| f.max(0.0)).sum();
        self.passed_s = (self.passed_s + dt).min(WINDOW_S.max(dt));
        self.mean += (sum - self.mean) * (dt / self.passed_s).min(1.0);
    }

    /// Mean force, N.
    pub fn mean(&self) -> f64 {
        self.mean
    }
}

terraglue_subsystem::persist!(Load { mean, passed_s });
