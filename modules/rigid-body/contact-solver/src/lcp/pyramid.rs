//! Friction as a pyramid: the linear complementarity problem of Stewart and Trinkle (1996), Anitescu and Potra (1997).
//!
//! Per contact r_n, the impulses β_j ≥ 0 along the edges d_j of the pyramid's base, and γ, the largest slip speed:
//! 0 ≤ r_n ⟂ u_n ≥ 0, 0 ≤ β_j ⟂ d_j·u_t + γ ≥ 0, 0 ≤ γ ⟂ μ·r_n − Σβ_j ≥ 0. The matrix is copositive, so Lemke's
//! algorithm ends with a solution where the contacts can hold at all.

use super::{Dantzig, Lemke, Outcome};
use crate::problem::Problem;

/// Number of edges of the friction pyramid's base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facets {
    /// ±t1, ±t2: up to √½ of the friction across the diagonals.
    Four,
    /// And the diagonals: at least 0.92 of it.
    Eight,
}

/// Pivoting method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Lemke (1965).
    Lemke,
    /// Principal pivoting (Cottle and Dantzig 1968).
    Dantzig,
}

/// Work space.
#[derive(Clone, Debug, Default)]
pub struct Pyramid {
    m: Vec<f64>,
    q: Vec<f64>,
    z: Vec<f64>,
    lemke: Lemke,
    dantzig: Dantzig,
}

const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
const EDGES: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [-1.0, 0.0],
    [0.0, 1.0],
    [0.0, -1.0],
    [HALF, HALF],
    [-HALF, -HALF],
    [-HALF, HALF],
    [HALF, -HALF],
];

impl Pyramid {
    /// Solves for r (three components per contact); zero where the outcome is not `Solved`.
    pub fn solve(&mut self, problem: &Problem, facets: Facets, method: Method, r: &mut [f64]) -> Outcome {
        let edges = match facets {
            Facets::Four => &EDGES[..4],
            Facets::Eight => &EDGES[..],
        };
        self.assemble(problem, edges);
        self.z.resize(self.q.len(), 0.0);
        let outcome = match method {
            Method::Lemke => self.lemke.solve(&self.m, &self.q, &mut self.z),
            Method::Dantzig => self.dantzig.solve(&self.m, &self.q, &mut self.z),
        };
        r.fill(0.0);
        let width = edges.len() + 2;
        for (k, z) in self.z.chunks_exact(width).enumerate() {
            r[3 * k] = z[0];
            for (d, beta) in edges.iter().zip(&z[1..]) {
                r[3 * k + 1] += beta * d[0];
                r[3 * k + 2] += beta * d[1];
            }
        }
        outcome
    }

    /// Unknowns per contact: r_n, β, γ. Column-major.
    fn assemble(&mut self, problem: &Problem, edges: &[[f64; 2]]) {
        let (contacts, width) = (problem.contacts(), edges.len() + 2);
        let n = contacts * width;
        // Row or column k of a contact as a combination of its three directions; none for γ.
        let direction = |k: usize| match k {
            0 => Some([1.0, 0.0, 0.0]),
            k if k <= edges.len() => Some([0.0, edges[k - 1][0], edges[k - 1][1]]),
            _ => None,
        };
        self.m.clear();
        self.m.resize(n * n, 0.0);
        self.q.clear();
        self.q.resize(n, 0.0);
        for (row, i) in (0..n).map(|i| (i, i % width)) {
            let Some(left) = direction(i) else { continue };
            let at = 3 * (row / width);
            self.q[row] = (0..3).map(|a| left[a] * problem.q[at + a]).sum();
            for (column, j) in (0..n).map(|j| (j, j % width)) {
                let Some(right) = direction(j) else { continue };
                let to = 3 * (column / width);
                let mut sum = 0.0;
                for a in 0..3 {
                    for b in 0..3 {
                        sum += left[a] * problem.at(at + a, to + b) * right[b];
                    }
                }
                self.m[column * n + row] = sum;
            }
        }
        for k in 0..contacts {
            let (first, gamma) = (k * width, k * width + width - 1);
            self.m[first * n + gamma] = problem.mu[k];
            for j in first + 1..gamma {
                self.m[gamma * n + j] = 1.0;
                self.m[j * n + gamma] = -1.0;
            }
        }
    }
}
