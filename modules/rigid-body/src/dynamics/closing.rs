//! Connections beyond the tree within a step: rows that close loops, rods, springs, couplings.
//!
//! A spring with damper is a compliant row: τ⁺ = −k·(l⁺ − l₀) − c·l̇⁺ at the rate u is u + C·λ = b with λ = h·τ⁺,
//! C = 1/(h·c + h²·k), b = −C·h·k·(l − l₀), so it may be as stiff as it likes. In second order its force is exact at the
//! end of the step, or in the scheme that conserves energy the mean that gives the change of its energy exactly.

use super::joint_rows::rows;
use super::scheme::Integrator;
use super::second_order::{add, rates};
use super::{Dynamics, Failure};
use crate::closure::{Poses, Spring};
use crate::math::V3;
use crate::model::Model;
use crate::state::State;
use terraglue_linear_solver::Cut;

/// Rows of all connections and what the step knows of them.
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
}

/// Value of a row's Jacobian times rates.
fn rate(cut: &Cut, body_at: &[usize], v: &[f64]) -> f64 {
    let one = |(b, w): &(usize, [f64; 6])| w.iter().zip(&v[body_at[*b]..]).map(|(w, v)| w * v).sum::<f64>();
    cut.parts.iter().flatten().map(one).sum()
}

impl Dynamics {
    /// Whether there are connections beyond the tree.
    pub(super) fn closes(&self) -> bool {
        self.closing.len() > 0
    }

    /// Takes over what is broken; rows and values at the start of the step; linearised at `ends`.
    pub(super) fn prepare_closures(&mut self, state: &State) {
        if !self.closes() {
            return;
        }
        for (broken, s) in self.closing.broken.iter_mut().zip(&state.closures) {
            *broken = s.broken;
        }
        self.angles.clear();
        self.angles.extend(state.joints.iter().map(|j| j.angle));
        let Self { model, closing, starts, ends, angles, integrator, .. } = self;
        let start = Poses { joints: &model.joints, before: None, bodies: starts, near: angles };
        let end = Poses { bodies: ends, ..start };
        let rows = match integrator {
            Integrator::SymplecticEuler => start,
            Integrator::GeneralizedAlpha(_) => end,
            Integrator::EnergyMomentum => Poses { before: Some(starts), ..end },
        };
        for (c, closure) in model.closures.iter().enumerate() {
            let range = closing.first[c]..closing.first[c + 1];
            closure.fill(&rows, &mut closing.cuts[range.clone()]);
            closure.values(&start, &mut closing.before[range.clone()]);
            closure.values(&end, &mut closing.after[range]);
        }
        for row in 0..closing.len() {
            let broken = closing.broken[closing.owner(row)];
            closing.cuts[row].compliance = match closing.springs[row] {
                _ if broken => None,
                None => Some(0.0),
                Some(spring) => Some(compliance(&spring, self.h, integrator) / integrator.force_weight()),
            };
        }
    }

    /// Right-hand sides of the first-order step, about the free motion.
    pub(super) fn close_base(&mut self) {
        for row in 0..self.closing.len() {
            let Closing { cuts, before, after, springs, .. } = &self.closing;
            let free = rate(&cuts[row], &self.kkt.body_at, &self.free);
            let at = self.kkt.solver.cut_at(row);
            self.base_rhs[at] = match (cuts[row].compliance, &springs[row]) {
                (None, _) => 0.0,
                (_, None) => free - after[row] / self.h,
                (Some(c), Some(spring)) => {
                    let curvature = (after[row] - before[row]) / self.h - free;
                    -c * self.h * spring.stiffness * (before[row] - spring.rest_length) - curvature
                }
            };
        }
    }

    /// Values at `ends`.
    fn values_at_ends(&mut self) {
        let Self { model, closing, ends, angles, .. } = self;
        let end = Poses { joints: &model.joints, before: None, bodies: ends, near: angles };
        for (c, closure) in model.closures.iter().enumerate() {
            closure.values(&end, &mut closing.after[closing.first[c]..closing.first[c + 1]]);
        }
    }

    /// Writes what is left open at `ends` into `correction`; the worst connection and by how much.
    pub(super) fn closures_into_correction(&mut self) -> (usize, f64) {
        let mut worst = (0, 0.0);
        if !self.closes() {
            return worst;
        }
        self.values_at_ends();
        for row in 0..self.closing.len() {
            let closing = &self.closing;
            let rigid = closing.springs[row].is_none() && closing.cuts[row].compliance.is_some();
            let open = if rigid { closing.after[row] } else { 0.0 };
            self.correction[self.kkt.solver.cut_at(row)] = -open / self.h;
            if open.abs() > worst.1 || open.is_nan() {
                worst = (closing.owner(row), open.abs());
            }
        }
        worst
    }

    /// Adds the impulses of all rows in `solution` and what is missing to their laws to `correction`.
    pub(super) fn closures_second_order(&mut self) {
        if !self.closes() {
            return;
        }
        self.values_at_ends();
        let (h, weight) = (self.h, self.integrator.force_weight());
        let midpoint = self.integrator == Integrator::EnergyMomentum;
        let Self { model, closing, starts, ends, angles, correction, solution, kkt, integrator, .. } = self;
        let before = midpoint.then_some(starts.as_slice());
        let poses = Poses { joints: &model.joints, before, bodies: ends, near: angles };
        for (c, closure) in model.closures.iter().enumerate() {
            closure.fill(&poses, &mut closing.here[closing.first[c]..closing.first[c + 1]]);
        }
        for row in 0..closing.len() {
            if closing.cuts[row].compliance.is_none() {
                continue;
            }
            let at = kkt.solver.cut_at(row);
            let impulse = -solution[at];
            for (b, wrench) in closing.here[row].parts.iter().flatten() {
                add(correction, kkt.body_at[*b], impulse, wrench);
            }
            let (before, after) = (closing.before[row], closing.after[row]);
            correction[at] = match &closing.springs[row] {
                None => -after / h,
                Some(spring) => {
                    let (length, rate) = if midpoint {
                        (0.5 * (before + after), (after - before) / h)
                    } else {
                        let end = |(b, w): &(usize, [f64; 6])| {
                            w.iter().zip(rates(&ends[*b])).map(|(w, v)| w * v).sum::<f64>()
                        };
                        (after, closing.here[row].parts.iter().flatten().map(end).sum())
                    };
                    let force = -spring.stiffness * (length - spring.rest_length) - spring.damping * rate;
                    compliance(spring, h, integrator) * (h * force - impulse / weight)
                }
            };
        }
    }

    /// Rows at the start for accelerations: rigid ones hold, springs push on `rhs`.
    pub(super) fn closures_at_rest(&mut self) {
        let Self { model, closing, starts, angles, rhs, kkt, .. } = self;
        let poses = Poses { joints: &model.joints, before: None, bodies: starts, near: angles };
        for (c, closure) in model.closures.iter().enumerate() {
            let range = closing.first[c]..closing.first[c + 1];
            closure.fill(&poses, &mut closing.cuts[range.clone()]);
            closure.values(&poses, &mut closing.before[range.clone()]);
            for row in range {
                let rigid = closing.springs[row].is_none() && !closing.broken[c];
                closing.cuts[row].compliance = rigid.then_some(0.0);
                rhs[kkt.solver.cut_at(row)] = 0.0;
                let Some(spring) = closing.springs[row].filter(|_| !closing.broken[c]) else { continue };
                let parts = closing.cuts[row].parts;
                let end = |(b, w): &(usize, [f64; 6])| {
                    w.iter().zip(rates(&starts[*b])).map(|(w, v)| w * v).sum::<f64>()
                };
                let rate: f64 = parts.iter().flatten().map(end).sum();
                let force =
                    -spring.stiffness * (closing.before[row] - spring.rest_length) - spring.damping * rate;
                for (b, wrench) in parts.iter().flatten() {
                    add(rhs, kkt.body_at[*b], force, wrench);
                }
            }
        }
    }

    /// Takes what opens at `ends` within a moment dt from the right-hand side of the accelerations.
    pub(super) fn closures_drift(&mut self, dt: f64) {
        if !self.closes() {
            return;
        }
        self.values_at_ends();
        for row in 0..self.closing.len() {
            if self.closing.cuts[row].compliance.is_some() {
                self.rhs[self.kkt.solver.cut_at(row)] -= self.closing.after[row] / (dt * dt);
            }
        }
    }

    /// Makes the rates of a state fit the joints and loops with the least change in the sense of the masses; stored
    /// energies and dependent rows. The largest change, m/s or rad/s.
    pub fn project_rates(&mut self, state: &mut State) -> Result<f64, Failure> {
        self.starts.clone_from(&state.bodies);
        self.angles.clear();
        self.angles.extend(state.joints.iter().map(|j| j.angle));
        self.rhs.fill(0.0);
        self.closures_at_rest();
        self.rhs.fill(0.0);
        for (b, body) in self.model.bodies.iter().enumerate() {
            let m = &state.bodies[b];
            let r = m.q.to_rotation_matrix();
            self.inertia[b] = r * body.inertia * r.transpose();
            let (push, spin, at) = (body.mass * m.v, self.inertia[b] * m.w, self.kkt.body_at[b]);
            self.rhs[at..at + 3].copy_from_slice(push.as_slice());
            self.rhs[at + 3..at + 6].copy_from_slice(spin.as_slice());
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            self.rows[j] = rows(joint, &state.bodies);
            let rigid = joint.rigid();
            (0..6).for_each(|r| self.compliance[j][r] = rigid[r].then_some(0.0));
        }
        self.kkt.factor(&self.inertia, &self.rows, &self.compliance, &self.closing.cuts)?;
        self.factored = false;
        self.kkt.solver.solve(&self.rhs, &mut self.solution)?;
        let mut changed = 0.0_f64;
        for (b, m) in state.bodies.iter_mut().enumerate() {
            let at = self.kkt.body_at[b];
            let (v, w) = (V3::from_row_slice(&self.solution[at..at + 3]), &self.solution[at + 3..at + 6]);
            let w = V3::from_row_slice(w);
            changed = changed.max((v - m.v).amax()).max((w - m.w).amax());
            (m.v, m.w) = (v, w);
        }
        for (j, joint) in self.model.joints.iter().enumerate() {
            if let Some(free) = joint.free_row() {
                state.joints[j].velocity = self.rates(j, &self.solution)[free];
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
        if !self.closes() {
            return;
        }
        self.values_at_ends();
        let (h, weight) = (self.h, self.integrator.force_weight());
        for (c, closure) in self.model.closures.iter().enumerate() {
            let s = &mut state.closures[c];
            s.force = 0.0;
            s.moment = 0.0;
            for row in self.closing.first[c]..self.closing.first[c + 1] {
                let force = -self.solution[self.kkt.solver.cut_at(row)] / (weight * h);
                let pushes = self.closing.cuts[row].parts[0].is_some_and(|(_, w)| w[..3] != [0.0; 3]);
                let sum = if pushes { &mut s.force } else { &mut s.moment };
                *sum += force * force;
                if let Some((_, spring)) = closure.spring().filter(|_| !self.closing.broken[c]) {
                    let (before, after) = (self.closing.before[row], self.closing.after[row]);
                    let stored = spring.stored(after) - spring.stored(before);
                    state.energy.dissipated -= force * (after - before) + stored;
                    s.stored = spring.stored(after);
                }
            }
            s.force = s.force.sqrt();
            s.moment = s.moment.sqrt();
        }
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
