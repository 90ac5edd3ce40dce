//! Lemke's complementary pivot algorithm with the lexicographic ratio test.
//!
//! Lemke (1965); Cottle, Pang and Stone (1992), algorithm 4.4.5 and section 4.9. For copositive-plus M, all positive
//! semi-definite ones among them, it finds a solution or ends on a secondary ray that proves that there is none.
//! The lexicographic rule makes cycling impossible in exact arithmetic; a bound on the pivots guards against
//! rounding. The tableau is dense: these problems have as many unknowns as a robot has contacts.

/// Outcome of the algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// z solves the problem; number of pivots.
    Solved(u32),
    /// A secondary ray: for a positive semi-definite M there is no solution. z is zero.
    Ray(u32),
    /// Rounding kept it from ending within the bound on pivots. z is zero.
    PivotLimit(u32),
}

/// Work space, reused from problem to problem.
#[derive(Clone, Debug, Default)]
pub struct Lemke {
    n: usize,
    /// n rows of w (n columns), z (n columns), z0, right-hand side.
    tableau: Vec<f64>,
    /// Column of the basic variable of each row.
    basis: Vec<usize>,
}

/// Entries of the scaled tableau below this count as zero.
const PIVOT_TOLERANCE: f64 = 1e-11;
/// Ratios that differ by less, relative to 1 + their size, are a tie.
const TIE_TOLERANCE: f64 = 1e-12;
/// The same where z0 takes part: leaving, it ends the algorithm with a violation of this order at most.
const END_TOLERANCE: f64 = 1e-10;

impl Lemke {
    /// Solves for z; `m` is n × n, column-major. The scale of M and q does not matter.
    pub fn solve(&mut self, m: &[f64], q: &[f64], z: &mut [f64]) -> Outcome {
        z.fill(0.0);
        self.n = q.len();
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
        let (m_scale, q_scale) = (largest(m), largest(q));
        if q.iter().all(|q| *q >= 0.0) {
            return Outcome::Solved(0);
        }
        if m_scale == 0.0 {
            return Outcome::Ray(0);
        }
        self.fill(m, q, 1.0 / m_scale, 1.0 / q_scale);
        let outcome = self.pivot_to_the_end();
        if let Outcome::Solved(_) = outcome {
            let rhs = 2 * self.n + 1;
            for (row, basic) in self.basis.iter().enumerate() {
                if (self.n..2 * self.n).contains(basic) {
                    z[basic - self.n] = self.at(row, rhs).max(0.0) * q_scale / m_scale;
                }
            }
        }
        outcome
    }

    fn width(&self) -> usize {
        2 * self.n + 2
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.tableau[row * self.width() + column]
    }

    /// [I | −M | −1 | q], scaled.
    fn fill(&mut self, m: &[f64], q: &[f64], m_factor: f64, q_factor: f64) {
        let (n, width) = (self.n, self.width());
        self.tableau.clear();
        self.tableau.resize(n * width, 0.0);
        self.basis.clear();
        self.basis.extend(0..n);
        for (i, row) in self.tableau.chunks_exact_mut(width).enumerate() {
            row[i] = 1.0;
            (0..n).for_each(|j| row[n + j] = -m[j * n + i] * m_factor);
            row[2 * n] = -1.0;
            row[2 * n + 1] = q[i] * q_factor;
        }
    }

    fn pivot_to_the_end(&mut self) -> Outcome {
        let (n, z0) = (self.n, 2 * self.n);
        let limit = 1000 * n as u32 + 1000;
        let mut row = self.first_row();
        let mut entering = z0;
        for pivots in 1..=limit {
            let leaving = self.basis[row];
            self.pivot(row, entering);
            if leaving == z0 {
                return Outcome::Solved(pivots);
            }
            entering = if leaving < n { leaving + n } else { leaving - n };
            match self.leaving_row(entering) {
                Some(next) => row = next,
                None => return Outcome::Ray(pivots),
            }
        }
        Outcome::PivotLimit(limit)
    }

    /// The most negative q; of equals the last, which is the lexicographically smallest.
    fn first_row(&self) -> usize {
        let rhs = 2 * self.n + 1;
        (0..self.n).fold(0, |best, i| if self.at(i, rhs) <= self.at(best, rhs) { i } else { best })
    }

    /// Lexicographically smallest (right-hand side, row of the basis inverse) / column over positive entries;
    /// z0 is preferred where it ties, because the algorithm then ends.
    fn leaving_row(&self, entering: usize) -> Option<usize> {
        let (z0, rhs) = (2 * self.n, 2 * self.n + 1);
        let mut best: Option<usize> = None;
        for i in (0..self.n).filter(|i| self.at(*i, entering) > PIVOT_TOLERANCE) {
            best = match best {
                None => Some(i),
                Some(b) => {
                    let ratio = |r: usize| self.at(r, rhs) / self.at(r, entering);
                    let difference = ratio(i) - ratio(b);
                    let (i_ends, b_ends) = (self.basis[i] == z0, self.basis[b] == z0);
                    let tolerance = if i_ends || b_ends { END_TOLERANCE } else { TIE_TOLERANCE };
                    let tie = difference.abs() <= tolerance * (1.0 + ratio(b).abs());
                    let better = match (tie, i_ends, b_ends) {
                        (true, true, _) => true,
                        (true, _, true) => false,
                        (true, ..) => self.lexicographically_less(i, b, entering),
                        (false, ..) => difference < 0.0,
                    };
                    Some(if better { i } else { b })
                }
            };
        }
        best
    }

    fn lexicographically_less(&self, a: usize, b: usize, entering: usize) -> bool {
        let (pivot_a, pivot_b) = (self.at(a, entering), self.at(b, entering));
        let differences = (0..self.n).map(|k| self.at(a, k) / pivot_a - self.at(b, k) / pivot_b);
        differences.into_iter().find(|d| d.abs() > TIE_TOLERANCE).is_some_and(|d| d < 0.0)
    }

    fn pivot(&mut self, row: usize, column: usize) {
        let width = self.width();
        let factor = 1.0 / self.at(row, column);
        let (above, rest) = self.tableau.split_at_mut(row * width);
        let (pivot, below) = rest.split_at_mut(width);
        pivot.iter_mut().for_each(|v| *v *= factor);
        for other in above.chunks_exact_mut(width).chain(below.chunks_exact_mut(width)) {
            let factor = other[column];
            if factor != 0.0 {
                other.iter_mut().zip(&*pivot).for_each(|(v, p)| *v -= factor * p);
            }
        }
        self.basis[row] = column;
    }
}
