//! Interface Jacobians of the members: from the modules' own derivatives, or by finite differences over their trials.

use super::exchange::Exchange;
use crate::Result;
use crate::host::Instance;
use crate::timing::Part;
use std::time::Instant as Clock;
use terraglue_subsystem::Level;

/// Where the bodies' interface Jacobian comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives {
    /// The modules' own, by differences where one has none.
    Analytic,
    /// Central differences: the directional derivative along every component.
    Central,
    /// Forward differences, all columns in one exchange.
    Forward,
}

impl Exchange {
    /// d(x1 − x2)/dT of all bodies at their last trial into `estimate.g`, from the modules' derivatives.
    pub fn linearise_bodies(&mut self, source: Derivatives, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        let level = if self.at.h == 0.0 { Level::Acceleration } else { Level::Position };
        self.estimate.g.fill(0.0);
        let mut complete = source == Derivatives::Analytic;
        for side in &mut self.bodies {
            if complete {
                let (instance, g) = (&mut instances[side.slot], &mut self.estimate.g);
                complete = side.add_compliance(instance, &self.nodes, &self.at, level, g)?;
            }
        }
        if !complete {
            self.difference_trials(source == Derivatives::Central, instances)?;
        } else {
            if self.at.h > 0.0 && self.damping.iter().any(|d| *d > 0.0) {
                self.add_dampers(instances)?;
            }
            if (0..self.n()).any(|i| self.is_above_position(i)) {
                self.raise_levels(instances)?;
            }
        }
        for i in (0..self.n()).filter(|i| self.at.h == 0.0 && self.compliance[*i] > 0.0) {
            // a spring's force at t is given by positions and velocities alone
            let n = self.n();
            (0..n).for_each(|c| self.estimate.g[c * n + i] = 0.0);
        }
        self.report.jacobian_refreshes += 1;
        self.timings.charge(Part::Jacobian, start);
        Ok(())
    }

    /// Rows of constraints at velocity or acceleration level: the Jacobian of their own condition.
    fn raise_levels(&mut self, instances: &mut [Instance]) -> Result {
        let n = self.n();
        let mut rates = std::mem::take(&mut self.rates);
        for k in 0..n * n {
            if self.is_above_position(k % n) {
                self.estimate.g[k] = 0.0;
            }
        }
        for (level, weight) in self.weights().into_iter().filter(|w| w.1 != 0.0) {
            rates.clear();
            rates.resize(n * n, 0.0);
            for side in &mut self.bodies {
                let instance = &mut instances[side.slot];
                side.add_compliance(instance, &self.nodes, &self.at, level, &mut rates)?;
            }
            for (k, rate) in rates.iter().enumerate() {
                if self.is_above_position(k % n) {
                    self.estimate.g[k] += weight * rate;
                }
            }
        }
        self.rates = rates;
        Ok(())
    }

    /// What dampers of the glue add to the Jacobian: compliance·damping·d(v1 − v2)/dT.
    fn add_dampers(&mut self, instances: &mut [Instance]) -> Result {
        let n = self.n();
        let mut rates = std::mem::take(&mut self.rates);
        rates.clear();
        rates.resize(n * n, 0.0);
        for side in &mut self.bodies {
            let instance = &mut instances[side.slot];
            side.add_compliance(instance, &self.nodes, &self.at, Level::Velocity, &mut rates)?;
        }
        for row in (0..n).filter(|i| self.damping[*i] > 0.0) {
            let factor = self.compliance_now(row) * self.damping[row];
            (0..n).for_each(|c| self.estimate.g[c * n + row] += factor * rates[c * n + row]);
        }
        self.rates = rates;
        Ok(())
    }

    /// The same by differences of trials: δT = 1e-6·max(1, |T|), forward or central. The bodies' last trial is
    /// then another one: see [`Exchange::settle_bodies`].
    fn difference_trials(&mut self, central: bool, instances: &mut [Instance]) -> Result {
        let n = self.n();
        let before = self.report.evaluations_bodies;
        let mut kept = std::mem::take(&mut self.kept);
        for (kept, value) in
            kept.iter_mut().zip([&self.t, &self.x1, &self.v1, &self.a1, &self.x2, &self.v2, &self.a2])
        {
            kept.clear();
            kept.extend_from_slice(value);
        }
        let mut base = std::mem::take(&mut self.work);
        base.clear();
        base.extend((0..n).map(|i| self.bodies_part(i)));
        for column in 0..n {
            let delta = 1e-6 * kept[0][column].abs().max(1.0);
            if central {
                self.t[column] = kept[0][column] - delta;
                self.advance_bodies(instances)?;
                base.clear();
                base.extend((0..n).map(|i| self.bodies_part(i)));
            }
            self.t[column] = kept[0][column] + delta;
            self.advance_bodies(instances)?;
            self.t[column] = kept[0][column];
            let width = if central { 2.0 * delta } else { delta };
            for (row, base) in base.iter().enumerate() {
                self.estimate.g[column * n + row] = (self.bodies_part(row) - base) / width;
            }
        }
        self.work = base;
        self.report.evaluations_jacobian += self.report.evaluations_bodies - before;
        self.report.evaluations_bodies = before;
        for (value, kept) in
            [&mut self.t, &mut self.x1, &mut self.v1, &mut self.a1, &mut self.x2, &mut self.v2, &mut self.a2]
                .into_iter()
                .zip(&kept)
        {
            value.copy_from_slice(kept);
        }
        for (base, kept) in self.base.iter_mut().zip(&kept) {
            base.copy_from_slice(kept);
        }
        self.kept = kept;
        self.displaced = true;
        Ok(())
    }

    /// The grounds' Jacobian at their last trial into `out` (n × n, column-major); by finite differences where
    /// a module has none.
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
                    self.difference_motion(instances, out)?
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

    /// K = −dF/dX1 by forward differences of 1 nm towards the soil, one component of all ports at a time.
    fn difference_motion(&mut self, instances: &mut [Instance], out: &mut [f64]) -> Result {
        let n = self.n();
        let delta = -1e-9;
        self.zeros.copy_from_slice(&self.f);
        for column in 0..n {
            self.x1[column] += delta;
            self.advance_grounds_under_motion(instances)?;
            self.x1[column] -= delta;
            self.count_difference();
            for row in 0..n {
                out[column * n + row] = -(self.f[row] - self.zeros[row]) / delta;
            }
        }
        self.f.copy_from_slice(&self.zeros);
        self.zeros.fill(0.0);
        Ok(())
    }

    /// The mixed Jacobian after force: normal columns by ΔT, the others by ΔX.
    fn difference_force(&mut self, instances: &mut [Instance], out: &mut [f64]) -> Result {
        let n = self.n();
        let mut kept_before = std::mem::take(&mut self.kept);
        let [f, x2, ..] = &mut kept_before;
        f.clone_from(&self.f);
        x2.clone_from(&self.x2);
        for p in 0..self.ports.len() {
            for (column, c) in self.ports[p].components() {
                let delta = if c == 0 { 1e-6 * self.t[column].abs().max(1.0) } else { -1e-9 };
                let target = if c == 0 { &mut self.t[column] } else { &mut self.x1[column] };
                let kept = *target;
                *target += delta;
                self.advance_grounds_under_force(instances)?;
                if c == 0 {
                    self.t[column] = kept
                } else {
                    self.x1[column] = kept
                }
                self.count_difference();
                for (row, r) in self.ports[p].components() {
                    out[column * n + row] = match (r, c) {
                        (0, 0) => -(self.x2[row] - x2[row]) / delta,
                        (0, _) => 0.0,
                        (_, 0) => (self.f[row] - f[row]) / delta,
                        _ => -(self.f[row] - f[row]) / delta,
                    };
                }
            }
        }
        self.f.copy_from_slice(f);
        self.x2.copy_from_slice(x2);
        self.kept = kept_before;
        Ok(())
    }

    fn count_difference(&mut self) {
        self.report.evaluations_soil -= 1;
        self.report.evaluations_jacobian += 1;
    }
}
