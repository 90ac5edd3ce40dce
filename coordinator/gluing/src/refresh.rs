//! When the bodies' interface Jacobian is computed again, and from where.

use super::derivatives::Derivatives;
use super::interface_problem::InterfaceProblem;
use super::memory::{Recall, Remember};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::JacobianChoice;

/// The residual may shrink by this factor at least before the Jacobian counts as stale.
const RATIO: f64 = 0.3;

/// `gluing.jacobian`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Way {
    /// The modules' own derivatives, anew at every iteration: they cost no evaluation.
    #[default]
    Analytic,
    /// Directional derivatives, or central differences, at the first iteration of a step.
    Central,
    /// Forward differences at the first iteration of a step.
    Forward,
    /// Forward differences once.
    Broyden,
    /// The control that shows why one must refresh.
    Frozen,
}

/// Keeps G from trial to trial.
///
/// One that comes from differences is taken at the first iteration of a step, and again when an iteration left more
/// than 0.3 of the residual. Between, and with `broyden` from step to step, Broyden's rank-one update (1965) brings
/// it in line with the trials.
#[derive(Debug, Default)]
pub struct Refresh {
    way: Way,
    /// n, epoch and h of the kept one.
    of: Option<(usize, u32, f64)>,
    g: Vec<f64>,
    /// T and the bodies' part of the mismatch at the trial before.
    t: Vec<f64>,
    motion: Vec<f64>,
    change: Vec<f64>,
}

impl Refresh {
    /// From `gluing.jacobian`.
    pub fn new(jacobian: JacobianChoice) -> Self {
        let way = match jacobian {
            JacobianChoice::Directional => Way::Central,
            JacobianChoice::FiniteDifferences => Way::Forward,
            JacobianChoice::Broyden => Way::Broyden,
            JacobianChoice::Frozen => Way::Frozen,
            JacobianChoice::Analytic | JacobianChoice::Diagonal => Way::Analytic,
        };
        Self { way, ..Self::default() }
    }

    /// Puts G for the last trial into `problem.estimate`. `left` is the present residual, `before` that of the
    /// iteration before (NaN: this is the first).
    pub fn provide(
        &mut self,
        left: f64,
        before: f64,
        problem: &mut InterfaceProblem,
        instances: &mut [Instance],
    ) -> Result {
        if self.is_stale(left, before, problem) {
            problem.linearise_bodies(self.source(), instances)?;
        } else {
            self.put_back(before, problem);
        }
        self.of = Some((problem.n(), problem.at.epoch, problem.at.h));
        self.g.clone_from(&problem.estimate.g);
        self.t.clone_from(&problem.t);
        self.motion.clear();
        self.motion.extend((0..problem.n()).map(|i| problem.component(i).bodies_part()));
        Ok(())
    }

    /// Part of a snapshot.
    pub fn remember(&self, out: &mut Vec<u64>) {
        let (n, epoch, h) = self.of.unwrap_or((0, 0, f64::NAN));
        out.extend([n as u64, u64::from(epoch)]);
        out.put(h);
        [&self.g, &self.t, &self.motion].into_iter().for_each(|list| out.put_all(list));
    }

    /// Back from a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        let (n, epoch, h) = (kept.word() as usize, kept.word() as u32, kept.number());
        self.of = (!h.is_nan()).then_some((n, epoch, h));
        [&mut self.g, &mut self.t, &mut self.motion].into_iter().for_each(|list| kept.all(list));
    }

    fn source(&self) -> Derivatives {
        match self.way {
            Way::Central => Derivatives::Central,
            Way::Forward | Way::Broyden => Derivatives::Forward,
            Way::Analytic | Way::Frozen => Derivatives::Analytic,
        }
    }

    fn is_stale(&self, left: f64, before: f64, problem: &InterfaceProblem) -> bool {
        let Some((n, epoch, h)) = self.of else { return true };
        let same = n == problem.n() && (h == 0.0) == (problem.at.h == 0.0);
        match self.way {
            Way::Analytic => true,
            Way::Frozen => !same,
            Way::Central | Way::Forward if before.is_nan() => true,
            Way::Broyden | Way::Central | Way::Forward => {
                !same || epoch != problem.at.epoch || h != problem.at.h || left > RATIO * before
            }
        }
    }

    /// The kept one; brought up to date by the last two trials where they belong to one step.
    fn put_back(&mut self, before: f64, problem: &mut InterfaceProblem) {
        let n = problem.n();
        if self.way == Way::Frozen {
            // G grows with h² at position level: what is frozen is the mechanism's position
            let of = self.of.map_or(problem.at.h, |of| of.2);
            let scale = if of > 0.0 { problem.at.h / of } else { 1.0 };
            self.g.iter_mut().for_each(|g| *g *= scale * scale);
        } else if !before.is_nan() {
            self.change.clear();
            self.change.extend(problem.t.iter().zip(&self.t).map(|(new, old)| new - old));
            let size: f64 = self.change.iter().map(|d| d * d).sum();
            for row in 0..n {
                let predicted: f64 = (0..n).map(|c| self.g[c * n + row] * self.change[c]).sum();
                let missing = problem.component(row).bodies_part() - self.motion[row] - predicted;
                for c in (0..n).filter(|_| size > 0.0) {
                    self.g[c * n + row] += missing * self.change[c] / size;
                }
            }
        }
        problem.estimate.g.copy_from_slice(&self.g);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A kept Jacobian of no component, so that only the ratio of the residuals decides.
    fn kept(jacobian: JacobianChoice, problem: &InterfaceProblem) -> Refresh {
        let of = Some((0, problem.at.epoch, problem.at.h));
        Refresh { of, ..Refresh::new(jacobian) }
    }

    #[test]
    fn it_is_taken_again_when_more_than_three_tenths_are_left() {
        let problem = InterfaceProblem::new(&[], &[], 1.0);
        for way in [JacobianChoice::Directional, JacobianChoice::FiniteDifferences, JacobianChoice::Broyden] {
            let refresh = kept(way, &problem);
            assert!(refresh.is_stale(0.31, 1.0, &problem), "{way}");
            assert!(!refresh.is_stale(0.29, 1.0, &problem), "{way}");
        }
        assert!(kept(JacobianChoice::Analytic, &problem).is_stale(1e-9, 1.0, &problem));
        assert!(!kept(JacobianChoice::Frozen, &problem).is_stale(2.0, 1.0, &problem));
        // differences start each step afresh, Broyden's update goes on
        assert!(kept(JacobianChoice::FiniteDifferences, &problem).is_stale(1.0, f64::NAN, &problem));
        assert!(!kept(JacobianChoice::Broyden, &problem).is_stale(1.0, f64::NAN, &problem));
    }

    #[test]
    fn a_snapshot_holds_the_kept_jacobian() {
        let problem = InterfaceProblem::new(&[], &[], 1.0);
        let mut refresh = kept(JacobianChoice::Broyden, &problem);
        (refresh.g, refresh.t, refresh.motion) = (vec![1.0], vec![2.0], vec![3.0]);
        let mut words = Vec::new();
        refresh.remember(&mut words);
        let mut other = Refresh::new(JacobianChoice::Broyden);
        other.recall(&mut Recall(&words));
        assert_eq!(
            (other.of, other.g, other.t, other.motion),
            (refresh.of, refresh.g, refresh.t, refresh.motion)
        );
    }
}
