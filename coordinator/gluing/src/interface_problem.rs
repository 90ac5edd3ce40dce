//! The interface problem of a group: packed vectors over all ports and the paper's calls on all participants.

use super::component::Component;
use super::conditions::Conditions;
use super::differences::Differences;
use super::estimate::RigidContact;
use super::glue::{ConstraintKind, Glue};
use super::group_estimate::GroupEstimate;
use super::participant::{Answer, End, Participant, StepContext};
use super::report::StepReport;
use super::trials::{LawWrenches, SideMotion};
use crate::contact::PortSet;
use crate::timing::{Part, Timings};
use std::time::Instant as Clock;
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::{Capabilities, Node, Port, cooperation};

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
    /// The wrench on the bodies; after a strategy the one to commit.
    pub t: Vec<f64>,
    /// Wrench on side 2 if it was another one; else empty.
    pub t_second: Vec<f64>,
    /// Wrenches of the soils' laws.
    pub law: LawWrenches,
    /// Motion of the bodies, or of side 1 of joints, at the last trial.
    pub first: SideMotion,
    /// Motion of side 2 of joints at the last trial. At contacts `x` is the surface of the soil, the answer to step 1 and to
    /// every trial.
    pub second: SideMotion,
    /// Conditions at each component.
    pub conditions: Conditions,
    /// Glue of the scenario.
    pub glue: Glue,
    /// T, X1 and V1 of the last trial of the bodies.
    pub(super) base: [Vec<f64>; 3],
    pub(super) zeros: Vec<f64>,
    pub(super) differences: Differences,
    /// Committed wrench of every port of the step before, by key.
    pub last: Vec<(u64, [f64; 6])>,
    pub(super) work: Vec<f64>,
    rigid: RigidContact,
    /// Times of the parts.
    pub timings: Timings,
    /// Report of the step.
    pub report: StepReport,
    /// Weight of the glued bodies, N (1 N without gravity): scale of the tolerance.
    pub t_ref: f64,
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
            t: Vec::new(),
            t_second: Vec::new(),
            law: LawWrenches::default(),
            first: SideMotion::default(),
            second: SideMotion::default(),
            conditions: Conditions::default(),
            glue: Glue::default(),
            base: Default::default(),
            zeros: Vec::new(),
            differences: Differences::default(),
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
        self.glue.append(&mut self.ports);
        self.nodes.clear();
        self.nodes.extend_from_slice(&found.nodes);
        self.share_ports(found);
        self.conditions.clear();
        for (p, port) in self.ports.iter().enumerate() {
            let glued = p.checked_sub(found.ports.len()).and_then(|k| self.glue.joint(k));
            self.conditions.push(port, glued);
        }
        let n = self.ports.iter().map(Port::len).sum();
        self.estimate.reset(n, self.ports.len());
        self.law.reset(n);
        self.first.reset(n);
        self.second.reset(n);
        for buffer in [&mut self.t, &mut self.zeros] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        self.t_second.clear();
        self.report.clear();
    }

    /// Gives every member its own ports.
    fn share_ports(&mut self, found: &PortSet) {
        let (owners, glue) = (&found.owners, &self.glue);
        let ends = |p: usize, slot: usize, ground: bool, origin: [f64; 3]| match owners.get(p) {
            Some(o) if !ground => {
                (o.subsystem as usize == slot).then_some(End { side: 1, body: o.body, origin })
            }
            Some(o) => (o.ground as usize == slot).then_some(End { side: -1, body: 0, origin }),
            None => glue.end_of(p - found.ports.len(), slot),
        };
        for (sides, ground) in [(&mut self.bodies, false), (&mut self.grounds, true)] {
            for side in sides {
                let (slot, ports) = (side.slot, &self.ports);
                side.take_ports(ports, |p| ends(p, slot, ground, ports[p].origin));
            }
        }
    }

    /// A component at the last trials.
    pub fn component(&self, i: usize) -> Component<'_> {
        Component {
            conditions: &self.conditions,
            i,
            h: self.at.h,
            t: self.t[i],
            t_second: self.t_second.get(i).copied(),
            first: &self.first,
            second: &self.second,
            has_grounds: self.has_grounds(),
        }
    }

    /// Paper, step 1: the constraints of rigid contact. Grounds answer first and narrow the laws.
    ///
    /// # Errors
    /// A member that fails.
    pub fn set_ports(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        for side in &mut self.grounds {
            let (x, f) = (Some(self.second.x.as_mut_slice()), Some(self.law.at_start.as_mut_slice()));
            side.set_ports(&mut instances[side.slot], &self.nodes, &self.at, &mut self.ports, x, f)?;
        }
        for side in &mut self.bodies {
            side.set_ports(&mut instances[side.slot], &self.nodes, &self.at, &mut self.ports, None, None)?;
        }
        self.timings.charge(Part::Ports, start);
        Ok(())
    }

    /// Paper, step 2: solve for T*, do not animate.
    ///
    /// # Errors
    /// A body that fails, or ends a trial early.
    pub fn estimate_forces(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        for k in 0..self.bodies.len() {
            let slot = self.bodies[k].slot;
            if instances[slot].capabilities().has(Capabilities::ESTIMATE) {
                let partner = (self.second.x.as_slice(), self.zeros.as_slice());
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
        self.rigid.solve(&self.ports, &self.second.x, &mut self.estimate);
        Ok(())
    }

    /// Paper, step 3: the soil solves with the estimate. T1 goes to `t`, its surface to `x2`. `start_only`: an iteration
    /// begins there, so a soil that finds no answer in this step is no failure.
    ///
    /// # Errors
    /// A soil that fails, or ends a trial early where the answer does not only start an iteration.
    pub fn solve_compatibility(&mut self, start_only: bool, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        for port in &self.ports {
            let (t_star, mu) = (&self.estimate.t_star, port.law.mu);
            cooperation::plain_pass(port, t_star, &self.law.at_start, f64::INFINITY, mu, &mut self.t);
        }
        for side in &mut self.grounds {
            let instance = &mut instances[side.slot];
            let (t, x2) = (&mut self.t, &mut self.second.x);
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
    ///
    /// # Errors
    /// A body that fails, or ends its trial early.
    pub fn advance_bodies(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        self.at.trial += 1;
        self.differences.displaced = false;
        for side in &mut self.bodies {
            let instance = &mut instances[side.slot];
            side.advance_under_force(instance, &self.nodes, &self.at, &self.t, None, Answer::default())?;
            side.motion_by_side(self.first.parts(), self.second.parts());
        }
        for (base, value) in self.base.iter_mut().zip([&self.t, &self.first.x, &self.first.v]) {
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
        self.first.x.copy_from_slice(x);
        self.first.v.copy_from_slice(v);
        let rate = if self.at.h > 0.0 { 1.0 / self.at.h } else { 0.0 };
        let n = self.t.len();
        for (column, (new, old)) in self.estimate.g.chunks_exact(n.max(1)).zip(self.t.iter().zip(t)) {
            let change = new - old;
            for ((x, v), g) in self.first.x.iter_mut().zip(&mut self.first.v).zip(column) {
                *x += g * change;
                *v += rate * g * change;
            }
        }
    }

    /// Whether the bodies' Jacobian comes from their trials: no member estimates contact forces where joints or
    /// contacts other than with a soil are glued.
    pub fn needs_linearisation(&self) -> bool {
        self.conditions.kinds.iter().any(|r| matches!(r, ConstraintKind::Joint | ConstraintKind::Coulomb))
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
                let joint =
                    matches!(self.conditions.kinds[i], ConstraintKind::Joint | ConstraintKind::Coulomb)
                        || self.grounds.is_empty();
                self.t[i] = if joint {
                    self.last
                        .iter()
                        .find(|(key, _)| *key == port.key)
                        .map_or(0.0, |(_, t)| t[i - port.first as usize])
                } else {
                    self.law.at_start[i]
                };
            }
        }
    }

    /// Repeats the bodies' trial under T where differences have left them in another one: before a commit.
    ///
    /// # Errors
    /// A body that fails, or ends its trial early.
    pub fn repeat_bodies_trial(&mut self, instances: &mut [Instance]) -> Result {
        if self.differences.displaced {
            self.advance_bodies(instances)?;
            self.report.evaluations_bodies -= 1;
            self.report.evaluations_jacobian += 1;
        }
        Ok(())
    }

    /// A trial of the grounds under the motion X1: the wrench of their law goes to `f`.
    ///
    /// # Errors
    /// A soil that fails, or ends its trial early.
    pub fn advance_grounds_under_motion(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        let partner = (self.first.x.as_slice(), self.first.v.as_slice());
        for side in &mut self.grounds {
            let out = Answer { t: Some(&mut self.law.last), ..Answer::default() };
            side.advance_under_motion(&mut instances[side.slot], &self.nodes, &self.at, partner, out)?;
        }
        self.report.evaluations_soil += 1;
        self.timings.charge(Part::Grounds, start);
        Ok(())
    }

    /// A trial of the grounds under the normal forces in `t` and the motion X1: their surface goes to `x2`,
    /// the wrench of their law to `f`.
    ///
    /// # Errors
    /// A soil that fails, or ends its trial early.
    pub fn advance_grounds_under_force(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        let partner = (self.first.x.as_slice(), self.first.v.as_slice());
        for side in &mut self.grounds {
            let out = Answer { x: Some(&mut self.second.x), v: None, t: Some(&mut self.law.last) };
            let instance = &mut instances[side.slot];
            side.advance_under_force(instance, &self.nodes, &self.at, &self.t, Some(partner), out)?;
        }
        self.report.evaluations_soil += 1;
        self.timings.charge(Part::Grounds, start);
        Ok(())
    }

    /// Paper, step 5: every member takes its last trial as the state at t + h.
    ///
    /// # Errors
    /// A member that fails.
    pub fn commit(&mut self, instances: &mut [Instance]) -> Result {
        let start = Clock::now();
        for side in &mut self.bodies {
            let partner = (self.second.x.as_slice(), self.zeros.as_slice());
            side.commit(&mut instances[side.slot], &self.nodes, &self.at, &self.t, partner)?;
        }
        self.timings.charge(Part::CommitBodies, start);
        let start = Clock::now();
        // a step of no length gives accelerations, of which soils have none
        let before = work_at_ports(&self.grounds, instances);
        for side in self.grounds.iter_mut().filter(|_| self.at.h > 0.0) {
            let partner = (self.first.x.as_slice(), self.first.v.as_slice());
            side.commit(&mut instances[side.slot], &self.nodes, &self.at, &self.t, partner)?;
        }
        let on_grounds = if self.at.h > 0.0 { work_at_ports(&self.grounds, instances) - before } else { 0.0 };
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

/// Work at the ports of members since the start by their own ledgers, J; not a number where one keeps none.
fn work_at_ports(members: &[Participant], instances: &[Instance]) -> f64 {
    members.iter().map(|side| instances[side.slot].subsystem().energy().port_work).sum()
}
