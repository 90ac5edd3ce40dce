//! The X-T fixed point T ← F(X1(T)), relaxed: for black boxes without derivatives.
//!
//! Side 1 steps under T, side 2 follows its motion and answers F; r = F − T. `gluing.relaxation`:
//! - `none`: T ← T + r; contracts by κ = K·G1 and diverges for κ > 1;
//! - `aitken`: T ← T + ω·r with Aitken's dynamic ω (Irons and Tuck 1969; Küttler and Wall 2008);
//! - `anderson`: the combination of the last six iterates that leaves the least residual (Anderson 1965), by a QR
//!   factorisation that drops columns which say nothing new (Haelterman et al. 2016);
//! - `broyden`: Broyden's good rank-one update of the inverse Jacobian (Broyden 1965).

use super::interface_problem::InterfaceProblem;
use super::iterative::Limits;
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_scenario::{GluingSpec, Relaxation};
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::Relaxed.name();

/// First relaxation factor.
const OMEGA: f64 = 0.1;
/// Iterates that Anderson's combination remembers.
const DEPTH: usize = 6;
/// A column whose part orthogonal to the newer ones is smaller than this share of it is dropped.
const FILTER: f64 = 1e-4;
/// The residual may grow by this factor before the iteration is given up.
const GROWTH: f64 = 1e6;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    None,
    Aitken,
    Anderson,
    Broyden,
}

/// The strategy with its buffers.
#[derive(Debug)]
pub struct Relaxed {
    kind: Kind,
    limits: Limits,
    r: Vec<f64>,
    step: Vec<f64>,
    /// Residual and T of the iteration before.
    r_old: Vec<f64>,
    t_old: Vec<f64>,
    omega: f64,
    /// Differences of residuals and of F, newest first, column by column.
    dr: Vec<f64>,
    df: Vec<f64>,
    q: Vec<f64>,
    upper: Vec<f64>,
    gamma: Vec<f64>,
    /// Inverse Jacobian, row-major.
    inverse: Vec<f64>,
}

impl Relaxed {
    /// From the scenario's `[gluing]`.
    pub fn new(spec: &GluingSpec) -> Self {
        let kind = match spec.relaxation {
            Relaxation::None => Kind::None,
            Relaxation::Aitken => Kind::Aitken,
            Relaxation::Broyden => Kind::Broyden,
            Relaxation::Anderson => Kind::Anderson,
        };
        Self {
            kind,
            limits: Limits::read(spec),
            r: Vec::new(),
            step: Vec::new(),
            r_old: Vec::new(),
            t_old: Vec::new(),
            omega: OMEGA,
            dr: Vec::new(),
            df: Vec::new(),
            q: Vec::new(),
            upper: Vec::new(),
            gamma: Vec::new(),
            inverse: Vec::new(),
        }
    }

    /// The change of T into `step`.
    fn accelerate(&mut self, first: bool, t: &[f64]) {
        self.step.clear();
        match self.kind {
            Kind::None => self.step.extend_from_slice(&self.r),
            Kind::Aitken => {
                self.omega = if first { OMEGA } else { self.aitken() };
                self.step.extend(self.r.iter().map(|r| self.omega * r));
            }
            Kind::Anderson => self.anderson(first),
            Kind::Broyden => self.broyden(first, t),
        }
        self.r_old.clone_from(&self.r);
        self.t_old.clear();
        self.t_old.extend_from_slice(t);
    }

    fn aitken(&self) -> f64 {
        let (mut top, mut bottom) = (0.0, 0.0);
        for (new, old) in self.r.iter().zip(&self.r_old) {
            top += old * (new - old);
            bottom += (new - old) * (new - old);
        }
        if bottom > 0.0 { -self.omega * top / bottom } else { OMEGA }
    }

    /// Needs `r_old` and, as `step` of the call before, F − F_old = r − r_old + step.
    fn anderson(&mut self, first: bool) {
        let n = self.r.len();
        if first {
            self.dr.clear();
            self.df.clear();
            self.step.extend(self.r.iter().map(|r| OMEGA * r));
            self.gamma.clone_from(&self.step);
            return;
        }
        // the newest column goes in front
        let keep = self.dr.len().min((DEPTH - 1) * n);
        self.dr.truncate(keep);
        self.df.truncate(keep);
        self.dr.resize(keep + n, 0.0);
        self.df.resize(keep + n, 0.0);
        self.dr.copy_within(0..keep, n);
        self.df.copy_within(0..keep, n);
        for i in 0..n {
            self.dr[i] = self.r[i] - self.r_old[i];
            self.df[i] = self.dr[i] + self.gamma[i]; // gamma keeps the last step between calls
        }
        self.orthogonalise(n);
        let columns = self.dr.len() / n.max(1);
        // γ from R·γ = Qᵀ·r, then T + r − ΔF·γ
        let mut weights = [0.0; DEPTH];
        for c in (0..columns).rev() {
            let q = &self.q[c * n..][..n];
            let mut sum: f64 = q.iter().zip(&self.r).map(|(q, r)| q * r).sum();
            for later in c + 1..columns {
                sum -= self.upper[later * DEPTH + c] * weights[later];
            }
            weights[c] = sum / self.upper[c * DEPTH + c];
        }
        self.step.extend_from_slice(&self.r);
        for (column, weight) in self.df.chunks_exact(n.max(1)).zip(weights) {
            for (step, df) in self.step.iter_mut().zip(column) {
                *step -= weight * df;
            }
        }
        self.gamma.clone_from(&self.step);
    }

    /// Modified Gram–Schmidt over the columns of ΔR, newest first; columns that say nothing new are dropped.
    fn orthogonalise(&mut self, n: usize) {
        self.q.clear();
        self.upper.clear();
        self.upper.resize(DEPTH * DEPTH, 0.0);
        let mut c = 0;
        while c * n < self.dr.len() {
            let mut v = std::mem::take(&mut self.step);
            v.clear();
            v.extend_from_slice(&self.dr[c * n..][..n]);
            let size = norm(&v);
            for k in 0..c {
                let q = &self.q[k * n..][..n];
                let along: f64 = q.iter().zip(&v).map(|(q, v)| q * v).sum();
                self.upper[c * DEPTH + k] = along;
                v.iter_mut().zip(q).for_each(|(v, q)| *v -= along * q);
            }
            let left = norm(&v);
            if left > FILTER * size && c < n {
                self.upper[c * DEPTH + c] = left;
                self.q.extend(v.iter().map(|v| v / left));
                c += 1;
            } else {
                self.dr.drain(c * n..(c + 1) * n);
                self.df.drain(c * n..(c + 1) * n);
            }
            v.clear();
            self.step = v;
        }
    }

    fn broyden(&mut self, first: bool, t: &[f64]) {
        let n = self.r.len();
        if first {
            self.inverse.clear();
            self.inverse.resize(n * n, 0.0);
            (0..n).for_each(|i| self.inverse[i * n + i] = OMEGA);
        } else {
            self.update_inverse(t, n);
        }
        for row in self.inverse.chunks_exact(n.max(1)) {
            self.step.push(row.iter().zip(&self.r).map(|(h, r)| h * r).sum());
        }
    }

    /// H ← H + (s − H·y)·sᵀH/(sᵀ·H·y) with s = T − T_old and y = −(r − r_old) (Broyden 1965, method 1).
    fn update_inverse(&mut self, t: &[f64], n: usize) {
        let s = |i: usize| t[i] - self.t_old[i];
        let y = |i: usize| self.r_old[i] - self.r[i];
        let h = &self.inverse;
        self.gamma.clear();
        self.gamma.extend((0..n).map(|row| (0..n).map(|c| h[row * n + c] * y(c)).sum::<f64>()));
        let bottom: f64 = (0..n).map(|i| s(i) * self.gamma[i]).sum();
        if bottom == 0.0 {
            return;
        }
        self.q.clear();
        self.q.extend((0..n).map(|c| (0..n).map(|row| s(row) * h[row * n + c]).sum::<f64>() / bottom));
        for row in 0..n {
            let missing = t[row] - self.t_old[row] - self.gamma[row];
            for c in 0..n {
                self.inverse[row * n + c] += missing * self.q[c];
            }
        }
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl Strategy for Relaxed {
    fn name(&self) -> &'static str {
        NAME
    }

    fn needs(&self) -> Needs {
        let motion = Capabilities::MOTION | Capabilities::RETRY;
        Needs { first: Capabilities::FORCE | Capabilities::RETRY, second: motion, grounds: motion }
    }

    fn refuses(&self, problem: &InterfaceProblem) -> Option<String> {
        super::second_refused(NAME, problem)
    }

    fn solve(&mut self, problem: &mut InterfaceProblem, instances: &mut [Instance]) -> Result<Outcome> {
        problem.start_from_last();
        problem.report.xt_form = true;
        let (mut size, mut at_start) = (f64::INFINITY, f64::INFINITY);
        for iteration in 0..self.limits.max_iterations {
            problem.advance_half(false, instances)?;
            problem.advance_second_under_motion(instances)?;
            size = problem.force_residual(&mut self.r, size);
            if iteration == 0 {
                at_start = size;
            }
            if size <= self.limits.threshold(problem) {
                problem.report.converged = true;
                return Ok(Outcome::Converged);
            }
            if !(size <= GROWTH * at_start) {
                return Ok(Outcome::NotConverged(format!(
                    "X-T fixed point ({:?}): diverged, |F - T| grew from {at_start:.3e} N to {size:.3e} N in {iteration} iterations",
                    self.kind
                )));
            }
            self.accelerate(iteration == 0, &problem.t);
            problem.t.iter_mut().zip(&self.step).for_each(|(t, d)| *t += d);
        }
        Ok(Outcome::NotConverged(format!(
            "X-T fixed point ({:?}): not converged within {} iterations, |F - T| = {size:.3e} N, last contraction {:.4}",
            self.kind, self.limits.max_iterations, problem.report.contraction
        )))
    }
}
