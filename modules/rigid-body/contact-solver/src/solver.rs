//! The order of attack: Newton, then sweeps and Newton in turn, then proximal steps; the best point is kept.

use crate::gauss_seidel;
use crate::newton::{Newton, Shifted};
use crate::problem::Problem;

/// Limits and accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Residual (see [`Problem::residual`]) at which a solution is accepted.
    pub tolerance: f64,
    /// Newton steps in a row.
    pub newton_steps: u32,
    /// Turns of sweeps and Newton before proximal steps are taken.
    pub turns: u32,
    /// Sweeps in the first turn; doubled in each further one.
    pub sweeps: u32,
    /// Proximal steps at most.
    pub proximal_steps: u32,
    /// Added to the diagonal of Newton's matrix, relative to W_nn: steps then stay out of the null space of W and
    /// redundant contacts share a load as evenly as the start does. The solution does not depend on it.
    pub softening: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance: 1e-12, newton_steps: 30, turns: 8, sweeps: 3, proximal_steps: 100, softening: 0.0 }
    }
}

/// The last method that was needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The start solves the problem.
    Start,
    /// Newton's method alone.
    Newton,
    /// Sweeps of exact local solutions, and Newton from there.
    GaussSeidel,
    /// Proximal steps around the other two.
    Proximal,
}

/// Effort and quality of a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Residual of the impulses returned, see [`Problem::residual`].
    pub residual: f64,
    /// Whether it met the tolerance.
    pub converged: bool,
    /// The last method that was needed.
    pub stage: Stage,
    /// Newton steps of all stages.
    pub newton_steps: u32,
    /// Halvings by the line search.
    pub halvings: u32,
    /// Gauss–Seidel sweeps.
    pub sweeps: u32,
    /// Proximal steps.
    pub proximal_steps: u32,
}

/// Buffers, reused from problem to problem: nothing is allocated for a problem no larger than an earlier one.
#[derive(Clone, Debug, Default)]
pub struct Solver {
    newton: Newton,
    u: Vec<f64>,
    best: Vec<f64>,
    shift: Vec<f64>,
    anchor: Vec<f64>,
}

/// First ε of the proximal steps, relative to the contact's own W_nn.
const FIRST_SHIFT: f64 = 1e-2;
/// Smallest and largest ε.
const SHIFTS: [f64; 2] = [1e-10, 1e2];

impl Solver {
    /// With room for problems of so many contacts.
    pub fn with_room(contacts: usize) -> Self {
        let numbers = || Vec::with_capacity(3 * contacts);
        Self {
            newton: Newton::with_room(contacts),
            u: numbers(),
            best: numbers(),
            shift: Vec::with_capacity(contacts),
            anchor: numbers(),
        }
    }

    /// Solves for r, starting from the content of r; r is the best point found even if the tolerance was not met.
    pub fn solve(&mut self, problem: &Problem, options: &Options, r: &mut [f64]) -> Report {
        let n = problem.q.len();
        self.u.resize(n, 0.0);
        self.shift.clear();
        self.shift.resize(problem.contacts(), 0.0);
        self.anchor.clear();
        self.anchor.resize(n, 0.0);
        self.best.clear();
        self.best.resize(n, 0.0);
        if r.iter().any(|r| !r.is_finite()) {
            r.fill(0.0);
        }
        let mut report = Report {
            residual: f64::INFINITY,
            converged: false,
            stage: Stage::Start,
            newton_steps: 0,
            halvings: 0,
            sweeps: 0,
            proximal_steps: 0,
        };
        problem.velocity(r, &mut self.u);
        self.keep_best(problem, options, r, &mut report);
        if !report.converged {
            report.stage = Stage::Newton;
            self.newton(problem, options, options.softening, r, &mut report);
        }
        if !report.converged {
            report.stage = Stage::GaussSeidel;
            self.take_turns(problem, options, r, &mut report);
        }
        if !report.converged {
            report.stage = Stage::Proximal;
            self.proximal(problem, options, r, &mut report);
        }
        r.copy_from_slice(&self.best);
        report
    }

    /// Remembers r if it is the best point so far.
    fn keep_best(&mut self, problem: &Problem, options: &Options, r: &[f64], report: &mut Report) {
        let residual = problem.residual(r, &self.u);
        if residual < report.residual {
            report.residual = residual;
            self.best.copy_from_slice(r);
            report.converged = residual <= options.tolerance;
        }
    }

    fn newton(
        &mut self,
        problem: &Problem,
        options: &Options,
        softening: f64,
        r: &mut [f64],
        report: &mut Report,
    ) {
        let shifted = Shifted { problem, shift: &self.shift, anchor: &self.anchor };
        let done = |r: &[f64], u: &[f64]| problem.residual(r, u) <= options.tolerance;
        let run = self.newton.run(&shifted, softening, options.newton_steps, r, &mut self.u, done);
        report.newton_steps += run.steps;
        report.halvings += run.halvings;
        self.keep_best(problem, options, r, report);
    }

    fn take_turns(&mut self, problem: &Problem, options: &Options, r: &mut [f64], report: &mut Report) {
        let mut sweeps = options.sweeps;
        r.copy_from_slice(&self.best);
        problem.velocity(r, &mut self.u);
        for _ in 0..options.turns {
            let shifted = Shifted { problem, shift: &self.shift, anchor: &self.anchor };
            for _ in 0..sweeps {
                report.sweeps += 1;
                gauss_seidel::sweep(&shifted, r, &mut self.u);
            }
            problem.velocity(r, &mut self.u);
            self.keep_best(problem, options, r, report);
            if report.converged {
                return;
            }
            let back = sweeps;
            self.newton(problem, options, options.softening, r, report);
            if report.converged {
                return;
            }
            sweeps = 2 * back;
        }
    }

    /// r ← solution of the problem with ε·(r⁺ − r) added to u: well-posed however redundant the contacts are.
    fn proximal(&mut self, problem: &Problem, options: &Options, r: &mut [f64], report: &mut Report) {
        r.copy_from_slice(&self.best);
        let mut epsilon = FIRST_SHIFT;
        for _ in 0..options.proximal_steps {
            report.proximal_steps += 1;
            for k in 0..problem.contacts() {
                self.shift[k] = epsilon * problem.at(3 * k, 3 * k);
            }
            self.anchor.copy_from_slice(r);
            let solved = self.proximal_point(problem, options, r, report);
            problem.velocity(r, &mut self.u);
            self.keep_best(problem, options, r, report);
            if report.converged {
                break;
            }
            epsilon = (if solved { 0.2 * epsilon } else { 10.0 * epsilon }).clamp(SHIFTS[0], SHIFTS[1]);
        }
        self.shift.fill(0.0);
    }

    fn proximal_point(
        &mut self,
        problem: &Problem,
        options: &Options,
        r: &mut [f64],
        report: &mut Report,
    ) -> bool {
        let shifted = Shifted { problem, shift: &self.shift, anchor: &self.anchor };
        let goal = 0.1 * options.tolerance;
        let done = |r: &[f64], u: &[f64]| problem.residual(r, u) <= goal;
        for _ in 0..3 {
            shifted.velocity(r, &mut self.u);
            let run = self.newton.run(&shifted, 0.0, options.newton_steps, r, &mut self.u, done);
            report.newton_steps += run.steps;
            report.halvings += run.halvings;
            if run.converged {
                return true;
            }
            for _ in 0..options.sweeps {
                report.sweeps += 1;
                gauss_seidel::sweep(&shifted, r, &mut self.u);
            }
        }
        false
    }
}
