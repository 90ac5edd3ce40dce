//! Contacts among the bodies and with rigid ground, solved within the step with Coulomb's cone.
//!
//! Per contact point (Stewart and Trinkle 1996, with the cone of De Saxcé and Feng 1998): the gap at the end of the
//! step, gap + h·u_n ≥ 0, against the normal impulse, and friction |r_t| ≤ μ·r_n against the slip u_t. Overlap is thus
//! taken out to the last by position (no Baumgarte drift), but deep overlap only at a capped speed. An impact whose
//! approach exceeds a threshold rebounds by Newton's law u_n⁺ = −e·u_n⁻.

use crate::contact::detection::{ContactPoint, Detector};
use crate::contact::memory::{Pressed, recall, remember};
use crate::contact::plane::Plane;
use crate::contact::surfaces::Surfaces;
use crate::model::Model;
use crate::motion::Motion;
use terraglue_contact_solver::lcp::{Facets, Method, Outcome, Pyramid};
use terraglue_contact_solver::{Options, Problem, Solver};
use terraglue_linear_solver::{Path, Tree};
use terraglue_numerics::in_place::{cholesky, cholesky_solve};
use terraglue_subsystem::{Config, Error};

/// Overlap up to which it is taken out within one step, m.
const FULL_RECOVERY: f64 = 1e-5;
/// Of more overlap this share is taken out per step, no faster than `RECOVERY_SPEED`, m/s.
const RECOVERY: f64 = 0.1;
const RECOVERY_SPEED: f64 = 0.5;
/// Impacts slower than this many times the speed that gravity adds in a step do not rebound.
const REBOUND: f64 = 4.0;
/// A contact that moves less than this under a unit impulse cannot be moved, 1/kg.
const IMMOBILE: f64 = 1e-14;
/// Residual above which a step is refused.
const REFUSE: f64 = 1e-3;
const OPTIONS: Options =
    Options { tolerance: 1e-11, newton_steps: 30, turns: 6, sweeps: 3, proximal_steps: 20, softening: 1e-9 };

/// Formulation and solver of the contact problem of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ContactLaw {
    /// Coulomb's cone, to rounding.
    Cone,
    /// A friction pyramid, by Lemke's algorithm.
    Pyramid(Facets),
}

impl ContactLaw {
    pub const NAMES: [&'static str; 3] = ["ncp", "lcp-4", "lcp-8"];

    /// The one that the parameter `contact_solver` names.
    pub fn from_config(config: &Config) -> terraglue_subsystem::Result<Self> {
        let (name, names) = (config.text("contact_solver")?, Self::NAMES);
        let i = names.iter().position(|n| *n == name).ok_or_else(|| {
            Error::Refused(format!("parameter `contact_solver` = `{name}` is none of {names:?}"))
        })?;
        Ok([Self::Cone, Self::Pyramid(Facets::Four), Self::Pyramid(Facets::Eight)][i])
    }
}

/// Why a contact problem was not solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(crate) enum Unsolved {
    #[error("the data are not finite")]
    NotFinite,
    #[error("the residual of the cone stays at {0:.1e}")]
    Residual(f64),
    #[error("Lemke's algorithm ended on a ray after {0} pivots")]
    Ray(u32),
    #[error("Lemke's algorithm had no result after {0} pivots")]
    Pivots(u32),
}

/// The contact points of the step and their impulses.
pub(crate) struct BodyContacts {
    detector: Detector,
    surfaces: Surfaces,
    gravity: f64,
    points: Vec<ContactPoint>,
    /// Per point and component the wrench of a unit impulse on a and on b, about their centres of mass.
    wrenches: Vec<[[[f64; 6]; 2]; 3]>,
    /// Added to u_n: gap over h, or the speed of a rebound, m/s.
    offsets: Vec<f64>,
    mu: Vec<f64>,
    impulses: Vec<f64>,
    q: Vec<f64>,
    w: Vec<f64>,
    /// Answers of the tree along the paths, `stride` numbers per point, component and body.
    answers: Vec<f64>,
    stride: usize,
    push: Vec<f64>,
    law: ContactLaw,
    solver: Solver,
    pyramid: Pyramid,
    /// Velocities at the solution of the pyramid.
    u: Vec<f64>,
    /// Residual of the last solution.
    pub residual: f64,
}

impl BodyContacts {
    /// Chooses the pairs at the initial pose.
    pub fn new(model: &Model, bodies: &[Motion]) -> Self {
        let detector = Detector::new(model, bodies);
        let room = detector.room();
        let numbers = |per_point: usize| Vec::with_capacity(per_point * room);
        Self {
            detector,
            surfaces: Surfaces::default(),
            gravity: model.gravity.norm(),
            points: Vec::with_capacity(room),
            wrenches: Vec::with_capacity(room),
            offsets: numbers(1),
            mu: numbers(1),
            impulses: numbers(3),
            q: numbers(3),
            w: numbers(9 * room),
            answers: Vec::new(),
            stride: 0,
            push: Vec::new(),
            law: ContactLaw::Cone,
            solver: Solver::with_room(room),
            pyramid: Pyramid::default(),
            u: numbers(3),
            residual: 0.0,
        }
    }

    /// Whether anything can touch within the step.
    pub fn any(&self) -> bool {
        !self.points.is_empty()
    }

    /// Whether any bodies can meet.
    pub fn watches(&self) -> bool {
        self.detector.watches()
    }

    /// Law, friction, restitution and the rigid ground.
    pub fn set_surroundings(&mut self, law: ContactLaw, surfaces: Surfaces, ground: Option<Plane>) {
        (self.law, self.surfaces) = (law, surfaces);
        self.detector.planes.extend(ground);
    }

    /// Finds the contact points of a step of length h from the committed motion; `memory`: forces of the last step.
    pub fn detect(&mut self, bodies: &[Motion], h: f64, memory: &[Pressed]) {
        self.points.clear();
        self.detector.detect(bodies, h, &mut self.points);
        self.wrenches.clear();
        self.offsets.clear();
        self.mu.clear();
        for p in &self.points {
            let wrench = |c: usize, side: usize, sign: f64| match p.bodies[side] {
                None => [0.0; 6],
                Some(b) => {
                    let (d, moment) = (p.frame[c], (p.points[side] - bodies[b].c).cross(&p.frame[c]));
                    [d.x, d.y, d.z, moment.x, moment.y, moment.z].map(|v| sign * v)
                }
            };
            self.wrenches.push(std::array::from_fn(|c| [wrench(c, 0, -1.0), wrench(c, 1, 1.0)]));
            let velocity = |side: usize| {
                p.bodies[side].map_or_else(crate::math::V3::zeros, |b| {
                    bodies[b].v + bodies[b].w.cross(&(p.points[side] - bodies[b].c))
                })
            };
            let approach = p.frame[0].dot(&(velocity(1) - velocity(0)));
            let given = self.surfaces.of(p.bodies);
            let restitution = given.restitution.unwrap_or(self.surfaces.restitution);
            self.offsets.push(self.offset(p.gap, approach, restitution, h));
            self.mu.push(given.friction.or(p.friction).unwrap_or(self.surfaces.friction));
        }
        let n = self.points.len();
        self.impulses.clear();
        self.impulses.resize(3 * n, 0.0);
        recall(memory, &self.points, bodies, h, &mut self.impulses);
    }

    /// Keeps the forces of the last solve; `bodies` as in [`Self::detect`].
    pub fn remember(&self, bodies: &[Motion], h: f64, memory: &mut Vec<Pressed>) {
        remember(memory, &self.points, &self.impulses, bodies, h);
    }

    fn offset(&self, gap: f64, approach: f64, restitution: f64, h: f64) -> f64 {
        let hits = gap + h * approach <= 0.0 && -approach > REBOUND * h * self.gravity;
        if hits && restitution > 0.0 {
            return restitution * approach;
        }
        if gap >= -FULL_RECOVERY {
            gap / h
        } else {
            (gap * RECOVERY).min(-FULL_RECOVERY).max(-RECOVERY_SPEED * h) / h
        }
    }

    /// Adds the contact impulses to a solution of the system.
    pub fn resolve(&mut self, tree: &Tree, body_at: &[usize], solution: &mut [f64]) -> Result<(), Unsolved> {
        let n = self.points.len();
        self.residual = 0.0;
        if n == 0 {
            return Ok(());
        }
        self.q.clear();
        for (p, wrenches) in self.points.iter().zip(&self.wrenches) {
            self.q.extend(wrenches.iter().map(|sides| rate(p, sides, body_at, solution)));
        }
        (0..n).for_each(|k| self.q[3 * k] += self.offsets[k]);
        if (0..n).all(|k| self.q[3 * k] >= 0.0) {
            self.impulses.fill(0.0);
            return Ok(());
        }
        self.fill_w(tree);
        self.find_impulses()?;
        self.push.clear();
        self.push.resize(solution.len(), 0.0);
        for (k, (p, wrenches)) in self.points.iter().zip(&self.wrenches).enumerate() {
            for (c, sides) in wrenches.iter().enumerate().filter(|(c, _)| self.impulses[3 * k + c] != 0.0) {
                add_wrenches(p, sides, self.impulses[3 * k + c], body_at, &mut self.push);
            }
        }
        tree.substitute(&mut self.push);
        solution.iter_mut().zip(&self.push).for_each(|(s, p)| *s += p);
        Ok(())
    }

    /// Solves the contact problem by the law that was chosen.
    fn find_impulses(&mut self) -> Result<(), Unsolved> {
        let problem = Problem::new(&self.w, &self.q, &self.mu).map_err(|_| Unsolved::NotFinite)?;
        let facets = match self.law {
            ContactLaw::Cone => {
                self.residual = self.solver.solve(&problem, &OPTIONS, &mut self.impulses).residual;
                let good = self.residual <= REFUSE;
                return if good { Ok(()) } else { Err(Unsolved::Residual(self.residual)) };
            }
            ContactLaw::Pyramid(facets) => facets,
        };
        match self.pyramid.solve(&problem, facets, Method::Lemke, &mut self.impulses) {
            Outcome::Solved(_) => {}
            Outcome::Ray(pivots) => return Err(Unsolved::Ray(pivots)),
            Outcome::PivotLimit(pivots) => return Err(Unsolved::Pivots(pivots)),
        }
        self.u.resize(self.q.len(), 0.0);
        problem.velocity(&self.impulses, &mut self.u);
        self.residual = problem.residual(&self.impulses, &self.u);
        Ok(())
    }

    /// W = H·K⁻¹·Hᵀ by the paths of the bodies to their roots.
    fn fill_w(&mut self, tree: &Tree) {
        let n = self.points.len();
        let touched = self.points.iter().flat_map(|p| p.bodies).flatten();
        self.stride = touched.map(|b| Path::len(tree, b)).max().unwrap_or(0);
        self.answers.clear();
        self.answers.reserve(6 * self.detector.room() * self.stride);
        self.answers.resize(6 * n * self.stride, 0.0);
        for (k, (p, wrenches)) in self.points.iter().zip(&self.wrenches).enumerate() {
            for (c, sides) in wrenches.iter().enumerate() {
                for (side, wrench) in sides.iter().enumerate() {
                    if let Some(body) = p.bodies[side] {
                        let at = (6 * k + 2 * c + side) * self.stride;
                        Path::respond(tree, body, wrench, &mut self.answers[at..at + self.stride]);
                    }
                }
            }
        }
        self.w.clear();
        self.w.resize(9 * n * n, 0.0);
        for i in 0..n {
            for k in 0..=i {
                self.fill_block(tree, i, k);
            }
            if self.w[3 * i * 3 * n + 3 * i] < IMMOBILE {
                // Nothing to be moved here: an impulse would only be noise.
                (0..3).for_each(|c| self.w[(3 * i + c) * (3 * n + 1)] += 1.0);
                self.q[3 * i..3 * i + 3].fill(0.0);
            }
        }
    }

    fn fill_block(&mut self, tree: &Tree, i: usize, k: usize) {
        let n = 3 * self.points.len();
        for (a, body_a) in self.points[i].bodies.iter().enumerate() {
            for (b, body_b) in self.points[k].bodies.iter().enumerate() {
                let (Some(body_a), Some(body_b)) = (body_a, body_b) else { continue };
                let shared = Path::shared(tree, *body_a, *body_b);
                if shared == 0 {
                    continue;
                }
                for c in 0..3 {
                    for d in 0..if i == k { c + 1 } else { 3 } {
                        let left = &self.answers[(6 * i + 2 * c + a) * self.stride..];
                        let right = &self.answers[(6 * k + 2 * d + b) * self.stride..];
                        let value = Path::dot(tree, shared, left, right);
                        let (row, column) = (3 * i + c, 3 * k + d);
                        self.w[row * n + column] += value;
                        if row != column {
                            self.w[column * n + row] += value;
                        }
                    }
                }
            }
        }
    }

    /// Number of points that pressed in the last solve.
    pub fn pressing(&self) -> usize {
        self.impulses.chunks_exact(3).filter(|r| r[0] > 0.0).count()
    }

    /// Σ r·(H·v) for rates v of all bodies: the work of the impulses at these rates.
    pub fn work(&self, body_at: &[usize], v: &[f64]) -> f64 {
        let of = |k: usize| {
            let (p, wrenches) = (&self.points[k], &self.wrenches[k]);
            (0..3).map(|c| self.impulses[3 * k + c] * rate(p, &wrenches[c], body_at, v)).sum::<f64>()
        };
        (0..self.points.len()).filter(|k| self.impulses[3 * k] > 0.0).map(of).sum()
    }

    /// Adds the mean normal force of the last solve over h to each body, N.
    pub fn add_normal_forces(&self, h: f64, forces: &mut [f64]) {
        for (p, r) in self.points.iter().zip(self.impulses.chunks_exact(3)) {
            p.bodies.iter().flatten().for_each(|b| forces[*b] += r[0] / h);
        }
    }

    /// Whether component i holds: closed, and for the tangents inside the cone.
    fn holds(&self, i: usize) -> bool {
        let r = &self.impulses[3 * (i / 3)..][..3];
        let tangential = (r[1] * r[1] + r[2] * r[2]).sqrt();
        r[0] > 0.0 && (i.is_multiple_of(3) || tangential < self.mu[i / 3] * r[0] * (1.0 - 1e-9))
    }

    /// Takes the pressing contacts into account in a compliance matrix g = P·K⁻¹·Pᵀ (n × n): they hold within
    /// the step, so g loses g_ps·D_ss⁻¹·g_sp. `rate(p, v)` is row p of P applied to v.
    pub fn stiffen(
        &self,
        n: usize,
        g: &mut [f64],
        (tree, body_at): (&Tree, &[usize]),
        port_rate: &dyn Fn(usize, &[f64]) -> f64,
        scratch: &mut Vec<f64>,
    ) {
        let m = self.impulses.len();
        let held = || (0..m).filter(|i| self.holds(*i));
        let (count, unknowns) = (held().count(), tree.len());
        scratch.clear();
        // K⁻¹·Hᵀ of each held component.
        scratch.resize(count * unknowns, 0.0);
        for (i, response) in held().zip(scratch.chunks_exact_mut(unknowns)) {
            add_wrenches(&self.points[i / 3], &self.wrenches[i / 3][i % 3], 1.0, body_at, response);
            tree.substitute(response);
        }
        // D_ss, then the columns g_sp and D_ss⁻¹·g_sp, one pair for each port component.
        let d = count * unknowns;
        for c in held() {
            // A little compliance, as redundant contacts between two bodies need.
            let compliance = 1e-10 * self.w[c * m + c];
            scratch.extend(held().map(|r| self.w[c * m + r] + if r == c { compliance } else { 0.0 }));
        }
        if !cholesky(count, &mut scratch[d..]) {
            return;
        }
        let columns = d + count * count;
        for p in 0..n {
            for _ in 0..2 {
                for s in 0..count {
                    let value = port_rate(p, &scratch[s * unknowns..(s + 1) * unknowns]);
                    scratch.push(value);
                }
            }
            let (factor, column) = scratch.split_at_mut(columns + (2 * p + 1) * count);
            cholesky_solve(count, &factor[d..columns], column);
        }
        let column = |k: usize| &scratch[columns + k * count..][..count];
        for c in 0..n {
            for r in 0..n {
                let loss = column(2 * r).iter().zip(column(2 * c + 1));
                g[c * n + r] -= loss.map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }
}

fn rate(p: &ContactPoint, sides: &[[f64; 6]; 2], body_at: &[usize], v: &[f64]) -> f64 {
    let of = |side: usize| match p.bodies[side] {
        None => 0.0,
        Some(b) => sides[side].iter().zip(&v[body_at[b]..]).map(|(w, v)| w * v).sum::<f64>(),
    };
    of(0) + of(1)
}

fn add_wrenches(p: &ContactPoint, sides: &[[f64; 6]; 2], impulse: f64, body_at: &[usize], out: &mut [f64]) {
    for (side, body) in p.bodies.iter().enumerate() {
        if let Some(b) = body {
            out[body_at[*b]..].iter_mut().zip(&sides[side]).for_each(|(o, w)| *o += impulse * w);
        }
    }
}
