//! A dense symmetric positive semi-definite system with a unit diagonal, its Cholesky factor with diagonal pivoting
//! (faer) and its rank.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt_pivoting::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::{Mat, Par};
use std::fmt;

/// Pivots below this belong to dependent rows.
const RANK: f64 = 1e-11;

/// The matrix, then its factor, in the lower triangle.
pub(crate) struct Dense {
    w: Mat<f64>,
    order: Vec<usize>,
    order_inverse: Vec<usize>,
    rank: usize,
    memory: Option<MemBuffer>,
}

impl Dense {
    pub fn new(n: usize) -> Self {
        let scratch = cholesky_in_place_scratch::<usize, f64>(n, Par::Seq, Default::default());
        Self {
            w: Mat::zeros(n, n),
            order: vec![0; n],
            order_inverse: vec![0; n],
            rank: 0,
            memory: (n > 0).then(|| MemBuffer::new(scratch)),
        }
    }

    /// Sets an entry of the lower triangle.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.w[(row, column)] = value;
    }

    pub fn rank(&self) -> usize {
        self.rank
    }

    /// False: the matrix is not positive semi-definite.
    pub fn factor(&mut self) -> bool {
        let Some(memory) = &mut self.memory else { return true };
        let n = self.order.len();
        if (0..n).all(|i| self.w[(i, i)] == 0.0) {
            self.rank = 0;
            self.order.iter_mut().enumerate().for_each(|(i, o)| *o = i);
            return true;
        }
        let done = cholesky_in_place(
            self.w.as_mut(),
            &mut self.order,
            &mut self.order_inverse,
            Par::Seq,
            MemStack::new(memory),
            Default::default(),
        );
        let Ok((info, _)) = done else { return false };
        let dependent = |k: &usize| self.w[(*k, *k)] * self.w[(*k, *k)] < RANK;
        self.rank = (0..info.rank).find(dependent).unwrap_or(info.rank);
        true
    }

    /// x ← L⁻¹·x; dependent rows become 0.
    pub fn lower(&self, x: &mut [f64]) {
        let order = &self.order[..self.rank];
        for i in 0..order.len() {
            let before: f64 = (0..i).map(|k| self.w[(i, k)] * x[order[k]]).sum();
            x[order[i]] = (x[order[i]] - before) / self.w[(i, i)];
        }
        self.order[self.rank..].iter().for_each(|i| x[*i] = 0.0);
    }

    /// x ← L⁻ᵀ·x.
    pub fn upper(&self, x: &mut [f64]) {
        let order = &self.order[..self.rank];
        for i in (0..order.len()).rev() {
            let later: f64 = (i + 1..order.len()).map(|k| self.w[(k, i)] * x[order[k]]).sum();
            x[order[i]] = (x[order[i]] - later) / self.w[(i, i)];
        }
    }
}

impl Default for Dense {
    fn default() -> Self {
        Self::new(0)
    }
}

impl Clone for Dense {
    fn clone(&self) -> Self {
        Self {
            w: self.w.clone(),
            order: self.order.clone(),
            order_inverse: self.order_inverse.clone(),
            rank: self.rank,
            ..Self::new(self.order.len())
        }
    }
}

impl fmt::Debug for Dense {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Dense {{ rows: {}, rank: {} }}", self.order.len(), self.rank)
    }
}
