//! A group: subsystems that are glued to each other, with their strategy and what it keeps from step to step.

use super::subsystems::Member;
use std::time::Instant as Clock;
use terraglue_diagnostics::Result;
use terraglue_gluing::contact::PortSet;
use terraglue_gluing::memory::{Recall, Remember};
use terraglue_gluing::step_control::Passage;
use terraglue_gluing::timing::{Part, Timings};
use terraglue_gluing::{ConstraintKind, InterfaceProblem, PortReport, StepContext, Strategy};
use terraglue_host::Instance;
use terraglue_scenario::{GluingSpec, StrategyKind};

/// Subsystems that share ports, with their strategy.
pub(super) struct Group {
    pub problem: InterfaceProblem,
    pub strategy: Box<dyn Strategy>,
    /// Its own strategy, where the scenario's glue names one.
    pub own: Option<StrategyKind>,
    /// Strategy for the forces of joints at the start, if there are any.
    pub start: Option<Box<dyn Strategy>>,
    /// Keys of the ports that carried a normal force in the last step.
    pub closed: Vec<u64>,
    /// Passage of energy in the last step, if the control of the steps needs it.
    pub passage: Passage,
}

impl Group {
    /// `[gluing]` as it holds for this group.
    pub fn spec(&self, spec: &GluingSpec) -> GluingSpec {
        let strategy = self.own.unwrap_or(spec.strategy);
        GluingSpec { strategy, ..spec.clone() }
    }

    /// The strategy of the start takes the place of the other, or gives it back.
    pub fn swap_start(&mut self) {
        if let Some(start) = &mut self.start {
            std::mem::swap(start, &mut self.strategy);
        }
    }

    /// Paper, step 1: the ports of the step are made known to all members.
    pub fn begin(
        &mut self,
        at: StepContext,
        found: &PortSet,
        members: &[Member],
        instances: &mut [Instance],
        timings: &mut Timings,
    ) -> Result {
        let start = Clock::now();
        self.problem.glue.place(at.t + at.h, |slot, body| members[slot].states[body as usize]);
        self.problem.begin(at, found);
        timings.charge(Part::Contact, start);
        self.problem.set_ports(instances)
    }

    /// The energy residual of the step before, J.
    pub fn residual(
        &mut self,
        at: StepContext,
        found: &PortSet,
        members: &[Member],
        instances: &mut [Instance],
    ) -> Result<f64> {
        self.begin(at, found, members, instances, &mut Timings::default())?;
        self.passage.look(&mut self.problem);
        Ok(self.passage.residual(&self.problem))
    }

    /// The gap that the last commit left, reported by the soil itself in its answer to `set_ports`.
    pub fn measure_gap(&mut self) {
        let problem = &mut self.problem;
        if self.strategy.is_single_pass() {
            return; // its surface is where the body went, by definition
        }
        for port in &problem.ports {
            if problem.conditions.kinds[port.first as usize] == ConstraintKind::Joint {
                continue; // the strategy itself measures the gap of joints
            }
            if self.closed.binary_search(&port.key).is_ok() {
                let gap = problem.second.x[port.first as usize].abs();
                problem.report.max_gap_m = problem.report.max_gap_m.max(gap);
            }
        }
    }

    /// Fills the report of what is about to be committed. The work of soils comes with their commit.
    pub fn describe(&mut self, found: &PortSet, halvings: u32) {
        let problem = &mut self.problem;
        problem.report.halvings = halvings;
        self.closed.clear();
        problem.report.single_pass = self.strategy.is_single_pass();
        problem.report.joints = problem.conditions.has_joints();
        for (p, port) in problem.ports.iter().enumerate() {
            let owner =
                found.owners.get(p).copied().unwrap_or_else(|| problem.glue.owner(p - found.owners.len()));
            let n = port.first as usize;
            let mut wrench = [0.0; 6];
            let before = problem.last.iter().find(|(key, _)| *key == port.key);
            for (k, (i, c)) in port.components().enumerate() {
                wrench[c] = problem.t[i];
                let passed = problem.component(i).passed(before.map(|b| b.1[k]));
                let report = &mut problem.report;
                report.interface_work_error_j += passed.gained;
                report.port_work_path_j += passed.through;
                report.glue_stored_j += passed.stored;
                report.glue_heat_j += passed.heat;
            }
            if wrench[0] > 0.0 && problem.conditions.kinds[n] != ConstraintKind::Joint {
                self.closed.push(port.key);
            }
            let t_star_n = problem.estimate.t_star[n];
            let report = &mut problem.report;
            report.estimate_gap_n = report.estimate_gap_n.max((t_star_n - wrench[0]).abs());
            report.ports.push(PortReport {
                key: port.key,
                subsystem: owner.subsystem,
                body: owner.body,
                shape: owner.shape,
                origin: port.origin,
                frame: port.frame,
                wrench,
                t_star_n,
                gap_m: problem.first.x[n] - problem.second.x[n] + problem.conditions.gap[n],
            });
        }
    }

    /// State on which later steps depend beside the members' own states.
    pub fn memory(&self) -> Vec<u64> {
        let mut out = vec![self.closed.len() as u64];
        out.extend(&self.closed);
        out.put_wrenches(&self.problem.last);
        self.passage.remember(&mut out);
        self.strategy.remember(&mut out);
        out
    }

    /// Back to what [`Group::memory`] gave.
    pub fn recall(&mut self, kept: &[u64]) {
        let mut kept = Recall(kept);
        let closed = kept.word().min(kept.0.len() as u64);
        self.closed = (0..closed).map(|_| kept.word()).collect();
        kept.wrenches(&mut self.problem.last);
        self.passage.recall(&mut kept);
        self.strategy.recall(&mut kept);
    }
}
