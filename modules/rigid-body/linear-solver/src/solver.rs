//! Analysis once, numeric factorisation per step, solves with a checked residual.

use crate::triangular;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::cholesky::simplicial::{
    SymbolicSimplicialCholesky, factorize_simplicial_numeric_ldlt, factorize_simplicial_numeric_ldlt_scratch,
    factorize_simplicial_symbolic_cholesky, factorize_simplicial_symbolic_cholesky_scratch,
    prefactorize_symbolic_cholesky, prefactorize_symbolic_cholesky_scratch,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};

/// What can go wrong.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The pattern is not an upper triangle in compressed columns.
    #[error("the pattern is not an upper triangle in compressed columns with sorted rows")]
    Pattern,
    /// faer could not analyse the pattern (out of memory).
    #[error("the pattern could not be analysed: {0}")]
    Analysis(String),
    /// A pivot vanished or is not finite: a body without inertia, or redundant constraints.
    #[error("the pivot of unknown {unknown} is zero or not finite")]
    Pivot {
        /// Index of the unknown.
        unknown: usize,
    },
    /// The residual stayed large after refinement.
    #[error("the residual {residual:e} exceeds {limit:e} after refinement")]
    Residual {
        /// Largest residual, relative to the right-hand side.
        residual: f64,
        /// What is tolerated.
        limit: f64,
    },
}

/// Relative residual above which one refinement step is made.
const REFINE_ABOVE: f64 = 1e-13;
/// Relative residual that is never accepted.
const REFUSE_ABOVE: f64 = 1e-8;

/// LDLᵀ of a sparse symmetric matrix in the order given.
pub struct Solver {
    n: usize,
    pattern: SymbolicSparseColMat<usize>,
    symbolic: SymbolicSimplicialCholesky<usize>,
    parents: Vec<usize>,
    values: Vec<f64>,
    factor: Vec<f64>,
    memory: MemBuffer,
    residual: Vec<f64>,
}

impl Solver {
    /// Analyses the pattern of the upper triangle (diagonal included): column j holds the rows
    /// `row_idx[col_ptr[j]..col_ptr[j + 1]]`, ascending, the last one j itself.
    pub fn new(n: usize, col_ptr: Vec<usize>, row_idx: Vec<usize>) -> Result<Self, Error> {
        check_pattern(n, &col_ptr, &row_idx)?;
        let nnz = row_idx.len();
        let pattern = SymbolicSparseColMat::<usize>::new_checked(n, n, col_ptr, None, row_idx);
        let symbolic = analyse(&pattern, n, nnz)?;
        let parents = triangular::parents(symbolic.col_ptr(), symbolic.row_idx());
        let factor = vec![0.0; symbolic.len_val()];
        let memory = MemBuffer::new(factorize_simplicial_numeric_ldlt_scratch::<usize, f64>(n));
        Ok(Self {
            n,
            pattern,
            symbolic,
            parents,
            values: vec![0.0; nnz],
            factor,
            memory,
            residual: vec![0.0; n],
        })
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether there are no unknowns.
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Number of entries of the factor.
    pub fn factor_len(&self) -> usize {
        self.factor.len()
    }

    /// Values of the upper triangle in the order of the pattern, to be filled before [`Solver::factor`].
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Factorises the current values.
    pub fn factor(&mut self) -> Result<(), Error> {
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), &self.values);
        factorize_simplicial_numeric_ldlt(
            &mut self.factor,
            matrix,
            Default::default(),
            &self.symbolic,
            MemStack::new(&mut self.memory),
        )
        .map_err(|_| Error::Pivot { unknown: self.bad_pivot() })?;
        Ok(())
    }

    /// x = A⁻¹·rhs with a checked residual, refined once where it is not at rounding level.
    pub fn solve(&mut self, rhs: &[f64], x: &mut [f64]) -> Result<(), Error> {
        x.copy_from_slice(rhs);
        self.substitute(x);
        let scale = max_abs(rhs);
        let mut worst = self.residual(rhs, x, scale);
        if worst > REFINE_ABOVE {
            let mut correction = std::mem::take(&mut self.residual);
            self.substitute(&mut correction);
            x.iter_mut().zip(&correction).for_each(|(x, c)| *x += c);
            self.residual = correction;
            worst = self.residual(rhs, x, scale);
        }
        // A NaN compares as neither; it must not pass.
        if worst <= REFUSE_ABOVE {
            Ok(())
        } else {
            Err(Error::Residual { residual: worst, limit: REFUSE_ABOVE })
        }
    }

    /// x = A⁻¹·x without a check: for corrections whose result is checked by other means.
    pub fn substitute(&self, x: &mut [f64]) {
        let (ptr, rows) = (self.symbolic.col_ptr(), self.symbolic.row_idx());
        triangular::forward(ptr, rows, &self.factor, x);
        triangular::scale_and_backward(ptr, rows, &self.factor, x);
    }

    /// The unknowns that `first` reaches on its way to the root, in order: where L⁻¹ of a right-hand side that
    /// starts at `first` can be different from zero.
    pub fn path(&self, first: usize) -> impl Iterator<Item = usize> + '_ {
        triangular::path(&self.parents, first)
    }

    /// x = L⁻¹·x where x is zero outside the path of `first`; costs only that path.
    pub fn forward_on_path(&self, first: usize, x: &mut [f64]) {
        triangular::forward_on_path(
            self.symbolic.col_ptr(),
            self.symbolic.row_idx(),
            &self.factor,
            &self.parents,
            first,
            x,
        );
    }

    /// D of unknown j.
    pub fn pivot(&self, j: usize) -> f64 {
        self.factor[self.symbolic.col_ptr()[j]]
    }

    /// Fills `self.residual` with rhs − A·x; the largest entry relative to the scale of the right-hand side
    /// and of the terms that cancel in A·x.
    fn residual(&mut self, rhs: &[f64], x: &[f64], scale: f64) -> f64 {
        let r = &mut self.residual;
        r.copy_from_slice(rhs);
        let (ptr, rows) = (self.pattern.col_ptr(), self.pattern.row_idx());
        let mut terms = scale;
        for j in 0..self.n {
            let column = ptr[j]..ptr[j + 1];
            for (i, a) in rows[column.clone()].iter().zip(&self.values[column]) {
                let i = *i;
                r[i] -= a * x[j];
                terms = terms.max((a * x[j]).abs());
                if i != j {
                    r[j] -= a * x[i];
                    terms = terms.max((a * x[i]).abs());
                }
            }
        }
        let worst = if r.iter().all(|v| v.is_finite()) { max_abs(r) } else { f64::NAN };
        if terms > 0.0 { worst / terms } else { worst }
    }

    fn bad_pivot(&self) -> usize {
        (0..self.n).find(|j| !self.pivot(*j).is_finite() || self.pivot(*j) == 0.0).unwrap_or(self.n)
    }
}

fn max_abs(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m, x| m.max(x.abs()))
}

fn check_pattern(n: usize, col_ptr: &[usize], row_idx: &[usize]) -> Result<(), Error> {
    let shape =
        col_ptr.len() == n + 1 && col_ptr.first() == Some(&0) && col_ptr.last() == Some(&row_idx.len());
    if !shape || !col_ptr.is_sorted() {
        return Err(Error::Pattern);
    }
    let column = |j: usize| &row_idx[col_ptr[j]..col_ptr[j + 1]];
    let good = (0..n).all(|j| column(j).last() == Some(&j) && column(j).is_sorted_by(|a, b| a < b));
    if good { Ok(()) } else { Err(Error::Pattern) }
}

fn analyse(
    pattern: &SymbolicSparseColMat<usize>,
    n: usize,
    nnz: usize,
) -> Result<SymbolicSimplicialCholesky<usize>, Error> {
    let need = StackReq::any_of(&[
        prefactorize_symbolic_cholesky_scratch::<usize>(n, nnz),
        factorize_simplicial_symbolic_cholesky_scratch::<usize>(n),
    ]);
    let mut memory = MemBuffer::new(need);
    let (mut etree, mut counts) = (vec![0isize; n], vec![0usize; n]);
    let etree =
        prefactorize_symbolic_cholesky(&mut etree, &mut counts, pattern.as_ref(), MemStack::new(&mut memory));
    factorize_simplicial_symbolic_cholesky(pattern.as_ref(), etree, &counts, MemStack::new(&mut memory))
        .map_err(|e| Error::Analysis(format!("{e:?}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain body – joint – body with scalar blocks: [[2, 0, 1], [0, 3, −1], [1, −1, 0]] in the order 0, 2, 1.
    fn chain() -> Solver {
        let mut s = Solver::new(3, vec![0, 1, 3, 5], vec![0, 0, 1, 1, 2]).expect("a pattern");
        s.values_mut().copy_from_slice(&[2.0, 1.0, 0.0, -1.0, 3.0]);
        s.factor().expect("quasi-definite");
        s
    }

    #[test]
    fn an_indefinite_joint_system_is_solved_to_rounding() {
        let mut x = [0.0; 3];
        chain().solve(&[4.0, 0.0, 6.0], &mut x).expect("solvable");
        // 2a + λ = 4, a − b = 0, 3b − λ = 6 → a = b = 2, λ = 0.
        for (x, exact) in x.iter().zip([2.0, 0.0, 2.0]) {
            assert!((x - exact).abs() < 1e-15, "{x} {exact}");
        }
    }

    #[test]
    fn half_a_solve_on_the_path_gives_the_same_inverse() {
        let mut s = chain();
        let mut full = [0.0; 3];
        s.solve(&[1.0, 0.0, 0.0], &mut full).expect("solvable");
        let mut y = [1.0, 0.0, 0.0];
        s.forward_on_path(0, &mut y);
        let inverse: f64 = s.path(0).map(|k| y[k] * y[k] / s.pivot(k)).sum();
        assert_eq!(s.path(0).collect::<Vec<_>>(), [0, 1, 2]);
        assert!((inverse - full[0]).abs() < 1e-15);
    }

    #[test]
    fn a_body_without_inertia_and_a_bad_pattern_are_refused() {
        let mut s = Solver::new(2, vec![0, 1, 2], vec![0, 1]).expect("a pattern");
        s.values_mut().copy_from_slice(&[1.0, 0.0]);
        assert_eq!(s.factor(), Err(Error::Pivot { unknown: 1 }));
        assert_eq!(Solver::new(2, vec![0, 1, 2], vec![0, 0]).err(), Some(Error::Pattern));
    }

    #[test]
    fn a_right_hand_side_that_is_not_a_number_is_an_error() {
        assert!(matches!(chain().solve(&[f64::NAN, 0.0, 0.0], &mut [0.0; 3]), Err(Error::Residual { .. })));
    }
}
