//! How the end of a trial answers to a wrench, exactly: what the factor of the step alone leaves out.
//!
//! The factor P holds the rows of the joints where the step was linearised: at its start, its predicted end, or their
//! mean. The derivative of a trial asks for the rows of the conditions where the bodies ended, under the derivative of
//! the Cayley transform, and in second order also for gyroscopic moments and for forces that turn with their joints: all
//! that is of the order ω·h, and all of it is in the residual r of the step. For a load f the change y of the unknowns
//! is refined with the factor at hand, y ← y + P⁻¹(f + (r(s + ε·y) − r(s))/ε), each time to about ω·h of what was
//! left, until that is [`EXACT`].

use super::Dynamics;

/// How far the differences move a body, m or rad: their error is about that share, over the length of a body.
const MOVE: f64 = 1e-6;
/// Share of y that may be left out.
const EXACT: f64 = 1e-6;
/// Most refinements.
const MAX_REFINEMENTS: usize = 8;

/// Buffers.
#[derive(Default)]
pub(crate) struct Sensitivity {
    /// The unknowns of the trial and its residual.
    trial: Vec<f64>,
    residual: Vec<f64>,
    /// y.
    change: Vec<f64>,
    load: Vec<f64>,
}

impl Sensitivity {
    /// The trial that it was begun with.
    pub fn trial(&self) -> &[f64] {
        &self.trial
    }

    /// The load, all zero before.
    pub fn load(&mut self) -> &mut [f64] {
        self.load.fill(0.0);
        &mut self.load
    }
}

impl Dynamics {
    /// Remembers the trial at hand; to be called before [`Dynamics::answer`].
    pub fn begin_answers(&mut self, s: &mut Sensitivity) {
        s.trial.clone_from(&self.solution);
        s.load.resize(self.solution.len(), 0.0);
        self.find_ends_of_trial();
        self.residual_of_trial();
        s.residual.clone_from(&self.correction);
    }

    /// Gives the trial a small share ε of its answer to the load, so that all that follows from it can be differenced: ε,
    /// or none where nothing moves.
    pub fn answer(&mut self, s: &mut Sensitivity) -> Option<f64> {
        s.change.clone_from(&s.load);
        self.kkt.solver.substitute(&mut s.change);
        let mut left = 1.0;
        for _ in 0..MAX_REFINEMENTS {
            let epsilon = self.put(s)?;
            self.residual_of_trial();
            let second = self.integrator.is_second_order();
            for ((c, r), load) in self.correction.iter_mut().zip(&s.residual).zip(&s.load) {
                // in first order all rows but those of places are linear, and the factor's own
                *c = (*c - r) / epsilon + if second { *load } else { 0.0 };
            }
            self.kkt.solver.substitute(&mut self.correction);
            let now = self.size(&self.correction) / self.size(&s.change);
            // A step that turns bodies so far that this does not end keeps what it has.
            if !(now < left) {
                break;
            }
            s.change.iter_mut().zip(&self.correction).for_each(|(y, c)| *y += c);
            if now * now <= EXACT * left {
                break;
            }
            left = now;
        }
        self.put(s)
    }

    /// Whether the trial ends within this distance (m or rad) of that of these unknowns.
    pub fn ends_near(&self, other: &[f64], distance: f64) -> bool {
        let bodies = 6 * self.starts.len();
        let far = |(a, b): (&f64, &f64)| !((a - b).abs() * self.h <= distance);
        other.len() == self.solution.len() && !self.solution.iter().zip(other).take(bodies).any(far)
    }

    /// Back to the trial.
    pub fn end_answers(&mut self, s: &Sensitivity) {
        self.solution.copy_from_slice(&s.trial);
        self.find_ends_of_trial();
    }

    /// Largest rate in a vector of unknowns.
    fn size(&self, x: &[f64]) -> f64 {
        x[..6 * self.starts.len()].iter().fold(0.0, |m, v| m.max(v.abs()))
    }

    /// The trial with a share of the change, as large as the differences want it.
    fn put(&mut self, s: &Sensitivity) -> Option<f64> {
        let size = self.size(&s.change);
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let epsilon = MOVE / (self.h * size);
        for ((u, trial), y) in self.solution.iter_mut().zip(&s.trial).zip(&s.change) {
            *u = trial + epsilon * y;
        }
        self.find_ends_of_trial();
        Some(epsilon)
    }

    fn find_ends_of_trial(&mut self) {
        if self.integrator.is_second_order() {
            self.find_ends_second_order();
        } else {
            self.find_ends();
        }
    }

    /// What is missing to the conditions of the step, into `correction`.
    fn residual_of_trial(&mut self) {
        if self.integrator.is_second_order() {
            self.residual_second_order();
        } else {
            self.gaps_into_correction();
        }
    }
}
