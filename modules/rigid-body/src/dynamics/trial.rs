//! The outcome of a trial: rates and impulses, and where bodies end by them.

use super::kkt::Kkt;
use super::scheme::{Acceleration, Six};
use super::start::StepStart;
use crate::math::{Q, V3, cayley};
use crate::model::Body;
use crate::motion::Motion;

/// Results of a trial.
pub(crate) struct Trial {
    /// Rates and (negative) impulses.
    pub solution: Vec<f64>,
    /// Motion at the end and rotation vector (before the Cayley transform) of each body.
    pub ends: Vec<Motion>,
    pub turns: Vec<V3>,
    /// Accelerations at the end, in second order.
    pub accelerations: Vec<Acceleration>,
}

impl Trial {
    /// For so many bodies and unknowns.
    pub fn new(bodies: usize, unknowns: usize) -> Self {
        Self {
            solution: vec![0.0; unknowns],
            ends: vec![Motion::at(V3::zeros(), Q::identity()); bodies],
            turns: vec![V3::zeros(); bodies],
            accelerations: vec![Acceleration::default(); bodies],
        }
    }

    /// Positions at the end of a step of first order of length h.
    pub fn find_places(&mut self, kkt: &Kkt, start: &StepStart, h: f64) {
        for b in 0..self.ends.len() {
            let (begin, at) = (&start.bodies[b], kkt.body_at[b]);
            let u = &self.solution[at..at + 6];
            let (v, w) = (V3::new(u[0], u[1], u[2]), V3::new(u[3], u[4], u[5]));
            let turn = h * (w + start.middle_rate[b] - start.free_rate[b]);
            let mut q = cayley(&turn) * begin.q;
            q.renormalize_fast();
            self.turns[b] = turn;
            (self.ends[b].c, self.ends[b].q) = (begin.c + h * v, q);
        }
    }

    /// Rates of body b at the end of a step of first order, after its position.
    pub fn find_rates(&mut self, b: usize, body: &Body, kkt: &Kkt, start: &StepStart) {
        let (begin, at) = (&start.bodies[b], kkt.body_at[b]);
        let u = &self.solution[at..at + 6];
        let (v, w, q) = (V3::new(u[0], u[1], u[2]), V3::new(u[3], u[4], u[5]), self.ends[b].q);
        // The impulses change the angular momentum; the rate follows with the inertia of the new orientation.
        let momentum = kkt.inertia[b] * (w - start.free_rate[b] + begin.w);
        let rate = q * (body.inverse_inertia * q.inverse_transform_vector(&momentum));
        (self.ends[b].v, self.ends[b].w) = (v, rate);
    }

    /// Change of the rates of a body by all impulses.
    pub fn kick(&self, body: usize, kkt: &Kkt, start: &StepStart) -> Six {
        let at = kkt.body_at[body];
        std::array::from_fn(|k| self.solution[at + k] - start.free[at + k])
    }
}
