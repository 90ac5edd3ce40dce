//! Trials of one side at a time: what strategies need that treat the two sides of a glue unlike.
//!
//! Side 2 of a group are its soils and the bodies that are side 2 of all their glue; all other bodies are side 1.

use super::derivatives::Derivatives;
use super::glue::ConstraintKind;
use super::interface_problem::InterfaceProblem;
use super::participant::Answer;
use crate::timing::Part;
use std::time::Instant as Clock;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_numerics::dense::max_norm;
use terraglue_subsystem::Level;

impl InterfaceProblem {
    /// Forces known at t without any trial: T = −(x1 − x2)/compliance of springs, the soil's own force at contacts.
    pub fn explicit_forces(&mut self) {
        let mut t = std::mem::take(&mut self.t);
        self.law_forces(&mut t);
        self.t = t;
    }

    /// The forces of all laws at t into `out`: of soils at contacts, of springs at joints; zero at constraints.
    pub fn law_forces(&mut self, out: &mut Vec<f64>) {
        self.read_velocities();
        let n = self.conditions.kinds.len();
        out.clear();
        let c = &self.conditions;
        out.extend((0..n).map(|i| match c.kinds[i] {
            ConstraintKind::Joint if c.compliance[i] == 0.0 => 0.0,
            ConstraintKind::Joint => {
                -c.gap[i] / c.compliance[i] - c.damping[i] * (self.first.v[i] - self.second.v[i])
            }
            _ => self.law.at_start[i],
        }));
    }

    /// V1 and V2 of t, as `set_ports` answered them.
    fn read_velocities(&mut self) {
        for side in &self.bodies {
            side.motion_by_side(self.first.parts(), self.second.parts());
        }
    }

    /// The springs' force where side 2 has moved and side 1 has not.
    pub fn spring_forces(&mut self) {
        for i in (0..self.n()).filter(|i| self.conditions.kinds[*i] == ConstraintKind::Joint) {
            let c = &self.conditions;
            let damper = c.damping[i] * (self.first.v[i] - self.second.v[i]);
            self.t[i] = (self.second.x[i] - c.gap[i]) / c.compliance[i] - damper;
        }
    }

    /// x_free and G1 as the bodies are under the present T: x1 − G1·T.
    ///
    /// # Errors
    /// A member that fails, or ends a trial early.
    pub fn estimate_again(&mut self, instances: &mut [Instance]) -> Result {
        self.linearise_bodies(Derivatives::Analytic, instances)?;
        let estimate = &mut self.estimate;
        estimate.x_free.copy_from_slice(&self.first.x);
        for (column, t) in estimate.g.chunks_exact(self.t.len().max(1)).zip(&self.t) {
            estimate.x_free.iter_mut().zip(column).for_each(|(x, g)| *x -= g * t);
        }
        Ok(())
    }

    /// X1 and V1 for the present T by the estimate, x_free + G1·T, at mean velocities.
    pub fn predict_from_estimate(&mut self) {
        let rate = if self.at.h > 0.0 { 1.0 / self.at.h } else { 0.0 };
        let [t, x, v] = &mut self.base;
        t.clear();
        t.resize(self.t.len(), 0.0);
        x.clone_from(&self.estimate.x_free);
        v.clear();
        v.extend(self.estimate.x_free.iter().map(|x| rate * x));
        self.predict_bodies();
    }

    /// A trial of side 1, or of the bodies on side 2, under T.
    ///
    /// # Errors
    /// A member that fails, or ends a trial early.
    pub fn advance_half(&mut self, second: bool, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        self.at.trial += 1;
        for side in self.bodies.iter_mut().filter(|s| s.is_second() == second) {
            let instance = &mut instances[side.slot];
            side.advance_under_force(instance, &self.nodes, &self.at, &self.t, None, Answer::default())?;
            side.motion_by_side(self.first.parts(), self.second.parts());
        }
        if second {
            self.report.evaluations_soil += 1;
        } else {
            self.report.evaluations_bodies += 1;
        }
        self.timings.charge(Part::Bodies, start);
        Ok(())
    }

    /// A trial of all of side 2 under the motion X1: the wrench that it takes goes to `f`.
    ///
    /// # Errors
    /// A member that fails, or ends a trial early.
    pub fn advance_second_under_motion(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        // side 2 of a joint counts its motion from its own point
        self.work.clear();
        self.work.extend(self.first.x.iter().zip(&self.conditions.gap).map(|(x, gap)| x + gap));
        let partner = (self.work.as_slice(), self.first.v.as_slice());
        for side in self.bodies.iter_mut().filter(|s| s.is_second()).chain(&mut self.grounds) {
            let out = Answer { t: Some(&mut self.law.last), ..Answer::default() };
            side.advance_under_motion(&mut instances[side.slot], &self.nodes, &self.at, partner, out)?;
        }
        self.second.x.copy_from_slice(&self.work);
        self.report.evaluations_soil += 1;
        self.timings.charge(Part::Grounds, start);
        Ok(())
    }

    /// Residual of the wrenches of the last trials, F − T, into `miss`; returns its largest component, N and N m. The
    /// report takes its ratio to the one `before` and its part of T_ref.
    pub fn force_residual(&mut self, miss: &mut Vec<f64>, before: f64) -> f64 {
        miss.clear();
        miss.extend(self.law.last.iter().zip(&self.t).map(|(f, t)| f - t));
        let size = max_norm(miss);
        self.report.contraction = size / before;
        self.report.residual = size / self.t_ref;
        size
    }

    /// G1 = dX1/dT of side 1 at its last trial into `estimate.g`, by forward differences where a module has none.
    ///
    /// # Errors
    /// A member that fails, or ends a trial early.
    pub fn linearise_first(&mut self, instances: &mut [Instance]) -> Result {
        self.take_differences(Derivatives::Analytic, |side| !side.is_second(), instances)?;
        self.estimate.g.fill(0.0);
        for side in self.bodies.iter_mut().filter(|s| !s.is_second()) {
            let (instance, g) = (&mut instances[side.slot], &mut self.estimate.g);
            side.add_compliance(instance, &self.nodes, &self.at, Level::Position, g)?;
        }
        self.report.jacobian_refreshes += 1;
        Ok(())
    }

    /// K = dF/dX of side 2 after a trial under motion, n × n, column-major, signed so that it grows with the force
    /// that resists: dT/dX1 = −K. By forward differences where a module has none.
    ///
    /// # Errors
    /// A member that fails, or ends a trial early.
    pub fn second_stiffness(&mut self, instances: &mut [Instance], out: &mut Vec<f64>) -> Result {
        let n = self.n();
        out.clear();
        out.resize(n * n, 0.0);
        let mut complete = true;
        for side in self.bodies.iter_mut().filter(|s| s.is_second()).chain(&mut self.grounds) {
            if complete {
                complete = side.jacobian(&mut instances[side.slot], &self.nodes, &self.at, out)?;
            }
        }
        if !complete {
            out.fill(0.0);
            self.difference_motion(true, instances, out)?;
        }
        self.report.jacobian_refreshes += 1;
        Ok(())
    }
}
