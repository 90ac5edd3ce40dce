//! Accelerated fixed points: from a residual r(x) = f(x) − x to the next change of x, without derivatives.
//!
//! - `none`: x ← x + r; contracts where f does;
//! - `aitken`: x ← x + ω·r with Aitken's dynamic ω (Irons and Tuck 1969; Küttler and Wall 2008, eq. 44);
//! - `anderson`: the combination of the last six iterates that leaves the least residual (Anderson 1965), by a QR
//!   factorisation that drops linearly dependent columns (Haelterman et al. 2016);
//! - `broyden`: Broyden's good rank-one update of the inverse Jacobian (Broyden 1965).

use terraglue_scenario::Relaxation;

/// Iterates that Anderson's combination remembers.
const DEPTH: usize = 6;
/// A column whose part orthogonal to the newer ones is smaller than this share of it is dropped.
const FILTER: f64 = 1e-4;

/// A fixed point on its way, with its buffers.
#[derive(Debug)]
pub struct Acceleration {
    kind: Relaxation,
    /// Factor of the first residual.
    start: f64,
    /// Whether nothing is known from before.
    first: bool,
    r: Vec<f64>,
    step: Vec<f64>,
    /// Residual and x of the iteration before.
    r_old: Vec<f64>,
    x_old: Vec<f64>,
    omega: f64,
    /// Differences of residuals and of f, newest first, column by column.
    dr: Vec<f64>,
    df: Vec<f64>,
    q: Vec<f64>,
    upper: Vec<f64>,
    gamma: Vec<f64>,
    /// Inverse Jacobian, row-major.
    inverse: Vec<f64>,
}

impl Acceleration {
    /// Of some kind; `start`: what the first residual is multiplied by.
    pub fn new(kind: Relaxation, start: f64) -> Self {
        Self {
            kind,
            start,
            first: true,
            r: Vec::new(),
            step: Vec::new(),
            r_old: Vec::new(),
            x_old: Vec::new(),
            omega: start,
            dr: Vec::new(),
            df: Vec::new(),
            q: Vec::new(),
            upper: Vec::new(),
            gamma: Vec::new(),
            inverse: Vec::new(),
        }
    }

    /// Forgets all that is known from before.
    pub fn begin(&mut self) {
        self.first = true;
    }

    /// Buffer of the residual, which is written before [`Acceleration::step`] is asked.
    pub fn residual(&mut self) -> &mut Vec<f64> {
        &mut self.r
    }

    /// The change of x.
    pub fn step(&mut self, x: &[f64]) -> &[f64] {
        let first = std::mem::take(&mut self.first);
        self.step.clear();
        match self.kind {
            Relaxation::None => self.step.extend_from_slice(&self.r),
            Relaxation::Aitken => {
                self.omega = if first { self.start } else { self.aitken() };
                self.step.extend(self.r.iter().map(|r| self.omega * r));
            }
            Relaxation::Anderson => self.anderson(first),
            Relaxation::Broyden => self.broyden(first, x),
        }
        self.r_old.clone_from(&self.r);
        self.x_old.clear();
        self.x_old.extend_from_slice(x);
        &self.step
    }

    fn aitken(&self) -> f64 {
        let (mut top, mut bottom) = (0.0, 0.0);
        for (new, old) in self.r.iter().zip(&self.r_old) {
            top += old * (new - old);
            bottom += (new - old) * (new - old);
        }
        if bottom > 0.0 { -self.omega * top / bottom } else { self.start }
    }

    /// Needs `r_old` and, as `step` of the call before, f − f_old = r − r_old + step.
    fn anderson(&mut self, first: bool) {
        let n = self.r.len();
        if first {
            self.dr.clear();
            self.df.clear();
            self.step.extend(self.r.iter().map(|r| self.start * r));
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
        // γ from R·γ = Qᵀ·r, then x + r − Δf·γ
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

    /// Modified Gram–Schmidt over the columns of ΔR, newest first; linearly dependent columns are dropped.
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

    fn broyden(&mut self, first: bool, x: &[f64]) {
        let n = self.r.len();
        if first {
            self.inverse.clear();
            self.inverse.resize(n * n, 0.0);
            (0..n).for_each(|i| self.inverse[i * n + i] = self.start);
        } else {
            self.update_inverse(x, n);
        }
        for row in self.inverse.chunks_exact(n.max(1)) {
            self.step.push(row.iter().zip(&self.r).map(|(h, r)| h * r).sum());
        }
    }

    /// H ← H + (s − H·y)·sᵀH/(sᵀ·H·y) with s = x − x_old and y = −(r − r_old) (Broyden 1965, method 1).
    fn update_inverse(&mut self, x: &[f64], n: usize) {
        let s = |i: usize| x[i] - self.x_old[i];
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
            let missing = x[row] - self.x_old[row] - self.gamma[row];
            for c in 0..n {
                self.inverse[row * n + c] += missing * self.q[c];
            }
        }
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::Acceleration;
    use terraglue_scenario::Relaxation;

    /// Repetitions until x = A·x + b is met to 1e-10; 200: it is not.
    fn repetitions(kind: Relaxation, a: [[f64; 3]; 3]) -> u32 {
        let (mut x, b) = ([0.0; 3], [1.0, -2.0, 0.5]);
        let mut way = Acceleration::new(kind, 1.0);
        for k in 0..200 {
            let f = |i: usize| a[i].iter().zip(&x).map(|(a, x)| a * x).sum::<f64>() + b[i];
            let r = [0, 1, 2].map(|i| f(i) - x[i]);
            if r.iter().all(|r| r.abs() < 1e-10) {
                return k;
            }
            way.residual().clear();
            way.residual().extend(r);
            let step = way.step(&x);
            x.iter_mut().zip(step).for_each(|(x, d)| *x += d);
        }
        200
    }

    #[test]
    fn a_loop_whose_gain_is_above_one_is_solved_in_as_many_repetitions_as_it_has_values() {
        // gains of 3, −4 and 0.5 at once: no single factor makes a contraction of them
        let a = [[3.0, 1.0, 0.0], [0.0, -4.0, 0.5], [0.2, 0.0, 0.5]];
        assert!(repetitions(Relaxation::Anderson, a) <= 6);
        assert!(repetitions(Relaxation::Broyden, a) <= 12);
        assert_eq!(repetitions(Relaxation::None, a), 200);
    }

    #[test]
    fn a_contraction_is_left_to_itself() {
        let a = [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
        assert_eq!(repetitions(Relaxation::None, a), 11);
        assert!(repetitions(Relaxation::Anderson, a) <= 3);
    }
}
