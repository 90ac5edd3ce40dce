//! A further trial of a step: one extra right-hand side with the factor that stands.
//!
//! Between trials of a step only the wrenches at the ports differ. The unknowns are linear in them on given branches of the
//! motors, so that a further trial is the first one plus K⁻¹·(change of the wrenches). The first trial has closed its
//! joints on the level of positions already; what the change leaves open is of second order in it and mostly below the
//! tolerance. Every trial starts from the first one, not from the last, so that the order of trials does not matter.

use super::{Dynamics, Failure};
use terraglue_linear_solver::Error as SolverError;

/// The first trial with a factor.
pub(super) struct FirstTrial {
    external: Vec<f64>,
    solution: Vec<f64>,
    /// Number of the factorisation that it belongs to; 0: none.
    of: u64,
}

impl FirstTrial {
    /// Room for n unknowns.
    pub fn new(n: usize) -> Self {
        Self { external: vec![0.0; n], solution: vec![0.0; n], of: 0 }
    }
}

impl Dynamics {
    /// Whether a trial with this factor has been solved and closed. Contacts answer to wrenches in their own way.
    pub(super) fn has_first_trial(&self) -> bool {
        self.first.of == self.factor_count && self.factored && !self.contacts.any()
    }

    /// Keeps a closed trial as the one that others start from, unless there is one.
    pub(super) fn keep_first_trial(&mut self) {
        if self.first.of == self.factor_count || self.contacts.any() {
            return;
        }
        self.first.external.clone_from(&self.external);
        self.first.solution.clone_from(&self.solution);
        self.first.of = self.factor_count;
    }

    /// The unknowns under `external` from those of the first trial.
    pub(super) fn solve_again(&mut self) -> Result<(), Failure> {
        self.solution.copy_from_slice(&self.first.solution);
        let bodies = 6 * self.starts.len();
        let mut changed = false;
        for ((c, e), first) in self.correction.iter_mut().zip(&self.external).zip(&self.first.external) {
            *c = e - first;
            changed |= *c != 0.0;
        }
        if !changed {
            return Ok(());
        }
        self.kkt.solver.substitute(&mut self.correction);
        self.solution.iter_mut().zip(&self.correction).for_each(|(s, c)| *s += c);
        // A sum is finite only if all its terms are.
        if self.solution[..bodies].iter().sum::<f64>().is_finite() {
            Ok(())
        } else {
            Err(Failure::Solver(SolverError::NotFinite))
        }
    }
}
