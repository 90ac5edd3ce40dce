//! The two-parameter hold: T runs linearly from T_a at t to T_b at t + h, both free in every step.
//!
//! Rigid joints of subsystems that sub-cycle: x1 = x2 and v1 = v2 at t + h are two conditions for two wrenches, so
//! nothing drifts as at velocity level and nothing rings or grows as with one wrench per step at position level.
//! Newton with a Jacobian by forward differences, kept within the step until an iteration leaves more than 0.3.

use super::super::Outcome;
use super::super::exchange::Exchange;
use super::super::linear::{Lu, max_norm};
use super::Limits;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;

/// Buffers.
#[derive(Debug, Default)]
pub struct RampForm {
    jacobian: Vec<f64>,
    residual: Vec<f64>,
    d: Vec<f64>,
    lu: Lu,
}

impl RampForm {
    /// Iterates from `exchange.t` at both ends of the step.
    pub fn solve(
        &mut self,
        limits: &Limits,
        exchange: &mut Exchange,
        instances: &mut [Instance],
    ) -> Result<Outcome> {
        exchange.t_start.clone_from(&exchange.t);
        let (mut size, mut before) = (f64::INFINITY, f64::NAN);
        for _ in 0..=limits.max_iterations {
            exchange.advance_bodies(instances)?;
            read(exchange, &mut self.residual);
            let left = max_norm(&self.residual);
            if before.is_nan() || left > 0.3 * before {
                self.differentiate(exchange, instances)?;
            }
            before = left;
            self.d.clear();
            self.d.extend(self.residual.iter().map(|r| -r));
            self.lu.solve(&mut self.d);
            size = max_norm(&self.d);
            if size <= limits.threshold(exchange) {
                exchange.settle_bodies(instances)?;
                exchange.report.residual = size / exchange.t_ref;
                exchange.report.converged = true;
                let gap = (0..exchange.n()).map(|i| exchange.joint_gap(i)).fold(0.0, f64::max);
                exchange.report.max_gap_m = exchange.report.max_gap_m.max(gap);
                return Ok(Outcome::Converged);
            }
            let (end, start) = self.d.split_at(exchange.n());
            exchange.t.iter_mut().zip(end).for_each(|(t, d)| *t += d);
            exchange.t_start.iter_mut().zip(start).for_each(|(t, d)| *t += d);
        }
        Ok(limits.give_up(exchange, "T-T form with a two-parameter hold: |Λ·e|", size))
    }

    /// d(x1 − x2, h·(v1 − v2))/d(T_b, T_a), factored; leaves the members in other trials.
    fn differentiate(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result {
        let n = exchange.n();
        exchange.linearise_ramp(instances, &mut self.jacobian)?;
        let jacobian = &self.jacobian;
        let rank = self.lu.factor(2 * n, |r, c| jacobian[c * 2 * n + r]);
        exchange.report.rank = (rank as u32, 2 * n as u32);
        exchange.report.condition = exchange.report.condition.max(1.0 / self.lu.weakest());
        Ok(())
    }
}

/// What is open at t + h: places, and rates as the way that they would make in a step.
fn read(exchange: &Exchange, out: &mut Vec<f64>) {
    let (n, h) = (exchange.n(), exchange.at.h);
    out.clear();
    out.extend((0..n).map(|i| exchange.x1[i] - exchange.x2[i] + exchange.gap[i]));
    out.extend((0..n).map(|i| h * (exchange.v1[i] - exchange.v2[i])));
}
