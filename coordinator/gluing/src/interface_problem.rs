//! The interface problem of a group: packed vectors over all ports and the paper's calls on all participants.

use super::estimate::RigidContact;
use super::glue::{ConstraintKind, Glue};
use super::group_estimate::GroupEstimate;
use super::participant::{Answer, End, Participant, StepContext};
use super::report::StepReport;
use crate::contact::PortSet;
use crate::timing::{Part, Timings};
use std::time::Instant as Clock;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::{Capabilities, Level, Node, Port, cooperation};

/// Subsystems glued to each other, with everything that one step passes between them.
#[derive(Debug)]
pub struct InterfaceProblem {
    /// Time and trial.
    pub at: StepContext,
    /// All ports of the group in ascending order of key.
    pub ports: Vec<Port>,
    pub(super) nodes: Vec<Node>,
    pub(super) bodies: Vec<Participant>,
    pub(super) grounds: Vec<Participant>,
    /// The estimate of step 2.
    pub estimate: GroupEstimate,
    /// Surface of the grounds (answer to step 1 and to every trial), packed.
    pub x2: Vec<f64>,
    /// Force of the grounds' laws at the committed state, packed.
    pub f_law: Vec<f64>,
    /// The wrench on the bodies; after a strategy the one to commit.
    pub t: Vec<f64>,
    /// What side 2 got where that was another wrench; else empty.
    pub t_second: Vec<f64>,
    /// Wrench of the soil's law at the last trial.
    pub f: Vec<f64>,
    /// End-of-step displacement of the bodies at the last trial.
    pub x1: Vec<f64>,
    /// Velocity of the bodies at the last trial.
    pub v1: Vec<f64>,
    /// Velocity of side 2 of joints at the last trial.
    pub v2: Vec<f64>,
    /// Accelerations of both sides of joints at the last trial.
    pub a1: Vec<f64>,
    /// The same of side 2.
    pub a2: Vec<f64>,
    /// What every component is.
    pub rows: Vec<ConstraintKind>,
    /// Which components are answered by a soil.
    pub(super) of_soil: Vec<bool>,
    /// Where the points of both sides of a joint lay apart at t, packed.
    pub gap: Vec<f64>,
    /// Compliance of the glue by component, m/N.
    pub compliance: Vec<f64>,
    /// Damper beside it, N s/m.
    pub damping: Vec<f64>,
    /// Glue of the scenario.
    pub glue: Glue,
    /// Level of the condition at joints.
    pub level: Level,
    /// Share of the position error taken out per step at velocity level.
    pub stabilisation: f64,
    /// T, X1 and V1 of the last trial of the bodies.
    pub(super) base: [Vec<f64>; 3],
    /// T, X1, V1, A1, X2, V2 and A2 while differences are taken.
    pub(super) kept: [Vec<f64>; 7],
    /// d(v1 − v2)/dT.
    pub(super) rates: Vec<f64>,
    /// The bodies' last trial is not that of T.
    pub(super) displaced: bool,
    pub(super) zeros: Vec<f64>,
    /// Which ports may be perturbed together, and which share ground: see [`Participant::colours`].
    pub(super) colours: Vec<u32>,
    pub(super) meets: Vec<bool>,
    /// Committed wrench of every port of the step before, by key.
    pub last: Vec<(u64, [f64; 6])>,
    pub(super) work: Vec<f64>,
    rigid: RigidContact,
    /// Where the time went.
    pub timings: Timings,
    /// What happened.
    pub report: StepReport,
    /// Weight of the glued bodies, N (1 N without gravity): scale of the tolerance.
    pub t_ref: f64,
}

/// What passes a row of the interface in a step, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassedEnergy {
    /// Work on both sides together, beyond what springs stored and what became heat; at a contact with soil the work on the
    /// body alone.
    pub gained: f64,
    /// Stored by a spring.
    pub stored: f64,
    /// Turned into heat by a damper, or by friction between bodies.
    pub heat: f64,
    /// Magnitude of the work on side 1.
    pub through: f64,
}

impl InterfaceProblem {
    /// A group of bodies and grounds, given by their instance indices.
    pub fn new(bodies: &[usize], grounds: &[usize], t_ref: f64) -> Self {
        Self {
            bodies: bodies.iter().map(|s| Participant::new(*s)).collect(),
            grounds: grounds.iter().map(|s| Participant::new(*s)).collect(),
            t_ref,
            at: StepContext::default(),
            ports: Vec::new(),
            nodes: Vec::new(),
            estimate: GroupEstimate::default(),
            x2: Vec::new(),
            f_law: Vec::new(),
            t: Vec::new(),
            t_second: Vec::new(),
            f: Vec::new(),
            x1: Vec::new(),
            v1: Vec::new(),
            v2: Vec::new(),
            a1: Vec::new(),
            a2: Vec::new(),
            rows: Vec::new(),
            of_soil: Vec::new(),
            gap: Vec::new(),
            compliance: Vec::new(),
            damping: Vec::new(),
            glue: Glue::default(),
            level: Level::Position,
            stabilisation: 0.0,
            base: Default::default(),
            kept: Default::default(),
            rates: Vec::new(),
            displaced: false,
            zeros: Vec::new(),
            colours: Vec::new(),
            meets: Vec::new(),
            last: Vec::new(),
            work: Vec::new(),
            rigid: RigidContact::default(),
            timings: Timings::default(),
            report: StepReport::default(),
        }
    }

    /// Number of components.
    pub fn n(&self) -> usize {
        self.t.len()
    }

    /// Instances of the group, bodies first.
    pub fn members(&self) -> impl Iterator<Item = usize> + '_ {
        self.bodies.iter().chain(&self.grounds).map(|s| s.slot)
    }

    /// Instances on the side of the grounds.
    pub fn ground_slots(&self) -> impl Iterator<Item = usize> + '_ {
        self.grounds.iter().map(|s| s.slot)
    }

    /// Instances on the side of the bodies.
    pub fn body_slots(&self) -> impl Iterator<Item = usize> + '_ {
        self.bodies.iter().map(|s| s.slot)
    }

    /// Takes over the ports that contact detection found.
    pub fn begin(&mut self, at: StepContext, found: &PortSet) {
        self.at = StepContext { epoch: found.epoch, ..at };
        self.ports.clear();
        self.ports.extend_from_slice(&found.ports);
        let found_ports = found.ports.len();
        self.glue.append(&mut self.ports);
        self.nodes.clear();
        self.nodes.extend_from_slice(&found.nodes);
        let n = self.ports.iter().map(Port::len).sum();
        let (owners, glue) = (&found.owners, &self.glue);
        let ends = |p: usize, slot: usize, ground: bool, origin: [f64; 3]| match owners.get(p) {
            Some(o) if !ground => {
                (o.subsystem as usize == slot).then_some(End { side: 1, body: o.body, origin })
            }
            Some(o) => (o.ground as usize == slot).then_some(End { side: -1, body: 0, origin }),
            None => glue.end_of(p - found_ports, slot),
        };
        for (sides, ground) in [(&mut self.bodies, false), (&mut self.grounds, true)] {
            for side in sides {
                let (slot, ports) = (side.slot, &self.ports);
                side.take_ports(ports, |p| ends(p, slot, ground, ports[p].origin));
            }
        }
        self.rows.clear();
        self.of_soil.clear();
        self.gap.clear();
        self.compliance.clear();
        self.damping.clear();
        for (p, port) in self.ports.iter().enumerate() {
            let glued = p.checked_sub(found_ports).and_then(|k| glue.joint(k));
            for (_, c) in port.components() {
                self.rows.push(glued.map_or(ConstraintKind::of_contact(c), |j| j.row(c)));
                self.of_soil.push(glued.is_none_or(|j| j.is_on_soil()));
                self.gap.push(glued.map_or(0.0, |j| j.gap(port, c)));
                self.compliance.push(port.law.compliance);
                self.damping.push(glued.map_or(0.0, |j| j.damping()));
            }
        }
        let e = &mut self.estimate;
        for buffer in [
            &mut e.t_star,
            &mut e.x_free,
            &mut self.x2,
            &mut self.f_law,
            &mut self.t,
            &mut self.f,
            &mut self.x1,
            &mut self.v1,
            &mut self.v2,
            &mut self.a1,
            &mut self.a2,
            &mut self.zeros,
        ] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        self.t_second.clear();
        e.g.clear();
        e.g.resize(n * n, 0.0);
        e.active.clear();
        e.active.resize(self.ports.len(), 0);
        e.unique = true;
        self.report.clear();
    }

    /// Paper, step 1: the constraints of rigid contact. Grounds answer first and narrow the laws.
    pub fn set_ports(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        for side in &mut self.grounds {
            let (x, f) = (Some(self.x2.as_mut_slice()), Some(self.f_law.as_mut_slice()));
            side.set_ports(&mut instances[side.slot], &self.nodes, &self.at, &mut self.ports, x, f)?;
        }
        for side in &mut self.bodies {
            side.set_ports(&mut instances[side.slot], &self.nodes, &self.at, &mut self.ports, None, None)?;
        }
        self.timings.charge(Part::Ports, start);
        Ok(())
    }

    /// Paper, step 2: solve for T*, do not animate.
    pub fn estimate_forces(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        for k in 0..self.bodies.len() {
            let slot = self.bodies[k].slot;
            if instances[slot].capabilities().has(Capabilities::ESTIMATE) {
                let partner = (self.x2.as_slice(), self.zeros.as_slice());
                let (side, out) = (&mut self.bodies[k], &mut self.estimate);
                side.estimate(&mut instances[slot], &self.nodes, &self.at, partner, out)?;
            } else {
                self.estimate_from_trials(k, instances)?;
            }
        }
        self.timings.charge(Part::Estimate, start);
        Ok(())
    }

    /// The default estimate for bodies that only know `advance`: free motion, Jacobian, rigid contact.
    fn estimate_from_trials(&mut self, k: usize, instances: &mut [Instance]) -> Result {
        let instance = &mut instances[self.bodies[k].slot];
        let side = &mut self.bodies[k];
        let out = Answer { x: Some(&mut self.estimate.x_free), ..Answer::default() };
        side.advance_under_force(instance, &self.nodes, &self.at, &self.zeros, None, out)?;
        if !side.jacobian(instance, &self.nodes, &self.at, &mut self.estimate.g)? {
            // exact for bodies that are linear within the step
            let how = (false, self.t_ref.max(1.0));
            let trials = side.take_differences(instance, &self.nodes, &self.at, &self.zeros, how)?;
            side.differences(&mut self.estimate.g);
            self.at.trial += trials;
            self.report.evaluations_jacobian += trials;
        }
        self.rigid.solve(&self.ports, &self.x2, &mut self.estimate);
        Ok(())
    }

    /// Paper, step 3: the soil solves with the estimate. T1 goes to `t`, its surface to `x2`. `start_only`: an iteration
    /// begins there, so a soil that finds no answer in this step is no failure.
    pub fn solve_compatibility(&mut self, start_only: bool, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        for port in &self.ports {
            let (t_star, mu) = (&self.estimate.t_star, port.law.mu);
            cooperation::plain_pass(port, t_star, &self.f_law, f64::INFINITY, mu, &mut self.t);
        }
        for side in &mut self.grounds {
            let instance = &mut instances[side.slot];
            let (t, x2) = (&mut self.t, &mut self.x2);
            if side.solve_compatibility(
                start_only,
                instance,
                &self.nodes,
                &self.at,
                &self.estimate,
                [t, x2],
            )? {
                self.report.evaluations_soil += 1;
            }
        }
        self.timings.charge(Part::Grounds, start);
        Ok(())
    }

    /// Paper, step 4: the bodies re-solved without the contact constraints, under T as external force.
    pub fn advance_bodies(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        self.at.trial += 1;
        self.displaced = false;
        for side in &mut self.bodies {
            let instance = &mut instances[side.slot];
            side.advance_under_force(instance, &self.nodes, &self.at, &self.t, None, Answer::default())?;
            side.motion_by_side(
                [&mut self.x1, &mut self.v1, &mut self.a1],
                [&mut self.x2, &mut self.v2, &mut self.a2],
            );
        }
        for (base, value) in self.base.iter_mut().zip([&self.t, &self.x1, &self.v1]) {
            base.clear();
            base.extend_from_slice(value);
        }
        self.report.evaluations_bodies += 1;
        self.timings.charge(Part::Bodies, start);
        Ok(())
    }

    /// X1 and V1 for the present T by the bodies' own linearisation about their last trial: no evaluation.
    pub fn predict_bodies(&mut self) {
        let [t, x, v] = &self.base;
        self.x1.copy_from_slice(x);
        self.v1.copy_from_slice(v);
        let rate = if self.at.h > 0.0 { 1.0 / self.at.h } else { 0.0 };
        let n = self.t.len();
        for (column, (new, old)) in self.estimate.g.chunks_exact(n.max(1)).zip(self.t.iter().zip(t)) {
            let change = new - old;
            for ((x, v), g) in self.x1.iter_mut().zip(&mut self.v1).zip(column) {
                *x += g * change;
                *v += rate * g * change;
            }
        }
    }

    /// x1 − x2 with the distance of the points at t, of the rows that are not a soil's law; at h = 0 and at the
    /// velocity level the derivative that the condition speaks of. The stretch of a compliant glue is added.
    pub fn mismatch(&self, i: usize) -> f64 {
        self.bodies_part(i) + self.surface_part(i) + self.compliance_now(i) * self.t[i]
    }

    /// What the bodies' motion contributes to a row: without the force of the glue's spring and the soil's surface.
    pub fn bodies_part(&self, i: usize) -> f64 {
        let rate = self.v1[i] - self.v2[i];
        let damper = self.compliance_now(i) * self.damping[i] * rate;
        if self.at.h == 0.0 && self.compliance[i] == 0.0 {
            return self.a1[i] - self.a2[i];
        }
        if self.is_above_position(i) {
            let share = self.stabilisation / self.at.h;
            if self.level == Level::Velocity {
                return rate + share * self.gap[i];
            }
            // Baumgarte (1972)
            let apart = self.x1[i] - self.x2[i] + self.gap[i];
            return self.a1[i] - self.a2[i] + 2.0 * share * rate + share * share * apart;
        }
        let soil = self.has_grounds() && self.rows[i] != ConstraintKind::Joint;
        self.x1[i] + self.gap[i] + damper - if soil { 0.0 } else { self.x2[i] }
    }

    /// Whether a component's wrench is known: that of a soil at t, where a step of no length moves nothing.
    pub fn is_given(&self, i: usize) -> bool {
        self.at.h == 0.0 && self.of_soil[i]
    }

    fn surface_part(&self, i: usize) -> f64 {
        if self.has_grounds() && self.rows[i] != ConstraintKind::Joint && self.at.h > 0.0 {
            -self.x2[i]
        } else {
            0.0
        }
    }

    /// Whether the condition of a row speaks of rates or accelerations: a constraint at such a level. Springs and
    /// contacts are laws of the place.
    pub(super) fn is_above_position(&self, i: usize) -> bool {
        self.level != Level::Position
            && self.rows[i] == ConstraintKind::Joint
            && self.compliance[i] == 0.0
            && self.at.h > 0.0
    }

    /// Compliance of the glue as it enters [`InterfaceProblem::mismatch`].
    pub fn compliance_now(&self, i: usize) -> f64 {
        self.compliance[i]
    }

    /// How far a closed joint lies apart at t + h beyond what its spring and damper allow, m or rad.
    pub fn joint_gap(&self, i: usize) -> f64 {
        let force = self.t[i] + self.damping[i] * (self.v1[i] - self.v2[i]);
        (self.x1[i] - self.x2[i] + self.gap[i] + self.compliance[i] * force).abs()
    }

    /// What passes a row in the step: see `PassedEnergy`.
    pub fn passed(&self, i: usize, t_before: Option<f64>) -> PassedEnergy {
        let t = self.t[i];
        let through = (t * self.x1[i]).abs();
        if self.of_soil[i] && self.has_grounds() {
            // the soil's side is booked at its commit
            return PassedEnergy { gained: t * self.x1[i], through, ..PassedEnergy::default() };
        }
        let moved = self.x1[i] - self.x2[i];
        // what side 2 was told differs from what side 1 was
        let apart = self.t_second.get(i).map_or(0.0, |t2| (t - t2) * self.x2[i]);
        let stretched = moved + self.gap[i];
        if self.rows[i] == ConstraintKind::Coulomb {
            return PassedEnergy { gained: apart, heat: -t * moved, through, stored: 0.0 };
        }
        if self.rows[i] != ConstraintKind::Joint || self.compliance[i] == 0.0 {
            return PassedEnergy { gained: t * stretched + apart, through, ..PassedEnergy::default() };
        }
        let mean = 0.5 * (t_before.unwrap_or(t) + t);
        let stored = 0.5 * (stretched * stretched - self.gap[i] * self.gap[i]) / self.compliance[i];
        let rate = if self.at.h > 0.0 { moved / self.at.h } else { 0.0 };
        let heat = self.damping[i] * rate * moved;
        PassedEnergy { gained: mean * moved + stored + heat + apart, stored, heat, through }
    }

    /// Levels of the interface Jacobian with their weights in the condition of a constraint.
    pub(super) fn weights(&self) -> [(Level, f64); 3] {
        let share = self.stabilisation / self.at.h;
        match self.level {
            Level::Acceleration => {
                [(Level::Acceleration, 1.0), (Level::Velocity, 2.0 * share), (Level::Position, share * share)]
            }
            level => [(level, 1.0), (level, 0.0), (level, 0.0)],
        }
    }

    /// Whether the bodies' Jacobian comes from their trials: no member estimates contact forces where joints or
    /// contacts other than with a soil are glued.
    pub fn needs_linearisation(&self) -> bool {
        self.rows.iter().any(|r| matches!(r, ConstraintKind::Joint | ConstraintKind::Coulomb))
            || self.grounds.is_empty()
    }

    /// Whether a soil is among the members.
    pub fn has_grounds(&self) -> bool {
        !self.grounds.is_empty()
    }

    /// T of the step before at joints; at contacts the soil's own force, as the step before lands on the wrong
    /// side of the unloading kink by rounding.
    pub fn start_from_last(&mut self) {
        for port in &self.ports {
            for (i, _) in port.components() {
                let joint = matches!(self.rows[i], ConstraintKind::Joint | ConstraintKind::Coulomb)
                    || self.grounds.is_empty();
                self.t[i] = if joint {
                    self.last
                        .iter()
                        .find(|(key, _)| *key == port.key)
                        .map_or(0.0, |(_, t)| t[i - port.first as usize])
                } else {
                    self.f_law[i]
                };
            }
        }
    }

    /// Whether subsystems share joints; else all ports are contacts found or declared.
    pub fn has_joints(&self) -> bool {
        self.rows.contains(&ConstraintKind::Joint)
    }

    /// Repeats the bodies' trial under T where differences have left them in another one: before a commit.
    pub fn repeat_bodies_trial(&mut self, instances: &mut [Instance]) -> Result {
        if self.displaced {
            self.advance_bodies(instances)?;
            self.report.evaluations_bodies -= 1;
            self.report.evaluations_jacobian += 1;
        }
        Ok(())
    }

    /// A trial of the grounds under the motion X1: the wrench of their law goes to `f`.
    pub fn advance_grounds_under_motion(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        let partner = (self.x1.as_slice(), self.v1.as_slice());
        for side in &mut self.grounds {
            let out = Answer { t: Some(&mut self.f), ..Answer::default() };
            side.advance_under_motion(&mut instances[side.slot], &self.nodes, &self.at, partner, out)?;
        }
        self.report.evaluations_soil += 1;
        self.timings.charge(Part::Grounds, start);
        Ok(())
    }

    /// A trial of the grounds under the normal forces in `t` and the motion X1: their surface goes to `x2`,
    /// the wrench of their law to `f`.
    pub fn advance_grounds_under_force(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        let partner = (self.x1.as_slice(), self.v1.as_slice());
        for side in &mut self.grounds {
            let out = Answer { x: Some(&mut self.x2), v: None, t: Some(&mut self.f) };
            let instance = &mut instances[side.slot];
            side.advance_under_force(instance, &self.nodes, &self.at, &self.t, Some(partner), out)?;
        }
        self.report.evaluations_soil += 1;
        self.timings.charge(Part::Grounds, start);
        Ok(())
    }

    /// Work at the ports of all grounds since the start by their own ledgers, J; not a number where one keeps none.
    fn work_on_grounds(&self, instances: &[Instance]) -> f64 {
        self.grounds.iter().map(|side| instances[side.slot].subsystem().energy().port_work).sum()
    }

    /// Paper, step 5: every member takes its last trial as the state at t + h.
    pub fn commit(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        for side in &mut self.bodies {
            let partner = (self.x2.as_slice(), self.zeros.as_slice());
            side.commit(&mut instances[side.slot], &self.nodes, &self.at, &self.t, partner)?;
        }
        self.timings.charge(Part::CommitBodies, start);
        let start = Clock::now();
        // a step of no length tells accelerations, which soils have none
        let before = self.work_on_grounds(instances);
        for side in self.grounds.iter_mut().filter(|_| self.at.h > 0.0) {
            let partner = (self.x1.as_slice(), self.v1.as_slice());
            side.commit(&mut instances[side.slot], &self.nodes, &self.at, &self.t, partner)?;
        }
        let on_grounds = if self.at.h > 0.0 { self.work_on_grounds(instances) - before } else { 0.0 };
        let report = &mut self.report;
        report.interface_work_error_j = (report.interface_work_error_j + on_grounds).abs();
        self.timings.charge(Part::CommitGrounds, start);
        self.last.clear();
        for port in &self.ports {
            let mut wrench = [0.0; 6];
            wrench[..port.len()].copy_from_slice(&self.t[port.range()]);
            self.last.push((port.key, wrench));
        }
        Ok(())
    }
}
