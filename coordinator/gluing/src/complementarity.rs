//! The linearised interface problem: find d so that w = e + A·d is complementary to the bounds of T + d.
//!
//! Bounded rows: lower ≤ T_i + d_i ≤ upper with w_i ≥ 0 at the lower bound, w_i ≤ 0 at the upper one and
//! w_i = 0 between. Equality rows (no bounds): w_i = 0. Solved to the end by a primal-dual active set
//! (Hintermüller, Ito, Kunisch 2002); if it cycles, by principal pivoting with the least index (Murty 1974),
//! which ends for every P-matrix.

use terraglue_numerics::dense::Lu;
use terraglue_numerics::least_norm::TruncatedSolver;

/// Pivots weaker than this make the system one for the truncated solver.
const WEAK: f64 = 1e-10;

/// Status of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Free,
    AtLower,
    AtUpper,
}

/// Solver with its buffers.
#[derive(Debug, Default)]
pub struct BoundedSolver {
    lu: Lu,
    truncated: TruncatedSolver,
    states: Vec<State>,
    rank: usize,
    condition: f64,
}

/// The problem; `a` is row-major through a function, so that callers assemble nothing twice.
pub struct BoundedProblem<'a, A: Fn(usize, usize) -> f64> {
    /// Entry (row, column) of A.
    pub a: A,
    /// w at d = 0.
    pub e: &'a [f64],
    /// T.
    pub t: &'a [f64],
    /// Lower bounds of T + d.
    pub lower: &'a [f64],
    /// Upper bounds.
    pub upper: &'a [f64],
}

impl BoundedSolver {
    /// Rank of the last system.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Condition of the last system, by its pivots.
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// Writes d; `false` when no consistent set was found (A is not a P-matrix), d is then the last trial.
    pub fn solve<A: Fn(usize, usize) -> f64>(&mut self, p: &BoundedProblem<A>, d: &mut [f64]) -> bool {
        let n = p.e.len();
        self.states.clear();
        self.states.resize(n, State::Free);
        (0..20).any(|_| self.update_states(p, d, true))
            || (0..200 + 20 * n).any(|_| self.update_states(p, d, false))
    }

    /// One linear solve for the present states and their update; whether nothing changed. All components
    /// change at once (`together`) or only the first.
    fn update_states<A: Fn(usize, usize) -> f64>(
        &mut self,
        p: &BoundedProblem<A>,
        d: &mut [f64],
        together: bool,
    ) -> bool {
        self.solve_states(p, d);
        let n = p.e.len();
        let mut unchanged = true;
        for i in 0..n {
            let new = self.next_state(p, d, i);
            if new != self.states[i] {
                self.states[i] = new;
                unchanged = false;
                if !together {
                    break;
                }
            }
        }
        unchanged
    }

    fn next_state<A: Fn(usize, usize) -> f64>(&self, p: &BoundedProblem<A>, d: &[f64], i: usize) -> State {
        let slack = 1e-14 * (1.0 + p.t[i].abs());
        match self.states[i] {
            State::Free if p.t[i] + d[i] < p.lower[i] - slack => State::AtLower,
            State::Free if p.t[i] + d[i] > p.upper[i] + slack => State::AtUpper,
            State::Free => State::Free,
            bound => {
                let mut w = p.e[i];
                let mut magnitude = p.e[i].abs();
                for (j, d_j) in d.iter().enumerate() {
                    let term = (p.a)(i, j) * d_j;
                    w += term;
                    magnitude += term.abs();
                }
                let pulled = if bound == State::AtLower { w < 0.0 } else { w > 0.0 };
                if pulled && w.abs() > 1e-13 * magnitude { State::Free } else { bound }
            }
        }
    }

    fn solve_states<A: Fn(usize, usize) -> f64>(&mut self, p: &BoundedProblem<A>, d: &mut [f64]) {
        let n = p.e.len();
        let states = &self.states;
        let entry = |r: usize, c: usize| match states[r] {
            State::Free => (p.a)(r, c),
            _ => f64::from(u8::from(r == c)) * (p.a)(r, r).abs().max(f64::MIN_POSITIVE),
        };
        for i in 0..n {
            d[i] = match states[i] {
                State::Free => -p.e[i],
                State::AtLower => (p.lower[i] - p.t[i]) * entry(i, i),
                State::AtUpper => (p.upper[i] - p.t[i]) * entry(i, i),
            };
        }
        self.rank = self.lu.factor(n, entry);
        let weakest = self.lu.weakest();
        self.condition = 1.0 / weakest.max(f64::MIN_POSITIVE);
        if weakest < WEAK && states.iter().all(|s| *s == State::Free) && symmetric(&p.a, n) {
            self.rank = self.truncated.solve(n, &p.a, d);
        } else {
            self.lu.solve(d);
        }
        for i in 0..n {
            match states[i] {
                State::Free => {}
                State::AtLower => d[i] = p.lower[i] - p.t[i],
                State::AtUpper => d[i] = p.upper[i] - p.t[i],
            }
        }
    }
}

fn symmetric(a: impl Fn(usize, usize) -> f64, n: usize) -> bool {
    (0..n * n).all(|k| {
        let (r, c) = (k / n, k % n);
        (a(r, c) - a(c, r)).abs() <= 1e-8 * (a(r, r).abs() + a(c, c).abs())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn random_p_matrices_are_solved(b in prop::collection::vec(-1.0..1.0_f64, 25), q in prop::collection::vec(-1.0..1.0_f64, 5), cap in 0.1..2.0_f64) {
            let a = |r: usize, c: usize| (0..5).map(|k| b[5 * k + r] * b[5 * k + c]).sum::<f64>() + if r == c { 0.05 } else { 0.0 };
            let (t, lower, upper) = ([0.0; 5], [0.0; 5], [cap; 5]);
            let mut d = [0.0; 5];
            let p = BoundedProblem { a, e: &q, t: &t, lower: &lower, upper: &upper };
            prop_assert!(BoundedSolver::default().solve(&p, &mut d));
            for i in 0..5 {
                let w: f64 = q[i] + (0..5).map(|j| a(i, j) * d[j]).sum::<f64>();
                prop_assert!(d[i] >= -1e-12 && d[i] <= cap + 1e-12);
                prop_assert!(d[i] > 1e-9 || w >= -1e-9);
                prop_assert!(d[i] < cap - 1e-9 || w <= 1e-9);
                prop_assert!(d[i] <= 1e-9 || d[i] >= cap - 1e-9 || w.abs() < 1e-9);
            }
        }
    }

    /// Six rigid-plastic feet under one body, one implicit Euler step: see `tests/reference/gluing/README.md`,
    /// case TABLE-BOX.
    #[test]
    fn table_on_yielding_feet() {
        let feet = [(0.4, 0.3), (0.0, 0.3), (-0.4, 0.3), (0.4, -0.3), (0.0, -0.3), (-0.4, -0.3)];
        let rows: Vec<[f64; 3]> = feet.iter().map(|(x, y)| [1.0, y - 0.02, -(x - 0.05)]).collect();
        let inverse_mass = [1.0 / 60.0, 1.0 / 2.0, 1.0 / 4.0];
        let h: f64 = 5e-3;
        let a = |r: usize, c: usize| {
            (0..3).map(|k| rows[r][k] * rows[c][k] * inverse_mass[k]).sum::<f64>() * h * h
        };
        let (t, lower, e) = ([0.0; 6], [0.0; 6], [-h * h * 9.81; 6]);
        let upper = [120.0, 90.0, 150.0, 60.0, 200.0, 80.0];
        let mut d = [0.0; 6];
        assert!(
            BoundedSolver::default()
                .solve(&BoundedProblem { a, e: &e, t: &t, lower: &lower, upper: &upper }, &mut d)
        );
        let expected = [120.0, 90.0, 99.5777090, 60.0, 200.0, 10.8804953];
        for (got, want) in d.iter().zip(expected) {
            assert!((got - want).abs() < 1e-6, "{got} against {want}");
        }
    }
}
