//! When the bodies' interface Jacobian is computed again, and from where.

use super::exchange::{Derivatives, Exchange};

/// The residual may shrink by this factor at least before the Jacobian counts as stale.
const RATIO: f64 = 0.3;

/// Keeps G from step to step. Derivatives of the modules cost no evaluation and are taken anew at every iteration;
/// one from differences is refreshed when the last iteration left more than 0.3 of the residual, when
/// the set of ports or h has changed, and never in the control that shows why one must.
#[derive(Debug, Default)]
pub struct Refresh {
    differences: bool,
    central: bool,
    frozen: bool,
    /// n, epoch and h of the kept one.
    of: Option<(usize, u32, f64)>,
    g: Vec<f64>,
}

impl Refresh {
    /// From `gluing.jacobian`.
    pub fn new(jacobian: &str) -> Self {
        Self {
            differences: jacobian == "finite-differences",
            central: jacobian == "directional",
            frozen: jacobian == "frozen",
            ..Self::default()
        }
    }

    /// Where a fresh one comes from.
    pub fn source(&self) -> Derivatives {
        match (self.central, self.differences) {
            (true, _) => Derivatives::Central,
            (_, true) => Derivatives::Forward,
            _ => Derivatives::Analytic,
        }
    }

    /// Whether a fresh one is needed; else puts the kept one back. `left` is the present residual, `before` that
    /// of the iteration before (NaN: this is the first).
    pub fn is_stale(&self, left: f64, before: f64, exchange: &mut Exchange) -> bool {
        let now = (exchange.n(), exchange.at.epoch, exchange.at.h);
        let same = self.of.is_some_and(|of| of == now || self.frozen && of.0 == now.0 && of.2 == now.2);
        let free = self.source() == Derivatives::Analytic;
        if !same || !self.frozen && (free || left > RATIO * before) {
            return true;
        }
        exchange.estimate.g.copy_from_slice(&self.g);
        false
    }

    /// Keeps what is in the exchange.
    pub fn keep(&mut self, exchange: &Exchange) {
        self.of = Some((exchange.n(), exchange.at.epoch, exchange.at.h));
        self.g.clone_from(&exchange.estimate.g);
    }
}
