//! Positions of bodies at the end of a step of first order, and closing the joints there on the level of positions.

use super::{Dynamics, Failure};
use crate::dynamics::joint_rows::gap;

/// Joints are closed to this at the end of every step, m and rad.
const GAP_TOLERANCE: f64 = 1e-11;
/// Above this a step is refused, m and rad; below, a gap that does not shrink is rounding.
const GAP_REFUSED: f64 = 1e3 * GAP_TOLERANCE;
/// Most corrections per solve. Two or three are usual; each leaves about a share of the angle by which bodies turn in
/// the step, times the square root of their mass ratio, and after an impact that is not small.
const MAX_CORRECTIONS: usize = 60;
/// Corrections go on plainly as long as one leaves less than this share of the gap before it …
const CLOSES: f64 = 0.9;
/// … and so many do not suffice; then earlier ones help (see [`super::anderson`]).
const PLAIN: usize = 8;
/// With their help the gap need not shrink every time, but once in so many.
const STEPS_WITHOUT_PROGRESS: usize = 6;

impl Dynamics {
    /// Removes the remaining gaps of the joints at the end of the step.
    pub(super) fn close_joints(&mut self) -> Result<(), Failure> {
        let (mut least, mut since, mut mixed) = (f64::INFINITY, 0, None);
        for round in 0..MAX_CORRECTIONS {
            self.trial.find_places(&self.kkt, &self.start, self.h);
            let open = self.gaps_into_correction().1;
            if open <= GAP_TOLERANCE {
                return Ok(());
            }
            let shrinks = open < CLOSES * least;
            since = if shrinks { 0 } else { since + 1 };
            // To rounding, or not at all; a NaN ends it too.
            if !shrinks && (open <= GAP_REFUSED || open.is_nan() || since > STEPS_WITHOUT_PROGRESS) {
                break;
            }
            if mixed.is_none() && (!shrinks || round >= PLAIN) {
                mixed = Some(0);
            }
            least = least.min(open);
            if self.lean {
                self.kkt.solver.substitute_rates(&mut self.correction);
            } else {
                self.kkt.solver.substitute(&mut self.correction);
            }
            if let Some(rounds) = &mut mixed {
                self.anderson.mix(*rounds, &self.trial.solution, &mut self.correction);
                *rounds += 1;
            }
            self.trial.solution.iter_mut().zip(&self.correction).for_each(|(s, c)| *s += c);
            if mixed.is_none() && self.surely_closes() {
                self.trial.find_places(&self.kkt, &self.start, self.h);
                return Ok(());
            }
        }
        self.trial.find_places(&self.kkt, &self.start, self.h);
        self.check_gaps()
    }

    /// Whether the gaps that the correction leaves are surely below the tolerance, so that it need not be measured: rows
    /// are those of the start, which bodies turn by θ in the step, and the correction itself turns them a little more.
    /// Where it moves bodies by up to m along each axis (m, rad), joints are left open by at most 2(θ + m)·2√3·m(1 + arm).
    fn surely_closes(&self) -> bool {
        let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let moved = 2.0 * self.h * largest(&self.correction[..6 * self.trial.ends.len()]);
        let turned = self.trial.turns.iter().fold(0.0_f64, |m, t| m.max(t.norm_squared())).sqrt();
        // A NaN is never sure.
        !self.closing.any() && 4.0 * (turned + moved) * moved * (1.0 + self.longest_arm) <= GAP_TOLERANCE
    }

    /// Refuses a step that leaves a joint or a loop open.
    pub(super) fn check_gaps(&mut self) -> Result<(), Failure> {
        match self.gaps_into_correction() {
            (_, gap) if gap <= GAP_REFUSED => Ok(()),
            (part, gap) => {
                let joint = self.model.joints.get(part).map(|j| &j.name);
                let closure = || self.model.closures.get(part - self.model.joints.len()).map(|c| &c.name);
                let name = joint.or_else(closure).cloned().unwrap_or_default();
                Err(Failure::Gap { joint: name, gap })
            }
        }
    }

    /// Right-hand side of a correction; the worst joint (connections beyond the tree after the joints) and its gap.
    pub(super) fn gaps_into_correction(&mut self) -> (usize, f64) {
        let mut worst = (0, 0.0);
        self.correction.fill(0.0);
        let per_step = 1.0 / self.h;
        for (j, joint) in self.model.joints.iter().enumerate().filter(|(j, _)| !self.branches.broken[*j]) {
            let row = &mut self.correction[self.kkt.joint_at[j]..][..6];
            for (row, open) in row.iter_mut().zip(gap(joint, &self.trial.ends)) {
                *row = -open * per_step;
                // A NaN is the worst and stays it.
                if open.abs() > worst.1 || open.is_nan() {
                    worst = (j, open.abs());
                }
            }
        }
        let (closure, open) = self.closing.open_into(
            &self.model,
            &self.start,
            &self.trial.ends,
            &self.kkt,
            self.h,
            &mut self.correction,
        );
        if open > worst.1 || open.is_nan() {
            worst = (self.model.joints.len() + closure, open);
        }
        worst
    }

    /// Rates of a body at the end of the step, after its position.
    pub fn find_rates(&mut self, b: usize) {
        self.trial.find_rates(b, &self.model.bodies[b], &self.kkt, &self.start);
    }
}
