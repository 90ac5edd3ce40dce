//! The step that conserves energy and momentum: midpoint rule with constraint forces along the mean rows.
//!
//! Rotation: Θ = h·(Ω + Ω⁺)/2 in body axes, q⁺ = q·cay(Θ), L⁺ − L = h·m in world axes; then ΔT = θ·m exactly
//! (Simo and Wong 1991; Austin, Krishnaprasad and Wang 1993), where θ = R·Θ is the turn in world axes. Joints ask for
//! expressions that are bilinear in positions and body-fixed directions, so that their change over the step is the
//! row made of the mean vectors times (Δc, θ): closed joints do no work, whatever the step (discrete gradient, Gonzalez
//! 1996; for rigid bodies Betsch and Leyendecker 2006). In terms of the mean rate u = (Δc, θ)/h:
//! M(u − v) = ½·h·f and v⁺ = 2u − v.

use super::Dynamics;
use super::scheme::Acceleration;
use super::second_order::rates;
use crate::math::{V3, cayley};
use crate::state::Motion;

impl Dynamics {
    /// Poses and rates at the end for the mean rates in `solution`.
    pub(super) fn find_ends_midpoint(&mut self) {
        let h = self.h;
        for b in 0..self.ends.len() {
            let (start, at) = (&self.starts[b], self.kkt.body_at[b]);
            let u = V3::from_row_slice(&self.solution[at..at + 3]);
            let turn = V3::from_row_slice(&self.solution[at + 3..at + 6]);
            self.turns[b] = h * turn;
            let step = cayley(&self.turns[b]);
            let mut q = step * start.q;
            q.renormalize_fast();
            self.ends[b] =
                Motion { c: start.c + h * u, q, v: 2.0 * u - start.v, w: 2.0 * turn - step * start.w };
            let (before, after) = (rates(start), rates(&self.ends[b]));
            let mean: [f64; 6] = std::array::from_fn(|k| (after[k] - before[k]) / h);
            self.end_accelerations[b] = Acceleration { algorithmic: mean, real: mean };
        }
    }

    /// Adds ½·(h·f − change of momentum) of a body to `correction`.
    pub(super) fn equilibrium_midpoint(&mut self, b: usize) {
        let body = &self.model.bodies[b];
        let (start, end) = (&self.starts[b], &self.ends[b]);
        let load = &self.loads[b];
        let force = body.mass * self.model.gravity + load.force;
        let push = self.h * force - body.mass * (end.v - start.v);
        let spin = |m: &Motion| m.q * (body.inertia * m.q.inverse_transform_vector(&m.w));
        let turn = self.h * load.moment + spin(start) - spin(end);
        let at = self.kkt.body_at[b];
        for k in 0..3 {
            self.correction[at + k] += 0.5 * push[k];
            self.correction[at + 3 + k] += 0.5 * turn[k];
        }
    }
}
