//! Dantzig's principal pivoting method (Cottle and Dantzig 1968; Baraff 1994 for contacts).
//!
//! The unknowns are brought in one after the other: z_i grows until its w_i is zero, while those already in keep
//! their complementarity; one of them may have to change sides on the way. For positive definite M this ends with
//! the solution, for semi-definite ones with it or with a ray. On friction pyramids, whose M is only copositive,
//! it may end on a ray although there is a solution: Lemke's algorithm is the method there.

use super::Outcome;
use crate::dense;

/// Work space, reused from problem to problem.
#[derive(Clone, Debug, Default)]
pub struct Dantzig {
    /// Whether z_i is basic (w_i = 0).
    basic: Vec<bool>,
    set: Vec<usize>,
    matrix: Vec<f64>,
    dz: Vec<f64>,
    w: Vec<f64>,
    dw: Vec<f64>,
}

/// Values nearer to zero than this, relative to the scale of w, count as zero.
const ZERO: f64 = 1e-12;

impl Dantzig {
    /// Solves for z; `m` is n × n, column-major.
    pub fn solve(&mut self, m: &[f64], q: &[f64], z: &mut [f64]) -> Outcome {
        let n = q.len();
        z.fill(0.0);
        self.basic.clear();
        self.basic.resize(n, false);
        self.w.clear();
        self.w.extend_from_slice(q);
        self.dw.resize(n, 0.0);
        let scale = q.iter().fold(0.0_f64, |s, q| s.max(q.abs()));
        let limit = 1000 * n as u32 + 1000;
        let mut pivots = 0;
        // The worst first, which keeps the number of exchanges low.
        while let Some(i) =
            (0..n).filter(|i| self.w[*i] < -ZERO * scale).min_by(|a, b| self.w[*a].total_cmp(&self.w[*b]))
        {
            loop {
                pivots += 1;
                if pivots > limit {
                    z.fill(0.0);
                    return Outcome::PivotLimit(limit);
                }
                match self.pivot(m, i, scale, z) {
                    Some(true) => break,
                    Some(false) => {}
                    None => {
                        z.fill(0.0);
                        return Outcome::Ray(pivots);
                    }
                }
            }
            // Rounding of the updates would otherwise stay.
            for (i, w) in self.w.iter_mut().enumerate() {
                *w =
                    if self.basic[i] { 0.0 } else { q[i] + (0..n).map(|j| m[j * n + i] * z[j]).sum::<f64>() };
            }
        }
        Outcome::Solved(pivots)
    }

    /// Raises z_i until w_i is zero (true) or something blocks and changes sides (false); none: nothing blocks.
    fn pivot(&mut self, m: &[f64], i: usize, scale: f64, z: &mut [f64]) -> Option<bool> {
        let n = z.len();
        self.direction(m, i);
        let largest = (0..n).fold(0.0_f64, |s, k| s.max(m[i * n + k].abs()));
        let grows = self.dw[i] > ZERO * largest;
        let mut step = if grows { -self.w[i] / self.dw[i] } else { f64::INFINITY };
        let mut blocking = None;
        for (k, dz) in self.set.iter().zip(&self.dz) {
            if *dz < 0.0 && -z[*k] / dz < step {
                (step, blocking) = (-z[*k] / dz, Some(*k));
            }
        }
        for k in (0..n).filter(|k| *k != i && !self.basic[*k] && self.w[*k] >= -ZERO * scale) {
            if self.dw[k] < -ZERO * largest && -self.w[k].max(0.0) / self.dw[k] < step {
                (step, blocking) = (-self.w[k].max(0.0) / self.dw[k], Some(k));
            }
        }
        if step.is_infinite() {
            return None;
        }
        z[i] += step;
        for (k, dz) in self.set.iter().zip(&self.dz) {
            z[*k] = (z[*k] + step * dz).max(0.0);
        }
        self.w.iter_mut().zip(&self.dw).for_each(|(w, d)| *w += step * d);
        match blocking {
            None => {
                self.basic[i] = true;
                self.w[i] = 0.0;
                Some(true)
            }
            Some(k) => {
                self.basic[k] = !self.basic[k];
                (z[k], self.w[k]) = if self.basic[k] { (z[k], 0.0) } else { (0.0, self.w[k]) };
                Some(false)
            }
        }
    }

    /// dz of the basic unknowns and dw of all for dz_i = 1.
    fn direction(&mut self, m: &[f64], i: usize) {
        let n = self.w.len();
        self.set.clear();
        self.set.extend((0..n).filter(|k| self.basic[*k]));
        let count = self.set.len();
        self.matrix.clear();
        for r in &self.set {
            self.matrix.extend(self.set.iter().map(|c| m[c * n + r]));
        }
        self.dz.clear();
        self.dz.extend(self.set.iter().map(|r| -m[i * n + r]));
        dense::solve(count, &mut self.matrix, &mut self.dz, 1e-14);
        for k in 0..n {
            let moved: f64 = self.set.iter().zip(&self.dz).map(|(c, d)| m[c * n + k] * d).sum();
            self.dw[k] = if self.basic[k] { 0.0 } else { m[i * n + k] + moved };
        }
    }
}
