//! Symmetric systems that are singular or nearly so: the solution of least norm by a truncated eigen-decomposition.
//!
//! Redundant constraints (two equal joints, a mechanism stretched flat) leave forces undetermined; directions whose eigenvalue is below
//! 1e-10 of the largest are left alone.

/// Eigenvalues below this share of the largest count as zero.
const TRUNCATION: f64 = 1e-10;
/// Sweeps of Jacobi's method; it ends after five to ten.
const MAX_SWEEPS: usize = 40;

/// Jacobi's method (1846) with its buffers.
///
/// ```
/// use terraglue_numerics::least_norm::TruncatedSolver;
///
/// // two equal equations: the solution of least norm shares the load
/// let mut b = [2.0, 2.0];
/// assert_eq!(TruncatedSolver::default().solve(2, |_, _| 1.0, &mut b), 1);
/// assert!(b.iter().all(|x| (x - 1.0).abs() < 1e-14));
/// ```
#[derive(Debug, Default)]
pub struct TruncatedSolver {
    a: Vec<f64>,
    v: Vec<f64>,
    x: Vec<f64>,
}

impl TruncatedSolver {
    /// Solves A·x = b in place in the least-squares sense with least norm; the rank. A is symmetric, n × n.
    pub fn solve(&mut self, n: usize, entry: impl Fn(usize, usize) -> f64, b: &mut [f64]) -> usize {
        self.a.clear();
        self.v.clear();
        for r in 0..n {
            self.a.extend((0..n).map(|c| 0.5 * (entry(r, c) + entry(c, r))));
            self.v.extend((0..n).map(|c| f64::from(u8::from(r == c))));
        }
        for _ in 0..MAX_SWEEPS {
            let off: f64 = (0..n * n).filter(|k| k / n != k % n).map(|k| self.a[k] * self.a[k]).sum();
            let all: f64 = self.a.iter().map(|x| x * x).sum();
            if off <= 1e-30 * all {
                break;
            }
            for p in 0..n {
                for q in p + 1..n {
                    self.rotate(n, p, q);
                }
            }
        }
        let largest = (0..n).fold(0.0_f64, |m, i| m.max(self.a[i * n + i].abs()));
        self.x.clear();
        self.x.resize(n, 0.0);
        let mut rank = 0;
        for i in (0..n).filter(|i| self.a[i * n + i].abs() > TRUNCATION * largest) {
            rank += 1;
            let along: f64 = (0..n).map(|r| self.v[r * n + i] * b[r]).sum();
            for r in 0..n {
                self.x[r] += self.v[r * n + i] * along / self.a[i * n + i];
            }
        }
        b.copy_from_slice(&self.x);
        rank
    }

    /// One rotation that makes entry (p, q) zero.
    fn rotate(&mut self, n: usize, p: usize, q: usize) {
        let a = &mut self.a;
        if a[p * n + q] == 0.0 {
            return;
        }
        let theta = (a[q * n + q] - a[p * n + p]) / (2.0 * a[p * n + q]);
        let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
        let t = if theta == 0.0 { 1.0 } else { t };
        let c = 1.0 / (t * t + 1.0).sqrt();
        let s = t * c;
        for k in 0..n {
            let (x, y) = (a[k * n + p], a[k * n + q]);
            (a[k * n + p], a[k * n + q]) = (c * x - s * y, s * x + c * y);
        }
        for k in 0..n {
            let (x, y) = (a[p * n + k], a[q * n + k]);
            (a[p * n + k], a[q * n + k]) = (c * x - s * y, s * x + c * y);
        }
        for k in 0..n {
            let (x, y) = (self.v[k * n + p], self.v[k * n + q]);
            (self.v[k * n + p], self.v[k * n + q]) = (c * x - s * y, s * x + c * y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_singular_system_is_solved_with_least_norm() {
        // rank 2 of 3: rows (1, 1, 0) and (0, 0, 2)
        let m = [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 2.0]];
        let mut b = [2.0, 2.0, 4.0];
        assert_eq!(TruncatedSolver::default().solve(3, |r, c| m[r][c], &mut b), 2);
        for (got, want) in b.iter().zip([1.0, 1.0, 2.0]) {
            assert!((got - want).abs() < 1e-14, "{b:?}");
        }
    }

    #[test]
    fn a_regular_system_is_solved_too() {
        let m = [[4.0, 1.0, -2.0], [1.0, 3.0, 0.5], [-2.0, 0.5, 5.0]];
        let x = [1.0, -2.0, 0.5];
        let mut b = [0, 1, 2].map(|r| (0..3).map(|c| m[r][c] * x[c]).sum::<f64>());
        assert_eq!(TruncatedSolver::default().solve(3, |r, c| m[r][c], &mut b), 3);
        for (got, want) in b.iter().zip(x) {
            assert!((got - want).abs() < 1e-13, "{b:?}");
        }
    }
}
