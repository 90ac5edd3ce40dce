//! Interface Jacobians of the members: from the modules' own derivatives, or by finite differences over their trials.

use super::interface_problem::InterfaceProblem;
use super::participant::Participant;
use crate::timing::Part;
use std::time::Instant as Clock;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::{Capabilities, Level, Port};

/// Source of the bodies' interface Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives {
    /// The modules' own, by forward differences where one has none.
    Analytic,
    /// Directional derivatives of FMUs that have them; else central differences along every component.
    Central,
    /// Forward differences, all columns in one exchange.
    Forward,
}

impl InterfaceProblem {
    /// d(x1 − x2)/dT of all bodies at their last trial into `estimate.g`.
    ///
    /// # Errors
    /// A member that fails, or ends a trial early.
    pub fn linearise_bodies(&mut self, source: Derivatives, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        let level = if self.at.h == 0.0 { Level::Acceleration } else { Level::Position };
        self.take_differences(source, |_| true, instances)?;
        self.estimate.g.fill(0.0);
        for side in &mut self.bodies {
            let (instance, g) = (&mut instances[side.slot], &mut self.estimate.g);
            side.add_compliance(instance, &self.nodes, &self.at, level, g)?;
        }
        if self.at.h > 0.0 && self.conditions.damping.iter().any(|d| *d > 0.0) {
            self.add_dampers(instances)?;
        }
        if (0..self.n()).any(|i| self.conditions.is_above_position(i, self.at.h)) {
            self.raise_levels(instances)?;
        }
        for i in (0..self.n()).filter(|i| self.at.h == 0.0 && self.conditions.compliance[*i] > 0.0) {
            // a spring's force at t is given by positions and velocities alone
            let n = self.n();
            (0..n).for_each(|c| self.estimate.g[c * n + i] = 0.0);
        }
        self.report.jacobian_refreshes += 1;
        self.timings.charge(Part::Jacobian, start);
        Ok(())
    }

    /// Differences for the members that do not know their derivatives, or for all where `source` says so. Members hang
    /// together in the wrenches only, so each makes its own trials, all columns in one exchange, and all of them do it side
    /// by side: that counts as many evaluations as the member with the most components needs. Their last trial is then
    /// another one: see [`InterfaceProblem::repeat_bodies_trial`].
    pub(super) fn take_differences(
        &mut self,
        source: Derivatives,
        who: impl Fn(&Participant) -> bool,
        instances: &mut [Instance],
    ) -> Result {
        let mut most = 0;
        for side in self.bodies.iter_mut().filter(|s| who(s)) {
            let instance = &mut instances[side.slot];
            side.forget_differences();
            let knows = instance.capabilities().has(Capabilities::DERIVATIVES);
            let told = match source {
                Derivatives::Analytic => knows,
                Derivatives::Central => knows && terraglue_scenario::ModuleKind::is_fmu(instance.module()),
                Derivatives::Forward => false,
            };
            if told {
                continue;
            }
            let how = (source == Derivatives::Central, 1.0);
            most = most.max(side.take_differences(instance, &self.nodes, &self.at, &self.t, how)?);
            self.differences.displaced |= side.n() > 0;
        }
        self.at.trial += most;
        self.report.evaluations_jacobian += most;
        Ok(())
    }

    /// Rows of constraints at velocity or acceleration level: the Jacobian of their own condition.
    fn raise_levels(&mut self, instances: &mut [Instance]) -> Result {
        let n = self.n();
        let mut rates = std::mem::take(&mut self.differences.rates);
        for k in 0..n * n {
            if self.conditions.is_above_position(k % n, self.at.h) {
                self.estimate.g[k] = 0.0;
            }
        }
        for (level, weight) in self.conditions.weights(self.at.h).into_iter().filter(|w| w.1 != 0.0) {
            rates.clear();
            rates.resize(n * n, 0.0);
            for side in &mut self.bodies {
                let instance = &mut instances[side.slot];
                side.add_compliance(instance, &self.nodes, &self.at, level, &mut rates)?;
            }
            for (k, rate) in rates.iter().enumerate() {
                if self.conditions.is_above_position(k % n, self.at.h) {
                    self.estimate.g[k] += weight * rate;
                }
            }
        }
        self.differences.rates = rates;
        Ok(())
    }

    /// Contribution of dampers of the glue to the Jacobian: compliance·damping·d(v1 − v2)/dT.
    fn add_dampers(&mut self, instances: &mut [Instance]) -> Result {
        let n = self.n();
        let mut rates = std::mem::take(&mut self.differences.rates);
        rates.clear();
        rates.resize(n * n, 0.0);
        for side in &mut self.bodies {
            let instance = &mut instances[side.slot];
            side.add_compliance(instance, &self.nodes, &self.at, Level::Velocity, &mut rates)?;
        }
        for row in (0..n).filter(|i| self.conditions.damping[*i] > 0.0) {
            let factor = self.conditions.compliance[row] * self.conditions.damping[row];
            (0..n).for_each(|c| self.estimate.g[c * n + row] += factor * rates[c * n + row]);
        }
        self.differences.rates = rates;
        Ok(())
    }

    /// The grounds' Jacobian at their last trial into `out` (n × n, column-major); by finite differences where
    /// a module has none.
    ///
    /// # Errors
    /// A soil that fails, or ends a trial early.
    pub fn ground_jacobian(&mut self, instances: &mut [Instance], xt: bool, out: &mut Vec<f64>) -> Result {
        let start = Clock::now();
        let n = self.n();
        out.clear();
        out.resize(n * n, 0.0);
        for k in 0..self.grounds.len() {
            let side = &mut self.grounds[k];
            let slot = side.slot;
            if !side.jacobian(&mut instances[slot], &self.nodes, &self.at, out)? {
                if xt {
                    self.difference_motion(false, instances, out)?
                } else {
                    self.difference_force(instances, out)?
                }
                break;
            }
        }
        self.report.jacobian_refreshes += u32::from(!self.grounds.is_empty());
        self.timings.charge(Part::Jacobian, start);
        Ok(())
    }

    /// K = −dF/dX1 of the grounds, or of all of side 2, by forward differences of 1 nm towards it: one trial for a component
    /// of all ports that lie apart (see [`Participant::colours`]).
    pub(super) fn difference_motion(
        &mut self,
        second: bool,
        instances: &mut [Instance],
        out: &mut [f64],
    ) -> Result {
        let delta = -1e-9;
        let mut kept = std::mem::take(&mut self.differences.kept);
        kept[0].clone_from(&self.law.last);
        kept[2].clone_from(&self.second.x);
        let driven = self.bodies.iter().filter(|s| second && s.is_second());
        let count = self.differences.colour_ports(driven, &self.grounds, &self.nodes, self.ports.len());
        let colours = std::mem::take(&mut self.differences.colours);
        for (colour, c) in (0..count).flat_map(|k| (0..6).map(move |c| (k, c))) {
            let columns = |e: &Self, p: usize| column(&e.ports[p], &colours[p], colour, c);
            if !(0..self.ports.len()).any(|p| columns(self, p).is_some()) {
                continue;
            }
            kept[1].clone_from(&self.first.x);
            for p in 0..self.ports.len() {
                if let Some(i) = columns(self, p) {
                    self.first.x[i] += delta;
                }
            }
            if second {
                self.advance_second_under_motion(instances)?;
            } else {
                self.advance_grounds_under_motion(instances)?;
            }
            self.first.x.copy_from_slice(&kept[1]);
            self.report.count_soil_difference();
            let (m, n) = (self.ports.len(), self.n());
            for (p, column) in (0..m).filter_map(|p| Some((p, columns(self, p)?))) {
                for q in (0..m).filter(|q| self.differences.meets[p * m + q]) {
                    for row in self.ports[q].range() {
                        out[column * n + row] = -(self.law.last[row] - kept[0][row]) / delta;
                    }
                }
            }
        }
        self.law.last.copy_from_slice(&kept[0]);
        self.second.x.copy_from_slice(&kept[2]);
        (self.differences.kept, self.differences.colours) = (kept, colours);
        Ok(())
    }

    /// The mixed Jacobian after force: normal columns by ΔT, the others by ΔX; one trial for a component of all ports that
    /// lie apart.
    fn difference_force(&mut self, instances: &mut [Instance], out: &mut [f64]) -> Result {
        let n = self.n();
        let mut kept = std::mem::take(&mut self.differences.kept);
        for (kept, value) in kept.iter_mut().zip([&self.law.last, &self.second.x, &self.t, &self.first.x]) {
            kept.clone_from(value);
        }
        let [f, x2, t, x1, ..] = &kept;
        let nobody = std::iter::empty();
        let count = self.differences.colour_ports(nobody, &self.grounds, &self.nodes, self.ports.len());
        let colours = std::mem::take(&mut self.differences.colours);
        for (colour, c) in (0..count).flat_map(|k| (0..6).map(move |c| (k, c))) {
            let delta = |i: usize| if c == 0 { 1e-6 * t[i].abs().max(1.0) } else { -1e-9 };
            let columns = |e: &Self, p: usize| column(&e.ports[p], &colours[p], colour, c);
            if !(0..self.ports.len()).any(|p| columns(self, p).is_some()) {
                continue;
            }
            for p in 0..self.ports.len() {
                if let Some(i) = columns(self, p) {
                    if c == 0 { self.t[i] += delta(i) } else { self.first.x[i] += delta(i) }
                }
            }
            self.advance_grounds_under_force(instances)?;
            self.t.copy_from_slice(t);
            self.first.x.copy_from_slice(x1);
            self.report.count_soil_difference();
            for (p, column) in (0..self.ports.len()).filter_map(|p| Some((p, columns(self, p)?))) {
                let delta = delta(column);
                for (row, r) in self.ports[p].components() {
                    out[column * n + row] = match (r, c) {
                        (0, 0) => -(self.second.x[row] - x2[row]) / delta,
                        (0, _) => 0.0,
                        (_, 0) => (self.law.last[row] - f[row]) / delta,
                        _ => -(self.law.last[row] - f[row]) / delta,
                    };
                }
            }
        }
        self.law.last.copy_from_slice(f);
        self.second.x.copy_from_slice(x2);
        (self.differences.kept, self.differences.colours) = (kept, colours);
        Ok(())
    }
}

/// Place of component c of a port of that colour, if it carries it.
fn column(port: &Port, own: &u32, colour: u32, c: usize) -> Option<usize> {
    port.components().find(|(_, k)| *own == colour && *k == c).map(|(i, _)| i)
}
