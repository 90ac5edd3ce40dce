//! The X-T form: the soil takes the motion of the bodies and answers the wrench of its law.
//!
//! r(T) = T − F(X1(T)), Newton with J = I + K·G1, K = −dF/dX1 of the soil at the last trial. Unilateral and
//! yielding laws are inside F, so no active set is needed. At the kink of unloading the step is halved until
//! |r| falls.
//!
//! Bodies are linear within a step but for motors that reach their limit, and dear. So the iteration runs inside
//! against X1 + G1·ΔT and asks the bodies only to confirm: two evaluations of the bodies at any κ.

use super::super::Outcome;
use super::super::exchange::Exchange;
use super::super::linear::{Lu, max_norm};
use super::{Limits, largest_eigenvalue};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;

/// Halvings of one Newton step before it is taken as it is.
const MAX_HALVINGS: u32 = 8;

/// Buffers.
#[derive(Debug, Default)]
pub struct XtForm {
    k: Vec<f64>,
    kg: Vec<f64>,
    residual: Vec<f64>,
    d: Vec<f64>,
    base: Vec<f64>,
    work: Vec<f64>,
    /// X1 by the linearisation, before the bodies confirm it.
    predicted: Vec<f64>,
    lu: Lu,
}

impl XtForm {
    /// Iterates from `exchange.t`: inside against the linearised bodies, outside against the bodies themselves.
    pub fn solve(
        &mut self,
        limits: &Limits,
        exchange: &mut Exchange,
        instances: &mut [Instance],
    ) -> Result<Outcome> {
        let mut norm = self.evaluate(exchange, instances)?;
        for _ in 0..limits.max_iterations {
            if norm <= limits.threshold(exchange) {
                return Ok(self.converged(exchange, norm));
            }
            let inner = self.solve_linearised(limits, norm, exchange, instances)?;
            norm = self.confirm(inner, limits, exchange, instances)?;
        }
        if norm <= limits.threshold(exchange) {
            return Ok(self.converged(exchange, norm));
        }
        Ok(limits.give_up(exchange, "X-T form: |T - F|", norm))
    }

    /// Iterates the soil alone against the bodies as `exchange.predict_bodies` knows them; what is left of |T − F|, N.
    pub fn solve_predicted(
        &mut self,
        limits: &Limits,
        exchange: &mut Exchange,
        instances: &mut [Instance],
    ) -> Result<f64> {
        exchange.predict_bodies();
        let mut norm = self.evaluate_grounds(exchange, instances)?;
        for _ in 0..limits.max_iterations {
            if norm <= limits.threshold(exchange) {
                break;
            }
            self.newton_step(exchange, instances)?;
            norm = self.step(norm, exchange, instances)?;
        }
        Ok(norm)
    }

    /// Figures of the last trials of both sides; `norm` is what is left, N.
    pub fn conclude(&self, norm: f64, exchange: &mut Exchange) -> Outcome {
        self.converged(exchange, norm)
    }

    /// Newton on T − F(X1(T)) = 0 with X1 linear in T: evaluations of the soil only.
    fn solve_linearised(
        &mut self,
        limits: &Limits,
        mut norm: f64,
        exchange: &mut Exchange,
        instances: &mut [Instance],
    ) -> Result<f64> {
        for _ in 0..limits.max_iterations {
            self.newton_step(exchange, instances)?;
            norm = self.step(norm, exchange, instances)?;
            if norm <= 0.1 * limits.threshold(exchange) {
                break;
            }
        }
        Ok(norm)
    }

    /// The bodies under T. The soil's last trial still counts where they moved as their linearisation said: the
    /// difference changes no force by a tenth of what is tolerated.
    fn confirm(
        &mut self,
        inner: f64,
        limits: &Limits,
        exchange: &mut Exchange,
        instances: &mut [Instance],
    ) -> Result<f64> {
        self.predicted.clone_from(&exchange.x1);
        exchange.advance_bodies(instances)?;
        let (n, allowed) = (exchange.n(), 0.1 * limits.threshold(exchange));
        let off = |c: usize| (exchange.x1[c] - self.predicted[c]).abs();
        let as_predicted =
            (0..n).all(|r| (0..n).map(|c| self.k[c * n + r].abs() * off(c)).sum::<f64>() <= allowed);
        if as_predicted { Ok(inner) } else { self.evaluate_grounds(exchange, instances) }
    }

    /// One evaluation of both sides; |r|∞.
    fn evaluate(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<f64> {
        exchange.advance_bodies(instances)?;
        self.evaluate_grounds(exchange, instances)
    }

    fn evaluate_grounds(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<f64> {
        exchange.advance_grounds_under_motion(instances)?;
        self.residual.clear();
        self.residual.extend(exchange.t.iter().zip(&exchange.f).map(|(t, f)| t - f));
        Ok(max_norm(&self.residual))
    }

    /// d = −(I + K·G1)⁻¹·r at the last trial.
    fn newton_step(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result {
        let n = exchange.n();
        exchange.ground_jacobian(instances, true, &mut self.k)?;
        let (k, g) = (&self.k, &exchange.estimate.g);
        self.kg.clear();
        self.kg.resize(n * n, 0.0);
        for column in 0..n {
            let out = &mut self.kg[column * n..][..n];
            super::super::linear::multiply_add(k, &g[column * n..][..n], out);
        }
        let kg = &self.kg;
        let rank = self.lu.factor(n, |r, c| kg[c * n + r] + if r == c { 1.0 } else { 0.0 });
        self.d.clear();
        self.d.extend(self.residual.iter().map(|r| -r));
        self.lu.solve(&mut self.d);
        let kappa = largest_eigenvalue(k, g, &mut self.base, &mut self.work, n);
        exchange.report.kappa_max = exchange.report.kappa_max.max(kappa);
        exchange.report.rank = (rank as u32, n as u32);
        exchange.report.condition = exchange.report.condition.max(1.0 / self.lu.weakest());
        Ok(())
    }

    /// Takes the Newton step, halved until the residual falls; the new |r|∞.
    fn step(&mut self, norm: f64, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<f64> {
        self.base.clear();
        self.base.extend_from_slice(&exchange.t);
        let mut share = 1.0;
        for halving in 0..=MAX_HALVINGS {
            for ((t, base), d) in exchange.t.iter_mut().zip(&self.base).zip(&self.d) {
                *t = base + share * d;
            }
            exchange.predict_bodies();
            let new = self.evaluate_grounds(exchange, instances)?;
            exchange.report.evaluations_line_search += u32::from(halving > 0);
            if new < norm || halving == MAX_HALVINGS {
                return Ok(new);
            }
            share *= 0.5;
        }
        Ok(norm)
    }

    fn converged(&self, exchange: &mut Exchange, norm: f64) -> Outcome {
        let report = &mut exchange.report;
        report.residual = norm / exchange.t_ref;
        for port in &exchange.ports {
            let r = self.residual[port.first as usize].abs();
            report.max_action_reaction_gap_n = report.max_action_reaction_gap_n.max(r);
        }
        report.converged = true;
        // motion was imposed on the soil: its surface is where the body is
        exchange.x2.copy_from_slice(&exchange.x1);
        Outcome::Converged
    }
}
