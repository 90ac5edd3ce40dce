//! T*: the wrenches that would hold every contact rigidly at the end of the step.
//!
//! First the normals: 0 ≤ T ⟂ x_free + G·T − x2 ≥ 0 by Lemke. Six feet on one body make G singular (rank 3), so
//! the problem is solved with G + ε·1 and then by proximal steps (gap − ε·T_previous), which lead to the normals of
//! smallest norm whatever the order of the feet (Rockafellar 1976). Then normals and sticking components
//! together, starting from there, each port within its friction |T_t| ≤ μ·T_n and, for patches, its moments
//! within the footprint; a component that would exceed a bound is put on it. A port that opens because it cannot both
//! stick and press, and then has to close again, slips.
//!
//! If the block of G in hand is far from singular, the proximal point is its only solution and comes from one
//! factorisation of G itself; the active normals then come from a few guesses, and Lemke's algorithm solves those that
//! the guesses miss.
//!
//! Wheels that rigid motors hold against each other cannot all keep their place: then the joint solution has no bound
//! or its rounds no end. Sweeps over the ports (projected Gauss–Seidel) that stay within friction and footprint then
//! give another answer, and the one with the smaller defect counts.

use crate::lcp::{Lemke, Outcome};
use terraglue_numerics::dense::multiply_add;
use terraglue_numerics::in_place::{cholesky, cholesky_above, cholesky_solve, lu, lu_solve, rank};
use terraglue_subsystem::Port;

/// ε as a share of the mean diagonal of G.
const REGULARISATION: f64 = 1e-4;
/// Mean diagonal of G (m/N, rad/(N m)) up to which a force moves nothing: guides and velocity motors hold it.
const IMMOBILE: f64 = 1e-12;
/// ε there. The force between a rigid ground and a rigid motor is unbounded; with this it exceeds any motor's, so that
/// the motor's bound decides in the next round.
const IMMOBILE_REGULARISATION: f64 = 1e-9;
/// Proximal steps: at least, at most, and the relative change at which they end.
const PROXIMAL_MIN: usize = 4;
const PROXIMAL_MAX: usize = 40;
const PROXIMAL_CHANGE: f64 = 1e-12;
/// Increments of proximal steps that are the one before times a factor above this, to this share of them, go on like that.
const SLOW: f64 = 0.9;
const STEADY: f64 = 3e-3;
/// Still so large a share of T in the last proximal step: the components cannot be held, and T grows with every step.
const GROWS: f64 = 1e-2;
/// Relative change at which components that slip with their normal force have converged.
const ARRIVED: f64 = 1e-9;
/// Pivots of G above this share of its diagonal: the block is solved as it is. Proximal steps lead to the same then.
const REGULAR: f64 = REGULARISATION;
/// Guesses of the active normals before Lemke.
const GUESSES: usize = 6;
/// Rounds in which ports change between open, sticking and slipping.
const MAX_ROUNDS: usize = 24;
/// Motion that counts as closing, as a share of the motion under the largest wrench.
const NOTICED: f64 = 1e-9;
/// A port that closes again so often within a step goes round in a circle.
const MOST_CLOSINGS: u32 = 4;
/// Sweeps where rounds have no end, and the relative change that ends them.
const SWEEPS: usize = 200;
const SWEEP_CHANGE: f64 = 1e-9;

/// Present status of a component.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Status {
    /// No wrench: the port is open.
    Open,
    /// Unknown of the linear system: motion equals the partner's.
    Held,
    /// On its friction bound.
    Slipping,
}

/// The contact problem in hand. All slices are packed; signs are those of the wrench on side 1.
pub(crate) struct Problem<'a> {
    pub ports: &'a [Port],
    /// d(x1 − x2)/dT, n × n, column-major.
    pub g: &'a [f64],
    /// x_free − x2.
    pub gap: &'a [f64],
}

/// Buffers of the estimate.
#[derive(Default)]
pub(crate) struct Estimator {
    lemke: Lemke,
    status: Vec<Status>,
    /// Per component: ε of its class.
    epsilon: Vec<f64>,
    unknowns: Vec<usize>,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
    /// The increment of the proximal step before.
    last: Vec<f64>,
    normals: Vec<usize>,
    normal_gap: Vec<f64>,
    normal_rhs: Vec<f64>,
    solution: Vec<f64>,
    /// Motion left open by all components.
    open: Vec<f64>,
    /// Components that slip in proportion to a normal force: component, which unknown, ratio.
    slipping: Vec<(usize, usize, f64)>,
    /// Order of the rows of a factor.
    order: Vec<usize>,
    /// T before a round.
    before: Vec<f64>,
    /// State of the rounds when they ended without a result.
    rounds: Vec<f64>,
    /// Per port: how often it has closed since it opened first.
    closings: Vec<u32>,
    /// Which normals press, as guessed.
    pressing: Vec<usize>,
}

fn largest(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.fold(0.0_f64, |a, x| a.max(x.abs()))
}

fn unilateral(port: &Port) -> bool {
    port.law.t_min >= 0.0
}

impl Estimator {
    /// Solves for T*; `Err` has the reason why there is none. Returns whether the normals are unique.
    pub fn solve(&mut self, p: &Problem, t: &mut [f64]) -> Result<bool, &'static str> {
        t.fill(0.0);
        self.classify(p);
        let unique = match self.guess_normals(p, t) {
            true => true,
            false => {
                self.solve_normals(p, t)?;
                self.normals_unique(p, t)
            }
        };
        for port in p.ports {
            let open = unilateral(port) && t[port.first as usize] <= 0.0;
            self.status[port.range()].fill(if open { Status::Open } else { Status::Held });
        }
        self.closings.clear();
        self.closings.resize(p.ports.len(), 0);
        for _ in 0..MAX_ROUNDS {
            let converged = self.solve_held(p, t)?;
            if !self.change_status(p, t) {
                if converged {
                    return Ok(unique);
                }
                break;
            }
            if self.closings.iter().any(|n| *n > MOST_CLOSINGS) {
                break;
            }
        }
        self.rounds.clear();
        self.rounds.extend_from_slice(t);
        t.fill(0.0);
        self.normals.iter().zip(&self.solution).for_each(|(i, s)| t[*i] = *s);
        sweep(p, t);
        if defect(p, &mut self.rounds) < defect(p, t) {
            t.copy_from_slice(&self.rounds);
        }
        Ok(false)
    }

    /// Room for `n` components, however many of them will be held.
    fn make_room(&mut self, n: usize) {
        fn room<T>(buffer: &mut Vec<T>, n: usize) {
            buffer.reserve(n.saturating_sub(buffer.len()));
        }
        for numbers in [&mut self.unknowns, &mut self.normals, &mut self.order, &mut self.pressing] {
            room(numbers, n);
        }
        let all =
            [&mut self.rhs, &mut self.last, &mut self.normal_gap, &mut self.normal_rhs, &mut self.solution];
        all.into_iter().chain([&mut self.open, &mut self.before, &mut self.rounds]).for_each(|v| room(v, n));
        room(&mut self.matrix, n * n);
        room(&mut self.slipping, n);
    }

    fn classify(&mut self, p: &Problem) {
        let n = p.gap.len();
        self.make_room(n);
        self.status.clear();
        self.status.resize(n, Status::Open);
        self.normals.clear();
        let normals = p.ports.iter().filter(|q| unilateral(q) && q.mask & 1 != 0);
        self.normals.extend(normals.map(|q| q.first as usize));
        // Means of the diagonal of normals, tangential forces, moments.
        let class = |c: usize| [0, 1, 1, 2, 2, 2][c];
        let (mut sum, mut count) = ([0.0; 3], [0.0; 3]);
        for (i, c) in p.ports.iter().flat_map(Port::components) {
            sum[class(c)] += p.g[i * n + i];
            count[class(c)] += 1.0;
        }
        self.epsilon.clear();
        self.epsilon.resize(n, 0.0);
        for (i, c) in p.ports.iter().flat_map(Port::components) {
            let mean = sum[class(c)] / count[class(c)];
            self.epsilon[i] = if mean > IMMOBILE { REGULARISATION * mean } else { IMMOBILE_REGULARISATION };
        }
    }

    /// The normals alone where a few guesses at which of them press find them and they are unique; false: Lemke has to.
    fn guess_normals(&mut self, p: &Problem, t: &mut [f64]) -> bool {
        let n = p.gap.len();
        if self.normals.iter().any(|i| self.epsilon[*i] == IMMOBILE_REGULARISATION) {
            return false;
        }
        let Self { normals, pressing, unknowns, matrix, rhs, .. } = self;
        pressing.clear();
        pressing.extend(normals.iter().copied().filter(|i| p.gap[*i] < 0.0));
        for _ in 0..GUESSES {
            let m = pressing.len();
            matrix.clear();
            pressing.iter().for_each(|c| matrix.extend(pressing.iter().map(|r| p.g[c * n + r])));
            if !cholesky_above(m, matrix, REGULAR) {
                break;
            }
            rhs.clear();
            rhs.extend(pressing.iter().map(|i| -p.gap[*i]));
            cholesky_solve(m, matrix, rhs);
            pressing.iter().zip(&*rhs).for_each(|(i, s)| t[*i] = *s);
            let size = largest(rhs.iter().copied());
            unknowns.clear();
            unknowns.extend(normals.iter().copied().filter(|i| match pressing.binary_search(i) {
                Ok(_) => t[*i] >= 0.0,
                Err(_) => residual(p, t, *i) < -NOTICED * p.g[i * n + i] * size,
            }));
            if unknowns == pressing {
                self.solution.clear();
                self.solution.extend(normals.iter().map(|i| t[*i]));
                return true;
            }
            pressing.iter().for_each(|i| t[*i] = 0.0);
            std::mem::swap(unknowns, pressing);
        }
        t.fill(0.0);
        false
    }

    /// The normals alone, of minimum norm.
    fn solve_normals(&mut self, p: &Problem, t: &mut [f64]) -> Result<(), &'static str> {
        let (n, m) = (p.gap.len(), self.normals.len());
        let normals = &self.normals;
        let entry = |r: usize, c: usize| p.g[normals[c] * n + normals[r]];
        self.matrix.clear();
        for (c, column) in normals.iter().enumerate() {
            let epsilon = self.epsilon[*column];
            self.matrix.extend((0..m).map(|r| entry(r, c) + if r == c { epsilon } else { 0.0 }));
        }
        self.normal_gap.clear();
        self.normal_gap.extend(normals.iter().map(|i| p.gap[*i]));
        self.solution.clear();
        self.solution.resize(m, 0.0);
        for _ in 0..=PROXIMAL_MIN {
            self.normal_rhs.clear();
            let steps = self.normal_gap.iter().zip(&self.solution).zip(normals);
            self.normal_rhs.extend(steps.map(|((gap, t), i)| gap - self.epsilon[*i] * t));
            match self.lemke.solve(&self.matrix, &self.normal_rhs, &mut self.solution) {
                Outcome::Solved(_) => {}
                Outcome::Ray(_) => return Err("the contact problem has no solution (secondary ray)"),
                Outcome::PivotLimit(_) => return Err("the contact problem is too badly scaled to be solved"),
            }
        }
        normals.iter().zip(&self.solution).for_each(|(i, s)| t[*i] = *s);
        Ok(())
    }

    fn normals_unique(&mut self, p: &Problem, t: &[f64]) -> bool {
        let n = p.gap.len();
        self.unknowns.clear();
        self.unknowns.extend(self.normals.iter().copied().filter(|i| t[*i] > 0.0));
        self.matrix.clear();
        for c in &self.unknowns {
            self.matrix.extend(self.unknowns.iter().map(|r| p.g[c * n + r]));
        }
        let m = self.unknowns.len();
        rank(m, &mut self.matrix, 1e-9) == m
    }

    /// Motion of all held components equals the partner's; the proximal point nearest to the present T. Slipping
    /// components follow the normal force of their port where that can be solved, else stay. False: there is none.
    fn solve_held(&mut self, p: &Problem, t: &mut [f64]) -> Result<bool, &'static str> {
        let n = p.gap.len();
        self.unknowns.clear();
        self.unknowns.extend((0..n).filter(|i| self.status[*i] == Status::Held));
        let m = self.unknowns.len();
        if m == 0 {
            return Ok(true);
        }
        self.follow_normals(p, t);
        if !self.slipping.is_empty() {
            self.before.clear();
            self.before.extend_from_slice(t);
            if let Some(regular) = self.factor_slipping(p) {
                let (converged, arrived) = self.approach(p, t, regular);
                if arrived {
                    return Ok(converged);
                }
            }
            t.copy_from_slice(&self.before);
            self.slipping.clear();
        }
        self.fill_matrix(p, false);
        let regular = self.mobile() && cholesky_above(m, &mut self.matrix, REGULAR);
        if !regular {
            self.fill_matrix(p, true);
            if !cholesky(m, &mut self.matrix) {
                return Err("the compliance of the contacts is not positive definite");
            }
        }
        Ok(self.approach(p, t, regular).0)
    }

    /// Whether forces move all unknowns.
    fn mobile(&self) -> bool {
        !self.unknowns.iter().any(|i| self.epsilon[*i] == IMMOBILE_REGULARISATION)
    }

    /// Factorises the system with slip that follows the normals: as it is (true), or with ε; none where it is singular.
    fn factor_slipping(&mut self, p: &Problem) -> Option<bool> {
        let (n, m) = (p.gap.len(), self.unknowns.len());
        if self.mobile() {
            self.fill_matrix(p, false);
            let factored = lu(m, &mut self.matrix, &mut self.order);
            let pivots = (0..m).map(|j| self.matrix[j * m + j].abs());
            let mut pairs = pivots.zip(&self.unknowns);
            if factored && pairs.all(|(pivot, i)| pivot > REGULAR * p.g[i * n + i]) {
                return Some(true);
            }
        }
        self.fill_matrix(p, true);
        lu(m, &mut self.matrix, &mut self.order).then_some(false)
    }

    /// Lists the components that slip in proportion to an unknown normal force: component, unknown, ratio.
    fn follow_normals(&mut self, p: &Problem, t: &[f64]) {
        self.slipping.clear();
        for port in p.ports.iter().filter(|port| unilateral(port)) {
            let first = port.first as usize;
            let Ok(normal) = self.unknowns.binary_search(&first) else { continue };
            for (i, _) in port.components().filter(|(i, _)| self.status[*i] == Status::Slipping) {
                if t[first] > 0.0 {
                    self.slipping.push((i, normal, t[i] / t[first]));
                }
            }
        }
    }

    /// G of the unknowns, or G + ε, with the slipping components.
    fn fill_matrix(&mut self, p: &Problem, regularised: bool) {
        let (n, m) = (p.gap.len(), self.unknowns.len());
        self.matrix.clear();
        for (k, c) in self.unknowns.iter().enumerate() {
            self.matrix.extend(self.unknowns.iter().map(|r| p.g[c * n + r]));
            if regularised {
                self.matrix[k * m + k] += self.epsilon[*c];
            }
        }
        for (i, normal, ratio) in &self.slipping {
            let column = &mut self.matrix[normal * m..(normal + 1) * m];
            column.iter_mut().zip(&self.unknowns).for_each(|(a, r)| *a += ratio * p.g[i * n + r]);
        }
    }

    /// Proximal steps with the factor at hand, or the solution and a step that refines it where the factor is that of G
    /// itself; whether T stays bounded, and whether it has arrived.
    fn approach(&mut self, p: &Problem, t: &mut [f64], regular: bool) -> (bool, bool) {
        let m = self.unknowns.len();
        let least = if regular { 1 } else { PROXIMAL_MIN };
        let (mut converged, mut change, mut size) = (true, f64::INFINITY, 0.0);
        for step in 0..PROXIMAL_MAX {
            // In increments: (G + ε)·dT = −(x_free + G·T − x2), exact to rounding at any size of T.
            residuals(p, t, &mut self.open);
            std::mem::swap(&mut self.rhs, &mut self.last);
            self.rhs.clear();
            self.rhs.extend(self.unknowns.iter().map(|i| -self.open[*i]));
            if self.slipping.is_empty() {
                cholesky_solve(m, &self.matrix, &mut self.rhs);
            } else {
                lu_solve(m, &self.matrix, &self.order, &mut self.rhs);
            }
            self.advance(t, 1.0);
            change = largest(self.rhs.iter().copied());
            // components that rigid motors alone hold grow until the motors' bounds decide in the next round
            let mobile = |(k, _): &(usize, &f64)| self.epsilon[self.unknowns[*k]] != IMMOBILE_REGULARISATION;
            let mut growth = largest(self.rhs.iter().enumerate().filter(mobile).map(|(_, x)| *x));
            let steady = if step >= least && !regular { self.steady(step) } else { None };
            if let Some((sum, last)) = steady {
                self.advance(t, sum);
                (change, growth) = (last * change, last * growth);
            }
            size = largest(t.iter().copied());
            converged = growth <= GROWS * size;
            if steady.is_some() || (step >= least && change <= PROXIMAL_CHANGE * size) {
                break;
            }
        }
        (converged, change <= ARRIVED * size && size.is_finite())
    }

    /// Takes a share of the increment in hand.
    fn advance(&self, t: &mut [f64], share: f64) {
        self.unknowns.iter().zip(&self.rhs).for_each(|(i, d)| t[*i] += share * d);
        self.slipping.iter().for_each(|(i, normal, ratio)| t[*i] = ratio * t[self.unknowns[*normal]]);
    }

    /// Where each increment is the one before times a factor near one, as where nothing holds some components and T grows
    /// with every step: the sum of all increments to come after `step`, and the last of them, over the one in hand.
    fn steady(&self, step: usize) -> Option<(f64, f64)> {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (square, before) = (product(&self.rhs, &self.rhs), product(&self.last, &self.last));
        let factor = product(&self.rhs, &self.last) / before;
        let off = square - factor * factor * before;
        if !(factor > SLOW && factor <= 1.0 && off <= STEADY * STEADY * square) {
            return None;
        }
        let (mut sum, mut last) = (0.0, 1.0);
        for _ in step + 1..PROXIMAL_MAX {
            last *= factor;
            sum += last;
        }
        Some((sum, last))
    }

    /// Opens, closes, clips; true when something changed noticeably.
    fn change_status(&mut self, p: &Problem, t: &mut [f64]) -> bool {
        let size = largest(t.iter().copied());
        let mut changed = false;
        for (k, port) in p.ports.iter().enumerate() {
            let first = port.first as usize;
            if unilateral(port) {
                let open = self.status[first] == Status::Open;
                if !open && t[first] < 0.0 {
                    self.status[port.range()].fill(Status::Open);
                    t[port.range()].fill(0.0);
                    self.closings[k] = self.closings[k].max(1);
                    changed = true;
                    continue;
                }
                if open {
                    let diagonal = p.g[first * p.gap.len() + first];
                    if residual(p, t, first) < -NOTICED * diagonal * size {
                        self.close(p, k, t);
                        changed = true;
                    }
                    continue;
                }
                changed |= self.clip(port, t, 1e-10 * size);
            }
        }
        changed
    }

    /// Closes a port: it sticks, but where it has opened within this step, because it cannot stick and press, it slips.
    fn close(&mut self, p: &Problem, k: usize, t: &mut [f64]) {
        let port = &p.ports[k];
        self.status[port.range()].fill(Status::Held);
        if self.closings[k] == 0 {
            return;
        }
        self.closings[k] += 1;
        relax_port(p, port, t);
        for (mask, bound) in bounds(port, t) {
            let of = move |c: &(usize, usize)| mask & (1 << c.1) != 0;
            let size = port.components().filter(of).map(|(i, _)| t[i] * t[i]).sum::<f64>().sqrt();
            if size > 0.0 && bound.is_finite() {
                for (i, _) in port.components().filter(of) {
                    t[i] *= bound / size;
                    self.status[i] = Status::Slipping;
                }
            }
        }
    }

    /// Puts the tangential force and the moments of a closed port within their bounds.
    fn clip(&mut self, port: &Port, t: &mut [f64], noticeable: f64) -> bool {
        let mut changed = false;
        for (mask, bound) in bounds(port, t) {
            let of = move |c: &(usize, usize)| mask & (1 << c.1) != 0;
            let squares: f64 = port.components().filter(of).map(|(i, _)| t[i] * t[i]).sum();
            let size = squares.sqrt();
            let slipping = port.components().filter(of).any(|(i, _)| self.status[i] == Status::Slipping);
            if size <= 0.0 || !bound.is_finite() || (size <= bound && !slipping) {
                continue;
            }
            for (i, _) in port.components().filter(of) {
                t[i] *= bound / size;
                self.status[i] = Status::Slipping;
            }
            changed |= !slipping || (size - bound).abs() > noticeable;
        }
        changed
    }
}

/// Bounds that the normal force of a port sets to the size of its tangential force and moments: which components.
fn bounds(port: &Port, t: &[f64]) -> [(u32, f64); 4] {
    let normal = t[port.first as usize].max(0.0);
    let extent = port.extent[0].max(port.extent[1]);
    [
        (0b000110, port.law.mu * normal),
        (0b001000, port.law.mu * normal * extent),
        (0b010000, normal * port.extent[1]),
        (0b100000, normal * port.extent[0]),
    ]
}

/// Sweeps over the ports from the present T: each component on its own, then clipped to its bound.
fn sweep(p: &Problem, t: &mut [f64]) {
    for _ in 0..SWEEPS {
        let (mut change, mut size) = (0.0_f64, 0.0_f64);
        for port in p.ports {
            let before = relax_port(p, port, t);
            for (i, c) in port.components() {
                change = change.max((t[i] - before[c]).abs());
                size = size.max(t[i].abs());
            }
        }
        if change <= SWEEP_CHANGE * size {
            break;
        }
    }
}

/// By how much the ports would move, m and rad, if each settled on its own.
fn defect(p: &Problem, t: &mut [f64]) -> f64 {
    let mut sum = 0.0;
    for port in p.ports {
        let before = relax_port(p, port, t);
        for (i, c) in port.components() {
            sum += compliance(p, i) * (t[i] - before[c]).abs();
            t[i] = before[c];
        }
    }
    sum
}

/// One port settles while all others keep their wrenches: the normal, both tangential forces at once, each moment. Its
/// wrench before.
fn relax_port(p: &Problem, port: &Port, t: &mut [f64]) -> [f64; 6] {
    let mut before = [0.0; 6];
    port.components().for_each(|(i, c)| before[c] = t[i]);
    for mask in [0b000001, 0b000110, 0b001000, 0b010000, 0b100000] {
        let of = || port.components().filter(|(_, c)| mask & (1 << c) != 0);
        let mut open = [0.0; 6];
        of().for_each(|(i, c)| open[c] = residual(p, t, i));
        let soft = of().fold(IMMOBILE, |m, (i, _)| m.max(compliance(p, i)));
        of().for_each(|(i, c)| t[i] -= open[c] / soft);
        if unilateral(port) {
            within_bound(port, t, mask);
        }
    }
    before
}

fn compliance(p: &Problem, i: usize) -> f64 {
    p.g[i * p.gap.len() + i].max(IMMOBILE)
}

/// Puts the components of a port that share a bound within it.
fn within_bound(port: &Port, t: &mut [f64], mask: u32) {
    let of = || port.components().filter(|(_, c)| mask & (1 << c) != 0);
    if mask == 1 {
        return of().for_each(|(i, _)| t[i] = t[i].max(0.0));
    }
    let size = of().map(|(i, _)| t[i] * t[i]).sum::<f64>().sqrt();
    let bound = bounds(port, t).into_iter().find(|b| b.0 == mask).map_or(f64::INFINITY, |b| b.1);
    if size > bound {
        of().for_each(|(i, _)| t[i] *= bound / size);
    }
}

/// x_free + G·T − x2 of component i.
fn residual(p: &Problem, t: &[f64], i: usize) -> f64 {
    let n = p.gap.len();
    p.gap[i] + (0..n).map(|k| p.g[k * n + i] * t[k]).sum::<f64>()
}

/// [`residual`] of all components, column by column.
fn residuals(p: &Problem, t: &[f64], out: &mut Vec<f64>) {
    out.clear();
    out.resize(p.gap.len(), 0.0);
    multiply_add(p.g, t, out);
    out.iter_mut().zip(p.gap).for_each(|(o, gap)| *o += gap);
}

#[cfg(test)]
#[path = "../../tests/unit/estimate.rs"]
mod tests;
