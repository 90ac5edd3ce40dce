//! Steps as short as the energy residual of the interface asks.
//!
//! After Sadjina, Kyllingstad, Skjong and Pedersen (2017), "Energy conservation and power bonds in co-simulations":
//! a force that is held over the step does another work than the law of the interface does between both ends,
//! δE = T1·X1 − T2·X2 − ½·(F(t) + F(t + h))·(X1 − X2). It needs no repeated step: the forces of the law at t + h are
//! known at the next communication point, and a PI controller (Gustafsson 1991) sets the length of the step after it.

use super::InterfaceProblem;
use super::glue::ConstraintKind;
use super::memory::{Recall, Remember};

/// Exponents for an error per step of second order.
const INTEGRAL: f64 = 0.15;
const PROPORTIONAL: f64 = 0.2;
/// Share of the step that would just meet the tolerance.
const SAFETY: f64 = 0.8;
const SHRINK: f64 = 0.2;
const GROW: f64 = 1.5;

/// Passage of one port in the last step: per component F(t), T on side 1, T on side 2, X1, X2.
#[derive(Clone, Copy, Debug)]
struct PortPassage {
    key: u64,
    count: usize,
    values: [[f64; 5]; 6],
}

/// Passage of the interface of a group in its last step.
#[derive(Clone, Debug, Default)]
pub struct Passage {
    ports: Vec<PortPassage>,
    law: Vec<f64>,
}

impl Passage {
    /// The forces of the law at t: before the strategy solves.
    pub fn look(&mut self, problem: &mut InterfaceProblem) {
        problem.law_forces(&mut self.law);
    }

    /// |δE| of the last step over all ports, J, with the forces of the law at its end.
    pub fn residual(&self, problem: &InterfaceProblem) -> f64 {
        let mut sum = 0.0;
        for passed in &self.ports {
            // a port that is gone carries nothing
            let first = problem.ports.iter().find(|p| p.key == passed.key).map(|p| p.first as usize);
            let port: f64 = (passed.values[..passed.count].iter().enumerate())
                .map(|(k, [before, t1, t2, x1, x2])| {
                    let after = first.map_or(0.0, |i| self.law[i + k]);
                    t1 * x1 - t2 * x2 - 0.5 * (before + after) * (x1 - x2)
                })
                .sum();
            sum += port.abs();
        }
        sum
    }

    /// Takes what the strategy let pass; `look` has been called at the start of the step.
    pub fn take(&mut self, problem: &InterfaceProblem) {
        self.ports.clear();
        for port in &problem.ports {
            let mut passed = PortPassage { key: port.key, count: port.len(), values: [[0.0; 5]; 6] };
            for (k, i) in port.range().enumerate() {
                let (t1, x1) = (problem.t[i], problem.first.x[i]);
                passed.values[k] = match problem.conditions.kinds[i] {
                    ConstraintKind::Normal | ConstraintKind::Law if problem.has_grounds() => {
                        [self.law[i], t1, 0.0, x1, 0.0]
                    }
                    ConstraintKind::Joint if problem.conditions.compliance[i] > 0.0 => {
                        let t2 = problem.t_second.get(i).copied().unwrap_or(t1);
                        [self.law[i], t1, t2, x1, problem.second.x[i]]
                    }
                    // a constraint has no law of its own: what it lets pass is equal on both sides
                    _ => [0.0; 5],
                };
            }
            self.ports.push(passed);
        }
    }

    /// Part of a snapshot.
    pub fn remember(&self, out: &mut Vec<u64>) {
        out.push(self.ports.len() as u64);
        for port in &self.ports {
            out.push(port.key);
            out.put_all(port.values[..port.count].as_flattened());
        }
    }

    /// Back from a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        let count = kept.word();
        let mut list = Vec::new();
        self.ports.clear();
        for _ in 0..count.min(kept.0.len() as u64) {
            let key = kept.word();
            kept.all(&mut list);
            let mut values = [[0.0; 5]; 6];
            for (own, five) in values.iter_mut().zip(list.chunks_exact(5)) {
                own.copy_from_slice(five);
            }
            self.ports.push(PortPassage { key, count: (list.len() / 5).min(6), values });
        }
    }
}

/// The controller of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepControl {
    /// Tolerated |δE| of a step, J.
    tolerance_j: f64,
    /// Shortest and longest step, s.
    range_s: [f64; 2],
    /// Length that the next step should have, s.
    pub h: f64,
    /// Length of the last step, s.
    pub last_h: f64,
    /// Residual of the step before in parts of the tolerance.
    before: f64,
}

impl StepControl {
    /// Starts with the shortest step: nothing is known yet.
    pub fn new(tolerance_j: f64, range_s: [f64; 2]) -> Self {
        Self { tolerance_j, range_s, h: range_s[0], last_h: range_s[0], before: 1.0 }
    }

    /// Takes the residual of a step of length h.
    pub fn learn(&mut self, residual_j: f64, h: f64) {
        let now = (residual_j / self.tolerance_j).max(1e-9);
        let factor =
            SAFETY * libm::pow(now, -(INTEGRAL + PROPORTIONAL)) * libm::pow(self.before, PROPORTIONAL);
        self.before = now;
        self.h = (h * factor.clamp(SHRINK, GROW)).clamp(self.range_s[0], self.range_s[1]);
    }

    /// Part of a snapshot.
    pub fn remember(&self, out: &mut Vec<u64>) {
        [self.h, self.last_h, self.before].into_iter().for_each(|x| out.put(x));
    }

    /// Back from a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        (self.h, self.last_h, self.before) = (kept.number(), kept.number(), kept.number());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_settle_where_the_residual_meets_the_tolerance() {
        let mut control = StepControl::new(1e-3, [1e-6, 1.0]);
        // a residual of h² J
        for _ in 0..60 {
            let h = control.h;
            control.learn(h * h, h);
        }
        let share = control.h * control.h / 1e-3;
        assert!((0.2..1.0).contains(&share), "{share}");
        let settled = control.h;
        control.learn(1.0, settled);
        assert!((control.h - 0.2 * settled).abs() < 1e-12);
        for _ in 0..80 {
            control.learn(0.0, control.h);
        }
        assert_eq!(control.h, 1.0);
    }
}
