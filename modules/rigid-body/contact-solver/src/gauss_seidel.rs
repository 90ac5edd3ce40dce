//! Block Gauss–Seidel with exact local solutions (Jean 1999): slow, but it does not stall where Newton does.

use crate::local;
use crate::newton::Shifted;

/// One sweep over all contacts in order; u is brought up to date on the way. Returns the largest change.
pub(crate) fn sweep(s: &Shifted, r: &mut [f64], u: &mut [f64]) -> f64 {
    let n = r.len();
    let mut largest = 0.0_f64;
    for k in 0..n / 3 {
        let at = 3 * k;
        let mut w = [0.0; 9];
        let mut q = [u[at], u[at + 1], u[at + 2]];
        for i in 0..3 {
            for j in 0..3 {
                w[3 * i + j] = s.problem.at(at + i, at + j);
            }
            w[4 * i] += s.shift[k];
            q[i] -= (0..3).map(|j| w[3 * i + j] * r[at + j]).sum::<f64>();
        }
        let new = local::solve(&w, q, s.problem.mu[k]);
        for j in 0..3 {
            let change = new[j] - r[at + j];
            if change != 0.0 {
                r[at + j] = new[j];
                largest = largest.max(change.abs());
                u.iter_mut().enumerate().for_each(|(i, u)| *u += s.problem.at(i, at + j) * change);
                u[at + j] += s.shift[k] * change;
            }
        }
    }
    largest
}
