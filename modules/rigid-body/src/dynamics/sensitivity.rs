//! Exact derivative of the end of a trial by a wrench, with the parts that the factor of the step alone leaves out.
//!
//! The factor P holds the rows of the joints where the step was linearised: at its start, its predicted end, or their
//! mean. The derivative of a trial asks for the rows of the conditions where the bodies ended, under the derivative of
//! the Cayley transform, and in second order also for gyroscopic moments and for forces that turn with their joints: all
//! that is of the order ω·h, and all of it is in the residual r of the step. For a load f the change y of the unknowns
//! is refined with the factor at hand, y ← y + P⁻¹(f + (r(s + ε·y) − r(s))/ε), each time to about ω·h of the previous
//! error, until that is [`EXACT`].

use super::Dynamics;

/// Distance or angle by which the differences move a body, m or rad: their error is about that share, over the length
/// of a body.
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
    /// The load, all zero before.
    pub fn load(&mut self) -> &mut [f64] {
        self.load.fill(0.0);
        &mut self.load
    }

    /// Remembers the trial at hand; to be called before [`Sensitivity::answer`].
    pub fn begin(&mut self, dynamics: &mut Dynamics) {
        self.trial.clone_from(&dynamics.trial.solution);
        self.load.resize(dynamics.trial.solution.len(), 0.0);
        find_ends(dynamics);
        find_residual(dynamics);
        self.residual.clone_from(&dynamics.correction);
    }

    /// Gives the trial a small share ε of its answer to the load, so that all that follows from it can be differenced: ε,
    /// or none where nothing moves.
    pub fn answer(&mut self, dynamics: &mut Dynamics) -> Option<f64> {
        self.change.clone_from(&self.load);
        dynamics.kkt.solver.substitute(&mut self.change);
        let rates = 6 * dynamics.start.bodies.len();
        let mut left = 1.0;
        for _ in 0..MAX_REFINEMENTS {
            let epsilon = self.put(dynamics)?;
            find_residual(dynamics);
            let second = dynamics.integrator.is_second_order();
            for ((c, r), load) in dynamics.correction.iter_mut().zip(&self.residual).zip(&self.load) {
                // in first order all rows but those of places are linear, and the factor's own
                *c = (*c - r) / epsilon + if second { *load } else { 0.0 };
            }
            dynamics.kkt.solver.substitute(&mut dynamics.correction);
            let now = largest(&dynamics.correction[..rates]) / largest(&self.change[..rates]);
            // A step that turns bodies so far that this does not converge keeps the last value.
            if !(now < left) {
                break;
            }
            self.change.iter_mut().zip(&dynamics.correction).for_each(|(y, c)| *y += c);
            if now * now <= EXACT * left {
                break;
            }
            left = now;
        }
        self.put(dynamics)
    }

    /// Whether the trial at hand ends within this distance (m or rad) of the one that was remembered.
    pub fn is_near(&self, dynamics: &Dynamics, distance: f64) -> bool {
        let (now, rates) = (&dynamics.trial.solution, 6 * dynamics.start.bodies.len());
        let far = |(a, b): (&f64, &f64)| !((a - b).abs() * dynamics.h <= distance);
        self.trial.len() == now.len() && !now.iter().zip(&self.trial).take(rates).any(far)
    }

    /// Back to the trial.
    pub fn end(&self, dynamics: &mut Dynamics) {
        dynamics.trial.solution.copy_from_slice(&self.trial);
        find_ends(dynamics);
    }

    /// The trial with a share of the change, as large as the differences want it.
    fn put(&self, dynamics: &mut Dynamics) -> Option<f64> {
        let size = largest(&self.change[..6 * dynamics.start.bodies.len()]);
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let epsilon = MOVE / (dynamics.h * size);
        for ((u, trial), y) in dynamics.trial.solution.iter_mut().zip(&self.trial).zip(&self.change) {
            *u = trial + epsilon * y;
        }
        find_ends(dynamics);
        Some(epsilon)
    }
}

/// Largest of some rates.
fn largest(rates: &[f64]) -> f64 {
    rates.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// Motion at the end for the unknowns of the trial.
fn find_ends(dynamics: &mut Dynamics) {
    if dynamics.integrator.is_second_order() {
        dynamics.find_ends_second_order();
    } else {
        dynamics.trial.find_places(&dynamics.kkt, &dynamics.start, dynamics.h);
        (0..dynamics.trial.ends.len()).for_each(|b| dynamics.find_rates(b));
    }
}

/// Residual of the conditions of the step, into `correction`.
fn find_residual(dynamics: &mut Dynamics) {
    if dynamics.integrator.is_second_order() {
        dynamics.residual_second_order();
    } else {
        dynamics.gaps_into_correction();
    }
}
