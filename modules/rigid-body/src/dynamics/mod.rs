//! One step of the bodies in maximal coordinates.
//!
//! Unknowns are the rates v⁺ of all bodies and the impulses λ of all joint rows:
//! M·v⁺ = M·v + h·f + Jᵀλ, J·v⁺ + C·λ = b. Positions follow as x⁺ = x + h·v⁺ (semi-implicit Euler) and the joints
//! hold **at the end of the step**: the rows are linearised about the force-free motion and the rest is taken out
//! by a few corrections with the same factor, which enter rates and positions alike. That is the SHAKE scheme
//! (Ryckaert, Ciccotti and Berendsen 1977), symplectic (Leimkuhler and Skeel 1994): joints neither open nor
//! brake. Rotation: the angular momentum is updated by the impulses, orientation by the Cayley transform of the
//! midpoint rate, see [`gyro`]. The second-order options are
//! [`alpha`] and [`midpoint`] over [`second_order`]; their common part is in [`scheme`].

mod alpha;
mod anderson;
mod branches;
pub(crate) mod carried;
mod closing;
mod explicit;
mod gyro;
mod joint_gaps;
pub(crate) mod joint_rows;
pub(crate) mod kkt;
mod midpoint;
mod reaction;
pub(crate) mod scheme;
mod second_order;
pub(crate) mod sensitivity;
mod start;
mod swinging;
mod trial;

use crate::contact::bodies::{BodyContacts, Unsolved};
use crate::drive::{MOST_YIELDING, Span};
use crate::joint::{Joint, Kind};
use crate::model::Model;
use crate::motion::Motion;
use crate::state::State;
use anderson::Anderson;
use branches::Branches;
use carried::Carried;
use closing::Closing;
use explicit::ExplicitGains;
use joint_rows::Stand;
use kkt::Kkt;
use scheme::Integrator;
use start::StepStart;
use terraglue_linear_solver::Error as SolverError;
use trial::Trial;

/// Rounds in which all axes change branch at once; after them one at a time.
const FREE_ROUNDS: usize = 8;
/// Rounds one at a time before rigid motors are softened.
const SINGLE_ROUNDS: usize = 8;

/// Why a trial has no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Failure {
    #[error("the joint system cannot be solved: {0}")]
    Solver(#[from] SolverError),
    #[error("motors and joint limits found no consistent state in {rounds} rounds; a shorter step may help")]
    Branches { rounds: usize },
    #[error("joint `{joint}` stays open by {gap:.1e} (m or rad); a shorter step may help")]
    Gap { joint: String, gap: f64 },
    #[error(
        "joint `{joint}` stays open by {gap:.1e} (m or rad): its forces of up to {force:.2e} N swing link `{link}` of \
         {mass} kg faster than steps of {h:.3e} s follow; take steps below {longest:.1e} s, or integrator = \
         \"energy-momentum\" where nothing hits"
    )]
    Swinging { joint: String, gap: f64, force: f64, link: String, mass: f64, h: f64, longest: f64 },
    #[error(
        "the step of second order did not converge in {corrections} corrections; shorten the step, or take \
         integrator = \"symplectic-euler\" where something hits or sticks"
    )]
    NotConverged { corrections: usize },
    #[error(
        "joint `{joint}`: explicit PD is unstable at steps of {h} s; take less than {share:.3} of these gains, a shorter \
         step, or motor = \"position\", which is implicit and stable at any gain"
    )]
    Explicit { joint: String, h: f64, share: f64 },
    #[error("contact among the bodies or with rigid ground found no solution: {0}; a shorter step may help")]
    Contact(#[from] Unsolved),
}

/// A free axis at the end of a trial.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AxisResult {
    /// Change of the coordinate over h.
    pub rate: f64,
    /// Rate of the coordinate at the end.
    pub end_rate: f64,
    /// Mean of J·v before and after the impulses; times an impulse it is the impulse's work.
    pub mean_rate: f64,
    /// Total impulse along the axis, h × the force at the end.
    pub impulse: f64,
}

/// The step in hand and the last trial of it; buffers are reused.
pub(crate) struct Dynamics {
    pub model: Model,
    pub kkt: Kkt,
    pub contacts: BodyContacts,
    closing: Closing,
    pub h: f64,
    pub integrator: Integrator,
    pub start: StepStart,
    pub branches: Branches,
    /// Per axis: change of the coordinate over h less J·v⁺, from the curvature of the motion.
    curvature: Vec<f64>,
    /// From a centre of mass to a joint at most, m; infinite where that does not bound how rows turn.
    longest_arm: f64,
    base_rhs: Vec<f64>,
    /// Whether trials leave out results that only the commit needs (see [`Dynamics::complete`]).
    lean: bool,
    /// External impulses of the trial, laid out as the unknowns.
    pub external: Vec<f64>,
    /// Those of them that act on points of bodies.
    pub carried: Vec<Carried>,
    rhs: Vec<f64>,
    correction: Vec<f64>,
    anderson: Anderson,
    explicit: ExplicitGains,
    pub trial: Trial,
}

impl Dynamics {
    pub fn new(model: Model, integrator: Integrator, bodies: &[Motion]) -> Result<Self, SolverError> {
        let kkt = Kkt::new(&model)?;
        let (nb, nj, n) = (model.bodies.len(), model.joints.len(), kkt.len());
        // Sliding changes the lever beyond any turn, and rows of universal joints turn faster than their bodies.
        let arm = |j: &Joint| match j.kind {
            Kind::Fixed | Kind::Revolute | Kind::Spherical => {
                j.child_anchor.norm().max(j.parent_anchor.norm())
            }
            _ => f64::INFINITY,
        };
        Ok(Self {
            longest_arm: model.joints.iter().map(arm).fold(0.0, f64::max),
            contacts: BodyContacts::new(&model, bodies),
            closing: Closing::new(&model),
            kkt,
            h: 0.0,
            integrator,
            start: StepStart::new(nb, nj, n),
            branches: Branches::new(nj),
            curvature: vec![0.0; nj],
            base_rhs: vec![0.0; n],
            lean: false,
            external: vec![0.0; n],
            carried: Vec::new(),
            rhs: vec![0.0; n],
            correction: vec![0.0; n],
            anderson: Anderson::new(n, 6 * nb),
            explicit: ExplicitGains::new(nj),
            trial: Trial::new(nb, n),
            model,
        })
    }

    /// Linearises the step of length h from a state; the factor is made by the first trial.
    pub fn prepare(&mut self, state: &State, h: f64) -> Result<(), Failure> {
        self.h = h;
        self.start.take(state);
        self.kkt.factored = false;
        if self.integrator.is_second_order() {
            return self.prepare_second_order(state);
        }
        self.prepare_bodies(state);
        self.contacts.detect(&self.start.bodies, h, &state.pressed);
        self.branches.yield_where(self.contacts.any());
        self.prepare_joints(state);
        self.check_explicit(state)
    }

    /// After a step without a consistent state: rigid motors give way ten times as much. False: no more of that.
    /// Coulomb's law is not monotone, so a motor that pushes a sliding foot may belong neither at its bound nor below.
    pub fn soften(&mut self, state: &State) -> bool {
        if self.branches.yielding <= 0.0 || self.branches.yielding >= MOST_YIELDING {
            return false;
        }
        self.branches.yielding *= 10.0;
        self.kkt.factored = false;
        self.prepare_joints(state);
        true
    }

    /// Impulse of a unit force of the step in the system for the mean rates, s.
    pub fn impulse_per_force(&self) -> f64 {
        self.integrator.force_weight() * self.h
    }

    fn prepare_bodies(&mut self, state: &State) {
        let h = self.h;
        for (b, body) in self.model.bodies.iter().enumerate() {
            let m = &self.start.bodies[b];
            self.kkt.turn_inertia(b, body, &m.q);
            self.start.rotate_freely(b, body, h);
            let (v, load) = (self.start.bodies[b].v, &state.loads[b]);
            let push = body.mass * v + h * (body.mass * self.model.gravity + load.force);
            let spin = self.kkt.inertia[b] * self.start.free_rate[b] + h * load.moment;
            let at = self.kkt.body_at[b];
            self.base_rhs[at..at + 3].copy_from_slice(push.as_slice());
            self.base_rhs[at + 3..at + 6].copy_from_slice(spin.as_slice());
        }
    }

    fn prepare_joints(&mut self, state: &State) {
        // The force-free motion is the point of linearisation.
        self.start.go_on_freely(&self.kkt.body_at);
        self.trial.solution.copy_from_slice(&self.start.free);
        self.trial.find_places(&self.kkt, &self.start, self.h);
        let span = self.span(state, self.h, 1.0);
        for (j, joint) in self.model.joints.iter().enumerate() {
            let s = &state.joints[j];
            self.kkt.rows[j] = joint_rows::rows(joint, &self.start.bodies);
            self.branches.renew(j, joint, s, &span);
            let stand = Stand::of(joint, &self.trial.ends);
            let open = stand.gap(joint);
            let rates = self.kkt.rates(j, joint, &self.start.free);
            let at = self.kkt.joint_at[j];
            if let Some(free) = joint.free_row() {
                let travel = stand.coordinate(joint, s.angle) - s.angle;
                self.curvature[j] = travel / self.h - rates[free];
            }
            let rigid = joint.rigid();
            for (r, open) in open.iter().enumerate() {
                let hold = rates[r] - open / self.h;
                self.base_rhs[at + r] = if s.broken || !rigid[r] { 0.0 } else { hold };
            }
        }
        self.prepare_closures(state);
        self.closing.close_base(&self.kkt, &self.start.free, self.h, &mut self.base_rhs);
    }

    /// Takes over which connections beyond the tree are broken; their rows and values, linearised at the ends of the trial.
    fn prepare_closures(&mut self, state: &State) {
        let rule = (self.h, &self.integrator);
        self.closing.prepare(&self.model, &self.start, &self.trial.ends, rule, state);
    }

    /// For which step axes are made; `when`: see [`Span`].
    fn span(&self, state: &State, h: f64, when: f64) -> Span {
        let impacts = !self.integrator.is_second_order();
        Span { h, when, supply_v: state.supply.limit, yielding: self.branches.yielding, impacts }
    }

    /// The free axis of joint j in the trial; none where nothing moves or it is broken.
    pub fn axis_result(&self, j: usize) -> Option<AxisResult> {
        let joint = &self.model.joints[j];
        let free = self.branches.free(j, joint)?;
        if self.integrator.is_second_order() {
            return Some(self.axis_result_second_order(j, free));
        }
        let rate = self.kkt.rate(j, joint, free, &self.trial.solution);
        let mean_rate = 0.5 * (rate + self.kkt.rate(j, joint, free, &self.start.free));
        let (rate, impulse) = (rate + self.curvature[j], self.impulse_of(j, free));
        Some(AxisResult { rate, end_rate: rate, mean_rate, impulse })
    }

    /// State that decides on the branch of an axis: the change of its coordinate over h, and its impulse.
    fn axis_state(&self, j: usize) -> Option<(f64, f64)> {
        let joint = &self.model.joints[j];
        let free = self.branches.free(j, joint)?;
        let rate = match self.integrator.is_second_order() {
            true => self.travel(j) / self.h,
            false => self.kkt.rate(j, joint, free, &self.trial.solution) + self.curvature[j],
        };
        Some((rate, self.impulse_of(j, free)))
    }

    /// Impulse along the free axis of a joint in the trial.
    fn impulse_of(&self, j: usize, free: usize) -> f64 {
        match self.branches.row(j) {
            Some(_) => -self.trial.solution[self.kkt.joint_at[j] + free] / self.integrator.force_weight(),
            None => self.branches.impulse(j),
        }
    }

    /// Work of the contact impulses of the trial: at the mean of the rates before and after, so that it is exactly the
    /// change of the kinetic energy.
    pub fn contact_work(&self) -> f64 {
        let at = |v| self.contacts.work(&self.kkt.body_at, v);
        0.5 * (at(&self.start.free) + at(&self.trial.solution))
    }

    fn factor(&mut self) -> Result<(), SolverError> {
        let weight = self.integrator.force_weight();
        for (j, joint) in self.model.joints.iter().enumerate() {
            let rigid = joint.rigid();
            for r in 0..6 {
                self.kkt.compliance[j][r] = match joint.free_row() {
                    _ if self.branches.broken[j] => None,
                    Some(free) if free == r => self.branches.row(j).map(|(c, _)| c / weight),
                    _ => rigid[r].then_some(0.0),
                };
            }
        }
        self.kkt.factor(&self.closing.cuts)?;
        self.kkt.factored = true;
        self.kkt.factor_count += 1;
        // Every trial needs the impulses of rigid rows along axes.
        let rigid =
            |(joint, c): (&Joint, &[Option<f64>; 6])| joint.free_row().is_some_and(|r| c[r] == Some(0.0));
        self.lean = self.is_plain() && !self.model.joints.iter().zip(&self.kkt.compliance).any(rigid);
        Ok(())
    }

    /// Whether nothing but a tree of joints is to be solved, in first order.
    fn is_plain(&self) -> bool {
        !self.integrator.is_second_order() && !self.contacts.any() && !self.closing.any()
    }

    /// Makes the factor for the current branches if there is none.
    pub fn ensure_factor(&mut self) -> Result<(), Failure> {
        if !self.kkt.factored {
            self.factor()?;
        }
        Ok(())
    }

    /// Solves the step under `external`; the result is in `trial` and `branches`.
    pub fn solve(&mut self) -> Result<(), Failure> {
        let soft = self.branches.yielding <= 0.0 || self.branches.yielding >= MOST_YIELDING;
        let rounds = FREE_ROUNDS + if soft { 8 * self.branches.len() + 8 } else { SINGLE_ROUNDS };
        for round in 0..rounds {
            self.ensure_factor()?;
            let one_at_a_time = round >= FREE_ROUNDS;
            if self.integrator.is_second_order() {
                self.solve_branch_second_order()?;
                if !self.change_branches(one_at_a_time) {
                    return Ok(());
                }
                continue;
            }
            self.solve_branch()?;
            match self.close_joints() {
                // On branches that do not hold, a motor may throw its link about so that nothing closes.
                Err(open) => {
                    self.solve_branch()?;
                    if !self.change_branches(one_at_a_time) {
                        self.complete_impulses();
                        return Err(swinging::explained(self, open));
                    }
                }
                Ok(()) if !self.change_branches(one_at_a_time) => return Ok(()),
                Ok(()) => {}
            }
        }
        Err(Failure::Branches { rounds })
    }

    /// Like [`Dynamics::solve`] where only the branches of the axes are needed: where the present ones hold, the
    /// joints are not closed to the last, and the ends of the trial stay as they were.
    pub fn find_branches(&mut self) -> Result<(), Failure> {
        if self.is_plain() {
            self.ensure_factor()?;
            self.solve_branch()?;
            if !self.change_branches(false) {
                return Ok(());
            }
        }
        self.solve()
    }

    /// The step on the present branches, without closing the remaining gaps of the joints.
    fn solve_branch(&mut self) -> Result<(), Failure> {
        self.assemble();
        if self.lean {
            self.kkt.solver.solve_rates(&self.rhs, &mut self.trial.solution)?;
            return Ok(());
        }
        self.kkt.solver.solve(&self.rhs, &mut self.trial.solution)?;
        self.contacts.resolve(&self.kkt.solver, &self.kkt.body_at, &mut self.trial.solution)?;
        Ok(())
    }

    fn assemble(&mut self) {
        for ((rhs, base), external) in self.rhs.iter_mut().zip(&self.base_rhs).zip(&self.external) {
            *rhs = base + external;
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            let Some(free) = self.branches.free(j, joint) else { continue };
            if let Some((_, b)) = self.branches.row(j) {
                self.rhs[self.kkt.joint_at[j] + free] = b - self.curvature[j];
                continue;
            }
            let impulse = self.branches.impulse(j);
            if impulse != 0.0 {
                self.kkt.push(&mut self.rhs, joint, &self.kkt.rows[j], free, impulse);
            }
        }
    }

    /// Moves axes to the branch on which their solution lies; false when all are there.
    fn change_branches(&mut self, one_at_a_time: bool) -> bool {
        let mut changed = false;
        self.branches.begin_changes();
        for j in 0..self.branches.len() {
            let Some(lies) = self.axis_state(j) else { continue };
            changed |= self.branches.propose(j, lies, !(one_at_a_time && changed));
        }
        if changed {
            self.branches.accept_changes();
            self.kkt.factored = false;
        }
        changed
    }
}
