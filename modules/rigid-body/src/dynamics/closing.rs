//! Connections beyond the tree within a step: rows that close loops, rods, springs, couplings.
//!
//! A spring with damper is a compliant row: τ⁺ = −k·(l⁺ − l₀) − c·l̇⁺ at the rate u is u + C·λ = b with λ = h·τ⁺,
//! C = 1/(h·c + h²·k), b = −C·h·k·(l − l₀), so it may be as stiff as it likes. In second order its force is exact at the
//! end of the step, or in the scheme that conserves energy the mean that gives the change of its energy exactly.

use super::joint_rows::rows;
use super::kkt::Kkt;
use super::scheme::{Integrator, rates};
use super::start::StepStart;
use super::trial::Trial;
use super::{Dynamics, Failure};
use crate::closure::{Poses, Spring};
use crate::math::V3;
use crate::model::Model;
use crate::motion::Motion;
use crate::state::State;
use terraglue_linear_solver::Cut;

/// Rows of all connections and their data in the step.
#[derive(Default)]
pub(crate) struct Closing {
    /// First row of each connection, and the end.
    first: Vec<usize>,
    /// Rows for which the factor stands.
    pub cuts: Vec<Cut>,
    /// Rows of the present iteration.
    here: Vec<Cut>,
    /// Values at the start and at the end of the step.
    before: Vec<f64>,
    after: Vec<f64>,
    /// Spring of a row.
    springs: Vec<Option<Spring>>,
    broken: Vec<bool>,
}

impl Closing {
    pub fn new(model: &Model) -> Self {
        let mut first = vec![0];
        let mut springs = Vec::new();
        for closure in &model.closures {
            springs.resize(springs.len() + closure.len(), closure.spring().map(|(_, s)| *s));
            first.push(springs.len());
        }
        let n = springs.len();
        Self {
            first,
            cuts: vec![Cut::default(); n],
            here: vec![Cut::default(); n],
            before: vec![0.0; n],
            after: vec![0.0; n],
            springs,
            broken: vec![false; model.closures.len()],
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.springs.len()
    }

    fn owner(&self, row: usize) -> usize {
        self.first.partition_point(|first| *first <= row) - 1
    }

    /// Whether there are any.
    pub fn any(&self) -> bool {
        self.len() > 0
    }

    /// Takes over which connections are broken; rows and values at the start of the step; linearised at `ends`. `rule`:
    /// length of the step and how it is made.
    pub fn prepare(
        &mut self,
        model: &Model,
        start: &StepStart,
        ends: &[Motion],
        (h, integrator): (f64, &Integrator),
        state: &State,
    ) {
        if !self.any() {
            return;
        }
        for (broken, s) in self.broken.iter_mut().zip(&state.closures) {
            *broken = s.broken;
        }
        let begin = start.poses(model);
        let end = Poses { bodies: ends, ..begin };
        let rows = match integrator {
            Integrator::SymplecticEuler => begin,
            Integrator::GeneralizedAlpha(_) => end,
            Integrator::EnergyMomentum => Poses { before: Some(&start.bodies), ..end },
        };
        for (c, closure) in model.closures.iter().enumerate() {
            let range = self.first[c]..self.first[c + 1];
            closure.fill(&rows, &mut self.cuts[range.clone()]);
            closure.values(&begin, &mut self.before[range.clone()]);
            closure.values(&end, &mut self.after[range]);
        }
        for row in 0..self.len() {
            let broken = self.broken[self.owner(row)];
            self.cuts[row].compliance = match self.springs[row] {
                _ if broken => None,
                None => Some(0.0),
                Some(spring) => Some(compliance(&spring, h, integrator) / integrator.force_weight()),
            };
        }
    }

    /// Right-hand sides of the first-order step, about the free motion.
    pub fn close_base(&self, kkt: &Kkt, free: &[f64], h: f64, base_rhs: &mut [f64]) {
        let Self { cuts, before, after, springs, .. } = self;
        for row in 0..self.len() {
            let free = rate(&cuts[row], &kkt.body_at, free);
            base_rhs[kkt.solver.cut_at(row)] = match (cuts[row].compliance, &springs[row]) {
                (None, _) => 0.0,
                (_, None) => free - after[row] / h,
                (Some(c), Some(spring)) => {
                    let curvature = (after[row] - before[row]) / h - free;
                    -c * h * spring.stiffness * (before[row] - spring.rest_length) - curvature
                }
            };
        }
    }

    /// Values at `ends`.
    fn value(&mut self, model: &Model, start: &StepStart, ends: &[Motion]) {
        let end = Poses { bodies: ends, ..start.poses(model) };
        for (c, closure) in model.closures.iter().enumerate() {
            closure.values(&end, &mut self.after[self.first[c]..self.first[c + 1]]);
        }
    }

    /// Writes the remaining gaps at `ends` into `correction`; the worst connection and by how much.
    pub fn open_into(
        &mut self,
        model: &Model,
        start: &StepStart,
        ends: &[Motion],
        kkt: &Kkt,
        h: f64,
        correction: &mut [f64],
    ) -> (usize, f64) {
        let mut worst = (0, 0.0);
        if !self.any() {
            return worst;
        }
        self.value(model, start, ends);
        for row in 0..self.len() {
            let rigid = self.springs[row].is_none() && self.cuts[row].compliance.is_some();
            let open = if rigid { self.after[row] } else { 0.0 };
            correction[kkt.solver.cut_at(row)] = -open / h;
            if open.abs() > worst.1 || open.is_nan() {
                worst = (self.owner(row), open.abs());
            }
        }
        worst
    }

    /// Adds the impulses of all rows of the trial and the residuals of their laws to `correction`.
    pub fn miss_into(
        &mut self,
        model: &Model,
        start: &StepStart,
        trial: &Trial,
        kkt: &Kkt,
        (h, integrator): (f64, &Integrator),
        correction: &mut [f64],
    ) {
        if !self.any() {
            return;
        }
        self.value(model, start, &trial.ends);
        let weight = integrator.force_weight();
        let midpoint = *integrator == Integrator::EnergyMomentum;
        let before = midpoint.then_some(start.bodies.as_slice());
        let poses = Poses { before, bodies: &trial.ends, ..start.poses(model) };
        for (c, closure) in model.closures.iter().enumerate() {
            closure.fill(&poses, &mut self.here[self.first[c]..self.first[c + 1]]);
        }
        for row in 0..self.len() {
            if self.cuts[row].compliance.is_none() {
                continue;
            }
            let at = kkt.solver.cut_at(row);
            let impulse = -trial.solution[at];
            for (b, wrench) in self.here[row].parts.iter().flatten() {
                kkt.push_body(correction, *b, impulse, wrench);
            }
            let (before, after) = (self.before[row], self.after[row]);
            correction[at] = match &self.springs[row] {
                None => -after / h,
                Some(spring) => {
                    let (length, rate) = if midpoint {
                        (0.5 * (before + after), (after - before) / h)
                    } else {
                        (after, rate_of(&self.here[row], &trial.ends))
                    };
                    let force = -spring.stiffness * (length - spring.rest_length) - spring.damping * rate;
                    compliance(spring, h, integrator) * (h * force - impulse / weight)
                }
            };
        }
    }

    /// Rows at the start for accelerations: rigid ones hold, springs push on `rhs`.
    pub fn rest_into(&mut self, model: &Model, start: &StepStart, kkt: &Kkt, rhs: &mut [f64]) {
        let poses = start.poses(model);
        for (c, closure) in model.closures.iter().enumerate() {
            let range = self.first[c]..self.first[c + 1];
            closure.fill(&poses, &mut self.cuts[range.clone()]);
            closure.values(&poses, &mut self.before[range.clone()]);
            for row in range {
                let rigid = self.springs[row].is_none() && !self.broken[c];
                self.cuts[row].compliance = rigid.then_some(0.0);
                rhs[kkt.solver.cut_at(row)] = 0.0;
                let Some(spring) = self.springs[row].filter(|_| !self.broken[c]) else { continue };
                let rate = rate_of(&self.cuts[row], &start.bodies);
                let force =
                    -spring.stiffness * (self.before[row] - spring.rest_length) - spring.damping * rate;
                for (b, wrench) in self.cuts[row].parts.iter().flatten() {
                    kkt.push_body(rhs, *b, force, wrench);
                }
            }
        }
    }

    /// Takes the opening at `ends` within a moment dt from the right-hand side of the accelerations.
    pub fn drift_into(
        &mut self,
        model: &Model,
        start: &StepStart,
        ends: &[Motion],
        kkt: &Kkt,
        dt: f64,
        rhs: &mut [f64],
    ) {
        if !self.any() {
            return;
        }
        self.value(model, start, ends);
        for row in 0..self.len() {
            if self.cuts[row].compliance.is_some() {
                rhs[kkt.solver.cut_at(row)] -= self.after[row] / (dt * dt);
            }
        }
    }

    /// Books the step into the state: forces, energy of springs and dampers. `weight`: of a force of the step, h: its length.
    fn book(&self, model: &Model, trial: &Trial, kkt: &Kkt, (weight, h): (f64, f64), state: &mut State) {
        for (c, closure) in model.closures.iter().enumerate() {
            let s = &mut state.closures[c];
            s.force = 0.0;
            s.moment = 0.0;
            for row in self.first[c]..self.first[c + 1] {
                let force = -trial.solution[kkt.solver.cut_at(row)] / (weight * h);
                let pushes = self.cuts[row].parts[0].is_some_and(|(_, w)| w[..3] != [0.0; 3]);
                let sum = if pushes { &mut s.force } else { &mut s.moment };
                *sum += force * force;
                if let Some((_, spring)) = closure.spring().filter(|_| !self.broken[c]) {
                    let (before, after) = (self.before[row], self.after[row]);
                    let stored = spring.stored(after) - spring.stored(before);
                    state.energy.dissipated -= force * (after - before) + stored;
                    s.stored = spring.stored(after);
                }
            }
            s.force = s.force.sqrt();
            s.moment = s.moment.sqrt();
        }
    }
}

/// Value of a row's Jacobian times rates.
fn rate(cut: &Cut, body_at: &[usize], v: &[f64]) -> f64 {
    let one = |(b, w): &(usize, [f64; 6])| w.iter().zip(&v[body_at[*b]..]).map(|(w, v)| w * v).sum::<f64>();
    cut.parts.iter().flatten().map(one).sum()
}

/// The same for the rates of moving bodies.
fn rate_of(cut: &Cut, bodies: &[Motion]) -> f64 {
    let one = |(b, w): &(usize, [f64; 6])| w.iter().zip(rates(&bodies[*b])).map(|(w, v)| w * v).sum::<f64>();
    cut.parts.iter().flatten().map(one).sum()
}

impl Dynamics {
    /// Makes the rates of a state fit the joints and loops with the least change in the sense of the masses; stored
    /// energies and dependent rows. The largest change, m/s or rad/s.
    pub fn project_rates(&mut self, state: &mut State) -> Result<f64, Failure> {
        self.start.take(state);
        self.closing.rest_into(&self.model, &self.start, &self.kkt, &mut self.rhs);
        self.rhs.fill(0.0);
        for (b, body) in self.model.bodies.iter().enumerate() {
            let m = &state.bodies[b];
            self.kkt.turn_inertia(b, body, &m.q);
            let (push, spin, at) = (body.mass * m.v, self.kkt.inertia[b] * m.w, self.kkt.body_at[b]);
            self.rhs[at..at + 3].copy_from_slice(push.as_slice());
            self.rhs[at + 3..at + 6].copy_from_slice(spin.as_slice());
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            self.kkt.rows[j] = rows(joint, &state.bodies);
            let rigid = joint.rigid();
            (0..6).for_each(|r| self.kkt.compliance[j][r] = rigid[r].then_some(0.0));
        }
        self.kkt.factor(&self.closing.cuts)?;
        self.kkt.factored = false;
        self.kkt.solver.solve(&self.rhs, &mut self.trial.solution)?;
        let mut changed = 0.0_f64;
        for (b, m) in state.bodies.iter_mut().enumerate() {
            let at = self.kkt.body_at[b];
            let [v, w] = [at, at + 3].map(|k| V3::from_row_slice(&self.trial.solution[k..k + 3]));
            changed = changed.max((v - m.v).amax()).max((w - m.w).amax());
            (m.v, m.w) = (v, w);
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            if let Some(free) = joint.free_row() {
                state.joints[j].velocity = self.kkt.rates(j, joint, &self.trial.solution)[free];
            }
        }
        for (closure, s) in self.model.closures.iter().zip(&mut state.closures) {
            s.stored =
                closure.spring().map_or(0.0, |(points, spring)| spring.stored(points.length(&state.bodies)));
        }
        state.redundant_rows = self.kkt.solver.redundant();
        Ok(changed)
    }

    /// Books the step into the state: forces, energy of springs and dampers, dependent rows.
    pub fn book_closures(&mut self, state: &mut State) {
        if !self.closing.any() {
            return;
        }
        self.closing.value(&self.model, &self.start, &self.trial.ends);
        let weight = self.integrator.force_weight();
        self.closing.book(&self.model, &self.trial, &self.kkt, (weight, self.h), state);
        state.redundant_rows = self.kkt.solver.redundant();
    }
}

/// C of a spring with damper: 1/(h·c·dl̇/du + h²·k·dl/d(h·u)).
fn compliance(spring: &Spring, h: f64, integrator: &Integrator) -> f64 {
    let (rate, place) = match integrator {
        Integrator::SymplecticEuler => (1.0, 1.0),
        Integrator::GeneralizedAlpha(_) => (integrator.rate_weight(), 1.0),
        Integrator::EnergyMomentum => (1.0, 0.5),
    };
    1.0 / (h * spring.damping * rate + h * h * spring.stiffness * place)
}
