//! T* for bodies that do not know contact themselves: minimum-norm normals, then clipped stick forces.

use super::complementarity::{BoundedProblem, BoundedSolver};
use super::group_estimate::GroupEstimate;
use terraglue_numerics::dense::Lu;
use terraglue_subsystem::Port;

/// The rigid-contact problem 0 ≤ T*_n ⟂ x_free + G·T* − x2 ≥ 0 with its buffers.
#[derive(Debug, Default)]
pub struct RigidContact {
    solver: BoundedSolver,
    lu: Lu,
    normals: Vec<usize>,
    others: Vec<usize>,
    gap: Vec<f64>,
    t: Vec<f64>,
    d: Vec<f64>,
    zeros: Vec<f64>,
    infinite: Vec<f64>,
}

impl RigidContact {
    /// Fills `t_star` and `active` from `x_free` and `g`.
    ///
    /// T* is not unique for more than three feet on one body: G + ε·I with ε = 1e-4 of its mean diagonal picks
    /// the minimum norm, and four proximal steps take ε's own error away.
    pub fn solve(&mut self, ports: &[Port], x2: &[f64], estimate: &mut GroupEstimate) {
        self.normals.clear();
        self.others.clear();
        for port in ports {
            for (i, c) in port.components() {
                if c == 0 { self.normals.push(i) } else { self.others.push(i) }
            }
        }
        estimate.t_star.fill(0.0);
        for _ in 0..2 {
            self.solve_normals(x2, estimate);
            self.solve_others(ports, x2, estimate);
        }
        for (active, i) in estimate.active.iter_mut().zip(&self.normals) {
            *active = u8::from(estimate.t_star[*i] > 0.0);
        }
    }

    fn solve_normals(&mut self, x2: &[f64], estimate: &mut GroupEstimate) {
        let (m, n) = (self.normals.len(), estimate.t_star.len());
        let (g, normals) = (&estimate.g, &self.normals);
        let mean = normals.iter().map(|i| g[i * n + i]).sum::<f64>() / m.max(1) as f64;
        let epsilon = 1e-4 * mean;
        for buffer in [&mut self.t, &mut self.d, &mut self.zeros] {
            buffer.clear();
            buffer.resize(m, 0.0);
        }
        self.infinite.clear();
        self.infinite.resize(m, f64::INFINITY);
        let a = |r: usize, c: usize| g[normals[c] * n + normals[r]] + if r == c { epsilon } else { 0.0 };
        for _ in 0..5 {
            self.gap.clear();
            self.gap.extend(normals.iter().zip(&self.t).map(|(i, t)| {
                let others: f64 = self.others.iter().map(|j| g[j * n + i] * estimate.t_star[*j]).sum();
                estimate.x_free[*i] - x2[*i] + others - epsilon * t
            }));
            let p =
                BoundedProblem { a, e: &self.gap, t: &self.zeros, lower: &self.zeros, upper: &self.infinite };
            self.solver.solve(&p, &mut self.d);
            self.t.copy_from_slice(&self.d);
        }
        for (i, t) in normals.iter().zip(&self.t) {
            estimate.t_star[*i] = t.max(0.0);
        }
    }

    fn solve_others(&mut self, ports: &[Port], x2: &[f64], estimate: &mut GroupEstimate) {
        let n = estimate.t_star.len();
        let (g, others) = (&estimate.g, &self.others);
        let closed = |i: usize| {
            ports.iter().any(|p| p.range().contains(&i) && estimate.t_star[p.first as usize] > 0.0)
        };
        self.d.clear();
        self.d.extend(others.iter().map(|i| {
            let normals: f64 = self.normals.iter().map(|j| g[j * n + i] * estimate.t_star[*j]).sum();
            if closed(*i) { x2[*i] - estimate.x_free[*i] - normals } else { 0.0 }
        }));
        let mean = others.iter().map(|i| g[i * n + i]).sum::<f64>() / others.len().max(1) as f64;
        self.lu.factor(others.len(), |r, c| {
            let coupled = closed(others[r]) && closed(others[c]);
            let own = if r == c { 1e-6 * mean } else { 0.0 };
            if coupled || r == c { g[others[c] * n + others[r]] + own } else { 0.0 }
        });
        self.lu.solve(&mut self.d);
        for (i, t) in others.iter().zip(&self.d) {
            estimate.t_star[*i] = *t;
        }
        for port in ports {
            clip(port, &mut estimate.t_star);
        }
    }
}

/// Bounds tangential force by μ·T_n and moments by the half lengths of the contact.
fn clip(port: &Port, t: &mut [f64]) {
    let t_n = t[port.first as usize];
    if t_n == 0.0 {
        t[port.range()].fill(0.0);
        return;
    }
    let bound = port.law.mu * t_n;
    let norm = terraglue_subsystem::cooperation::tangential_norm(port, t);
    let share = if norm > bound { bound / norm } else { 1.0 };
    for (i, c) in port.components() {
        let arm = match c {
            0 => continue,
            1 | 2 => {
                t[i] *= share;
                continue;
            }
            3 => port.law.mu * port.extent[0].max(port.extent[1]),
            4 => port.extent[1],
            _ => port.extent[0],
        };
        let limit = arm * t_n;
        t[i] = t[i].clamp(-limit, limit);
    }
}
