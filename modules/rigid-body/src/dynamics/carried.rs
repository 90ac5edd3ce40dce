//! Forces on points that go with their bodies while a step of second order turns them.
//!
//! External impulses stand about the centre of mass with the arm that the force has at the start of the step. The rule
//! of first order takes them so; the others take forces later ([`super::scheme::Integrator::force_time`]), and the arm
//! with them, else moments are off by the order of the step. For the midpoint rule the mean arm also makes the work on
//! the body that of the force on its point: (R − 1)·arm = θ × mean arm for the Cayley transform R of θ.

use super::Dynamics;
use crate::math::{V3, cayley_shift};

/// An impulse on a point of a body, or below one: a ball is pressed at its lowest point, which stays below its centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carried {
    pub body: usize,
    /// From the centre of mass to the point that turns with the body at the start of the step, m, world axes.
    pub arm: V3,
    /// Impulse, N s, world axes.
    pub force: V3,
}

impl Dynamics {
    /// Moment that the turning of its arm adds to an impulse, N m s.
    pub fn turned(&self, carried: &Carried) -> V3 {
        if !self.integrator.is_second_order() {
            return V3::zeros();
        }
        let shift = cayley_shift(&self.turns[carried.body], &carried.arm);
        (self.integrator.force_time() * shift).cross(&carried.force)
    }

    /// Adds to `correction` what turned arms change of the external impulses.
    pub(super) fn turn_carried(&mut self) {
        for k in 0..self.carried.len() {
            let carried = self.carried[k];
            let moment = self.turned(&carried);
            let at = self.kkt.body_at[carried.body] + 3;
            self.correction[at..at + 3].iter_mut().zip(&moment).for_each(|(c, m)| *c += m);
        }
    }
}
