//! Semismooth Newton on Alart and Curnier's function (1991) with a line search on its norm.
//!
//! Per contact, with a = r_n − ρ_n·u_n, b = r_t − ρ_t·u_t: F_n = r_n − max(a, 0), F_t = r_t − P(b) where P projects on
//! the disc of radius μ·max(a, 0). F is in impulse units; its generalised Jacobian follows from the branch of each
//! contact (open, sticking, sliding). Without the line search half of the problems that robots make run in circles.
//! u is affine in r, so a step of the line search costs no product with W.

use crate::cone::norm2;
use crate::dense;
use crate::problem::Problem;

/// Smallest step of the line search.
const SMALLEST_STEP: f64 = 1.0 / 4096.0;
/// Sufficient decrease (Armijo).
const DECREASE: f64 = 1e-4;
/// At a kink no step may lower the norm although the next branches would. So many full steps are then taken all the
/// same (the watchdog of Chamberlain et al. 1982), before other methods get their turn.
const LEAPS: u32 = 2;
/// Pivots below this share of the largest entry count as zero.
const SINGULAR: f64 = 1e-15;

/// u = W·r + q + shift·(r − anchor): the problem itself (shift 0) or one proximal step.
pub(crate) struct Shifted<'a> {
    pub problem: &'a Problem<'a>,
    /// Per contact, 1/kg.
    pub shift: &'a [f64],
    pub anchor: &'a [f64],
}

impl Shifted<'_> {
    pub fn velocity(&self, r: &[f64], u: &mut [f64]) {
        self.problem.velocity(r, u);
        for (i, u) in u.iter_mut().enumerate() {
            *u += self.shift[i / 3] * (r[i] - self.anchor[i]);
        }
    }
}

/// Branch of a contact at the point of linearisation.
#[derive(Clone, Copy, Debug)]
enum Branch {
    Open,
    Stick,
    /// Direction d of b and the ratio of the disc's radius to |b|; both 0 without friction.
    Slide {
        d: [f64; 2],
        ratio: f64,
    },
}

/// Outcome of a run of Newton steps.
pub(crate) struct Run {
    pub steps: u32,
    pub halvings: u32,
    /// Full steps taken although the norm grew.
    pub leaps: u32,
    /// Whether `done` was met.
    pub converged: bool,
}

/// Buffers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Newton {
    branches: Vec<Branch>,
    active: Vec<usize>,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
    step: Vec<f64>,
    /// W·step, shift included.
    motion: Vec<f64>,
    rho: Vec<[f64; 2]>,
    trial_r: Vec<f64>,
    trial_u: Vec<f64>,
}

impl Newton {
    /// With room for so many contacts.
    pub fn with_room(contacts: usize) -> Self {
        let n = 3 * contacts;
        let numbers = || Vec::with_capacity(n);
        Self {
            branches: Vec::with_capacity(contacts),
            active: Vec::with_capacity(n),
            matrix: Vec::with_capacity(n * n),
            rhs: numbers(),
            step: numbers(),
            motion: numbers(),
            rho: Vec::with_capacity(contacts),
            trial_r: numbers(),
            trial_u: numbers(),
        }
    }

    /// Steps from r (with its u) until `done(r, u)`, the limit, or no decrease.
    pub fn run(
        &mut self,
        s: &Shifted,
        softening: f64,
        limit: u32,
        r: &mut [f64],
        u: &mut [f64],
        mut done: impl FnMut(&[f64], &[f64]) -> bool,
    ) -> Run {
        let n = r.len();
        self.prepare(s, n);
        let mut run = Run { steps: 0, halvings: 0, leaps: 0, converged: false };
        let mut merit = self.merit(s.problem.mu, r, u);
        while run.steps < limit {
            if done(r, u) {
                run.converged = true;
                break;
            }
            if !merit.is_finite() {
                break;
            }
            self.direction(s, softening, r, u);
            run.steps += 1;
            let found = self.search(s.problem.mu, merit, r, u);
            let (step, halvings) = match found {
                Some(found) => found,
                None if run.leaps < LEAPS => (1.0, 0),
                None => break,
            };
            run.halvings += halvings;
            run.leaps += u32::from(found.is_none());
            r.iter_mut().zip(&self.step).for_each(|(r, d)| *r += step * d);
            // From scratch: rounding of the updates would otherwise stay.
            s.velocity(r, u);
            merit = self.merit(s.problem.mu, r, u);
        }
        run.converged |= done(r, u);
        run
    }

    fn prepare(&mut self, s: &Shifted, n: usize) {
        self.step.resize(n, 0.0);
        self.motion.resize(n, 0.0);
        self.trial_r.resize(n, 0.0);
        self.trial_u.resize(n, 0.0);
        self.rho.clear();
        self.rho.extend((0..n / 3).map(|k| {
            let d = |c: usize| s.problem.at(3 * k + c, 3 * k + c) + s.shift[k];
            let tangential = 0.5 * (d(1) + d(2));
            [1.0 / d(0), if tangential > 0.0 { 1.0 / tangential } else { 1.0 / d(0) }]
        }));
    }

    /// ½‖F‖² .
    fn merit(&self, mu: &[f64], r: &[f64], u: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (k, (r, u)) in r.chunks_exact(3).zip(u.chunks_exact(3)).enumerate() {
            let [rho_n, rho_t] = self.rho[k];
            let a = (r[0] - rho_n * u[0]).max(0.0);
            let b = [r[1] - rho_t * u[1], r[2] - rho_t * u[2]];
            let (size, radius) = (norm2(b), mu[k] * a);
            let factor = if size > radius { radius / size } else { 1.0 };
            let f = [r[0] - a, r[1] - factor * b[0], r[2] - factor * b[1]];
            sum += f[0] * f[0] + f[1] * f[1] + f[2] * f[2];
        }
        0.5 * sum
    }

    fn branch(&self, k: usize, mu: f64, r: &[f64], u: &[f64]) -> Branch {
        let [rho_n, rho_t] = self.rho[k];
        let at = 3 * k;
        let a = r[at] - rho_n * u[at];
        if a <= 0.0 {
            return Branch::Open;
        }
        if mu <= 0.0 {
            return Branch::Slide { d: [0.0; 2], ratio: 0.0 };
        }
        let b = [r[at + 1] - rho_t * u[at + 1], r[at + 2] - rho_t * u[at + 2]];
        let (size, radius) = (norm2(b), mu * a);
        if size <= radius {
            return Branch::Stick;
        }
        Branch::Slide { d: [b[0] / size, b[1] / size], ratio: radius / size }
    }

    /// Newton's step into `self.step`, W·step into `self.motion`.
    fn direction(&mut self, s: &Shifted, softening: f64, r: &[f64], u: &[f64]) {
        let n = r.len();
        self.branches.clear();
        self.active.clear();
        for k in 0..n / 3 {
            let branch = self.branch(k, s.problem.mu[k], r, u);
            if !matches!(branch, Branch::Open) {
                self.active.push(k);
            }
            self.branches.push(branch);
        }
        let m = 3 * self.active.len();
        self.matrix.clear();
        self.matrix.resize(m * m, 0.0);
        self.rhs.clear();
        self.rhs.resize(m, 0.0);
        for row in 0..self.active.len() {
            self.fill_rows(s, softening, row, r, u);
        }
        dense::solve(m, &mut self.matrix, &mut self.rhs, SINGULAR);
        for (d, r) in self.step.iter_mut().zip(r) {
            *d = -r;
        }
        for (i, k) in self.active.iter().enumerate() {
            self.step[3 * k..3 * k + 3].copy_from_slice(&self.rhs[3 * i..3 * i + 3]);
        }
        for (i, motion) in self.motion.iter_mut().enumerate() {
            let row = &s.problem.w[i * n..(i + 1) * n];
            *motion =
                row.iter().zip(&self.step).map(|(w, d)| w * d).sum::<f64>() + s.shift[i / 3] * self.step[i];
        }
    }

    /// The three rows A·dr + B·(W·dr) = −F of an active contact.
    fn fill_rows(&mut self, s: &Shifted, softening: f64, row: usize, r: &[f64], u: &[f64]) {
        let (n, m, k) = (r.len(), 3 * self.active.len(), self.active[row]);
        let (at, [rho_n, rho_t], mu) = (3 * k, self.rho[k], s.problem.mu[k]);
        // B per row: factors of W's normal and tangential rows.
        let (b, a, f) = match self.branches[k] {
            Branch::Slide { d, ratio } => {
                let turn = |i: usize, j: usize| ratio * (f64::from(u8::from(i == j)) - d[i] * d[j]);
                let radius = mu * (r[at] - rho_n * u[at]);
                let b = [
                    [rho_n, 0.0, 0.0],
                    [rho_n * mu * d[0], rho_t * turn(0, 0), rho_t * turn(0, 1)],
                    [rho_n * mu * d[1], rho_t * turn(1, 0), rho_t * turn(1, 1)],
                ];
                let a = [
                    [0.0; 3],
                    [-mu * d[0], 1.0 - turn(0, 0), -turn(0, 1)],
                    [-mu * d[1], -turn(1, 0), 1.0 - turn(1, 1)],
                ];
                let f = [rho_n * u[at], r[at + 1] - radius * d[0], r[at + 2] - radius * d[1]];
                (b, a, f)
            }
            _ => {
                let b = [[rho_n, 0.0, 0.0], [0.0, rho_t, 0.0], [0.0, 0.0, rho_t]];
                (b, [[0.0; 3]; 3], [rho_n * u[at], rho_t * u[at + 1], rho_t * u[at + 2]])
            }
        };
        let w = &s.problem.w[at * n..(at + 3) * n];
        for i in 0..3 {
            let bi = b[i];
            let out = &mut self.matrix[(3 * row + i) * m..(3 * row + i + 1) * m];
            for (out, other) in out.chunks_exact_mut(3).zip(&self.active) {
                for (j, out) in out.iter_mut().enumerate() {
                    let c = 3 * other + j;
                    *out = bi[0] * w[c] + bi[1] * w[n + c] + bi[2] * w[2 * n + c];
                }
            }
            for j in 0..3 {
                out[3 * row + j] += a[i][j] + bi[j] * (s.shift[k] + softening / rho_n);
            }
            // Open contacts give up their impulse in this step.
            let mut rhs = -f[i];
            for (k, branch) in self.branches.iter().enumerate() {
                if matches!(branch, Branch::Open) {
                    for c in 3 * k..3 * k + 3 {
                        if r[c] != 0.0 {
                            rhs += r[c] * (bi[0] * w[c] + bi[1] * w[n + c] + bi[2] * w[2 * n + c]);
                        }
                    }
                }
            }
            self.rhs[3 * row + i] = rhs;
        }
    }

    /// The first of 1, ½, ¼ … with sufficient decrease: step and halvings.
    fn search(&mut self, mu: &[f64], merit: f64, r: &[f64], u: &[f64]) -> Option<(f64, u32)> {
        let (mut step, mut halvings) = (1.0, 0);
        while step >= SMALLEST_STEP {
            let (mut trial_r, mut trial_u) =
                (std::mem::take(&mut self.trial_r), std::mem::take(&mut self.trial_u));
            for i in 0..r.len() {
                trial_r[i] = r[i] + step * self.step[i];
                trial_u[i] = u[i] + step * self.motion[i];
            }
            let trial = self.merit(mu, &trial_r, &trial_u);
            (self.trial_r, self.trial_u) = (trial_r, trial_u);
            if trial <= (1.0 - 2.0 * DECREASE * step) * merit {
                return Some((step, halvings));
            }
            step *= 0.5;
            halvings += 1;
        }
        None
    }
}
