//! Motion in on both sides: r(X) = F1(X) − F2(X) = 0, Newton with J = K1 + K2, for rigid joints.
//!
//! F1(X) is the wrench on side 1 that makes it move by X, −F2 that on side 2. The unknown is the common motion, so
//! there is no gap at all; what is left when the iteration stops is a difference of the forces. Dual to T-T: best
//! where both sides are soft, and refused where a side can only take forces.

use super::exchange::Exchange;
use super::iterative::Limits;
use super::linear::Lu;
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::GluingSpec;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::XxNewton.name();

/// The strategy with its buffers.
#[derive(Debug)]
pub struct XxNewton {
    limits: Limits,
    k1: Vec<f64>,
    k2: Vec<f64>,
    d: Vec<f64>,
    lu: Lu,
}

impl XxNewton {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        let limits = Limits::read(spec);
        Self { limits, k1: Vec::new(), k2: Vec::new(), d: Vec::new(), lu: Lu::default() }
    }
}

impl Strategy for XxNewton {
    fn name(&self) -> &'static str {
        NAME
    }

    fn needs(&self) -> Needs {
        let both = Capabilities::MOTION | Capabilities::DERIVATIVES | Capabilities::RETRY;
        Needs { first: both, second: both, grounds: both }
    }

    fn refuses(&self, exchange: &Exchange) -> Option<String> {
        super::second_refused(NAME, exchange).or_else(|| super::contacts_refused(NAME, exchange))
    }

    fn solve(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<Outcome> {
        let n = exchange.n();
        exchange.start_at_constant_velocity();
        let mut size = f64::INFINITY;
        for _ in 0..=self.limits.max_iterations {
            exchange.advance_first_under_motion(instances)?;
            exchange.advance_second_under_motion(instances)?;
            size = exchange.force_residual(&mut self.d, size);
            if size <= self.limits.threshold(exchange) {
                exchange.report.converged = true;
                return Ok(Outcome::Converged);
            }
            if !size.is_finite() || !exchange.first_stiffness(instances, &mut self.k1)? {
                break;
            }
            exchange.second_stiffness(instances, &mut self.k2)?;
            let (k1, k2) = (&self.k1, &self.k2);
            let rank = self.lu.factor(n, |r, c| k1[c * n + r] + k2[c * n + r]);
            exchange.report.rank = (rank as u32, n as u32);
            exchange.report.condition = exchange.report.condition.max(1.0 / self.lu.weakest());
            exchange.report.jacobian_refreshes += 1;
            self.lu.solve(&mut self.d);
            exchange.x1.iter_mut().zip(&self.d).for_each(|(x, d)| *x += d);
        }
        Ok(self.limits.give_up(exchange, "X-X Newton: |F1 - F2|", size))
    }
}
