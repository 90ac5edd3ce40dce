//! Anderson acceleration of the corrections of a step of second order.
//!
//! Corrections with a factor that stands are x ← x + f(x). Next to a singular pose the rows of the factor and those
//! of the end of the step differ so much that they diverge along the few directions that become singular there: the
//! midpoint rule pushes along mean rows, which turn their sign while bodies pass a pose in line. Taking out these
//! directions as the last corrections show them, x ← x + f − (ΔX + ΔF)·γ with γ = argmin |f − ΔF·γ| (Anderson 1965; for
//! linear problems this is GMRES, Walker and Ni 2011), brings them back without a derivative.

use terraglue_numerics::in_place::{cholesky, cholesky_solve};

/// Corrections that are remembered.
const MEMORY: usize = 6;
/// Added to the diagonal of the normal equations, as a share of it.
const REGULARISATION: f64 = 1e-14;

/// History of the last corrections.
pub(crate) struct Anderson {
    /// Unknowns by which corrections are compared: the rates.
    rates: usize,
    last_x: Vec<f64>,
    last_f: Vec<f64>,
    /// Differences of x and f between rounds, a ring.
    dx: Vec<Vec<f64>>,
    df: Vec<Vec<f64>>,
    matrix: Vec<f64>,
    gamma: Vec<f64>,
}

impl Anderson {
    /// For n unknowns, the first `rates` of which count.
    pub fn new(n: usize, rates: usize) -> Self {
        let ring = || vec![vec![0.0; n]; MEMORY];
        Self {
            rates,
            last_x: vec![0.0; n],
            last_f: vec![0.0; n],
            dx: ring(),
            df: ring(),
            matrix: Vec::with_capacity(MEMORY * MEMORY),
            gamma: Vec::with_capacity(MEMORY),
        }
    }

    /// Changes the correction f of the round at x; rounds are counted from 0.
    pub fn mix(&mut self, round: usize, x: &[f64], f: &mut [f64]) {
        if round > 0 {
            let at = (round - 1) % MEMORY;
            let difference = |to: &mut [f64], now: &[f64], last: &[f64]| {
                to.iter_mut().zip(now.iter().zip(last)).for_each(|(d, (now, last))| *d = now - last);
            };
            difference(&mut self.dx[at], x, &self.last_x);
            difference(&mut self.df[at], f, &self.last_f);
        }
        self.last_x.copy_from_slice(x);
        self.last_f.copy_from_slice(f);
        let m = round.min(MEMORY);
        if m == 0 || !self.fit(m) {
            return;
        }
        for (gamma, (dx, df)) in self.gamma.iter().zip(self.dx.iter().zip(&self.df)) {
            f.iter_mut().zip(dx.iter().zip(df)).for_each(|(f, (dx, df))| *f -= gamma * (dx + df));
        }
    }

    /// γ of the last m differences; false: they are degenerate.
    fn fit(&mut self, m: usize) -> bool {
        let n = self.rates;
        let dot = |a: &[f64], b: &[f64]| a[..n].iter().zip(&b[..n]).map(|(a, b)| a * b).sum::<f64>();
        self.matrix.clear();
        self.gamma.clear();
        for c in 0..m {
            let ridge = |r: usize| if r == c { 1.0 + REGULARISATION } else { 1.0 };
            self.matrix.extend((0..m).map(|r| ridge(r) * dot(&self.df[r], &self.df[c])));
            self.gamma.push(dot(&self.df[c], &self.last_f));
        }
        if !cholesky(m, &mut self.matrix) {
            return false;
        }
        cholesky_solve(m, &self.matrix, &mut self.gamma);
        self.gamma.iter().all(|g| g.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_iteration_that_diverges_in_two_directions_is_brought_back() {
        // f = A·x + b: the plain iteration multiplies the error by 1 + A.
        let (a, b) = ([-1.0, -0.9, 3.0, -5.0], [1.0, 2.0, 3.0, 4.0]);
        let mut anderson = Anderson::new(4, 4);
        let mut x = [0.0; 4];
        for round in 0..6 {
            let mut f: [f64; 4] = std::array::from_fn(|k| a[k] * x[k] + b[k]);
            anderson.mix(round, &x, &mut f);
            x.iter_mut().zip(f).for_each(|(x, f)| *x += f);
        }
        for k in 0..4 {
            assert!((x[k] + b[k] / a[k]).abs() < 1e-9, "{x:?}");
        }
    }
}
