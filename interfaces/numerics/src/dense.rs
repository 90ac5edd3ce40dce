//! Dense linear systems of moderate size (n ≲ 100), solved in place. Storage is reused from system to system, so a step allocates nothing;
//! the factorisations of libraries take new memory for every matrix.

use crate::in_place::{add_four, four, next_column};

/// LU factors with partial pivoting of an n × n matrix, kept by columns; the storage is reused.
///
/// ```
/// use terraglue_numerics::dense::Lu;
///
/// let matrix = [[0.0, 2.0], [3.0, 1.0]];
/// let mut lu = Lu::default();
/// assert_eq!(lu.factor(2, |row, column| matrix[row][column]), 2);
/// let mut b = [4.0, 11.0];
/// lu.solve(&mut b);
/// assert_eq!(b, [3.0, 2.0]);
/// ```
#[derive(Debug, Default)]
pub struct Lu {
    factors: Vec<f64>,
    pivots: Vec<usize>,
    n: usize,
}

impl Lu {
    /// Room for a matrix of n × n.
    pub fn reserve(&mut self, n: usize) {
        make_room(&mut self.factors, n * n);
        make_room(&mut self.pivots, n);
    }

    /// Factors the matrix whose entry (row, column) is `entry(row, column)`. Returns its numerical rank: the
    /// number of pivots above 1e-14 of the largest; smaller pivots are replaced, so that a solve stays finite.
    pub fn factor(&mut self, n: usize, mut entry: impl FnMut(usize, usize) -> f64) -> usize {
        self.n = n;
        self.factors.clear();
        self.pivots.clear();
        for column in 0..n {
            self.factors.extend((0..n).map(|row| entry(row, column)));
        }
        let scale = self.factors.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let tiny = (1e-14 * scale).max(f64::MIN_POSITIVE);
        (0..n).filter(|k| self.eliminate(*k, tiny)).count()
    }

    /// Makes column k one of the factors.
    fn eliminate(&mut self, k: usize, tiny: f64) -> bool {
        let n = self.n;
        let (left, right) = self.factors.split_at_mut(k * n);
        let column = &mut right[..n];
        next_column(left, column, &mut self.pivots);
        let regular = column[k].abs() > tiny;
        if !regular {
            column[k] = tiny.copysign(column[k]);
        }
        let diagonal = column[k];
        column[k + 1..].iter_mut().for_each(|f| *f /= diagonal);
        regular
    }

    /// Smallest pivot over the largest: 1/condition, roughly.
    pub fn weakest(&self) -> f64 {
        let pivots = || (0..self.n).map(|k| self.factors[k * self.n + k].abs());
        let largest = pivots().fold(0.0, f64::max);
        if largest > 0.0 { pivots().fold(f64::INFINITY, f64::min) / largest } else { 1.0 }
    }

    /// Solves A·x = b in place.
    pub fn solve(&self, b: &mut [f64]) {
        let n = self.n;
        for (k, pivot) in self.pivots.iter().enumerate() {
            b.swap(k, *pivot);
        }
        for row in 0..n {
            let sum: f64 = (0..row).map(|k| self.factors[k * n + row] * b[k]).sum();
            b[row] -= sum;
        }
        for row in (0..n).rev() {
            let sum: f64 = (row + 1..n).map(|k| self.factors[k * n + row] * b[k]).sum();
            b[row] = (b[row] - sum) / self.factors[row * n + row];
        }
    }
}

/// y += A·x for a column-major n × n matrix.
pub fn multiply_add(a: &[f64], x: &[f64], y: &mut [f64]) {
    let n = y.len().max(1);
    let (fours, factors) = (a.chunks_exact(4 * n), x.chunks_exact(4));
    let rest = fours.remainder().chunks_exact(n).zip(factors.remainder());
    for (columns, x) in fours.zip(factors) {
        add_four(y, four(columns, n), 0, [x[0], x[1], x[2], x[3]]);
    }
    for (column, factor) in rest {
        for (sum, entry) in y.iter_mut().zip(column) {
            *sum += entry * factor;
        }
    }
}

/// Lets `vector` take n entries without allocating.
pub fn make_room<T>(vector: &mut Vec<T>, n: usize) {
    vector.reserve(n.saturating_sub(vector.len()));
}

/// max |a_i|.
pub fn max_norm(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |m, v| m.max(v.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn solutions_satisfy_the_system(a in prop::collection::vec(-1.0..1.0_f64, 36), x in prop::collection::vec(-1.0..1.0_f64, 6)) {
            let dominant = |r: usize, c: usize| a[6 * r + c] + if r == c { 7.0 } else { 0.0 };
            let mut b: Vec<f64> = (0..6).map(|r| (0..6).map(|c| dominant(r, c) * x[c]).sum()).collect();
            let mut lu = Lu::default();
            prop_assert_eq!(lu.factor(6, dominant), 6);
            lu.solve(&mut b);
            for (got, want) in b.iter().zip(&x) {
                prop_assert!((got - want).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_zero_on_the_diagonal_is_pivoted_and_rank_is_counted() {
        let mut lu = Lu::default();
        let m = [[0.0, 2.0], [3.0, 0.0]];
        assert_eq!(lu.factor(2, |r, c| m[r][c]), 2);
        let mut b = [4.0, 9.0];
        lu.solve(&mut b);
        assert_eq!(b, [3.0, 2.0]);
        assert_eq!(lu.factor(2, |_, _| 1.0), 1);
    }
}
