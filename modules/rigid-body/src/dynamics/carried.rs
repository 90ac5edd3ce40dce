//! Forces on points that go with their bodies while a step of second order turns them.
//!
//! External impulses stand about the centre of mass with the arm that the force has at the start of the step. The rule
//! of first order takes them so; the others take forces later ([`super::scheme::Integrator::force_time`]), and the arm
//! with them, else moments are off by the order of the step. For the midpoint rule the mean arm also makes the work on
//! the body that of the force on its point: (R − 1)·arm = θ × mean arm for the Cayley transform R of θ.

use super::scheme::Integrator;
use crate::math::{V3, cayley_shift};

/// An impulse on a point of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carried {
    pub body: usize,
    /// From the centre of mass to the point that turns with the body at the start of the step, m, world axes.
    pub arm: V3,
    /// Impulse, N s, world axes.
    pub force: V3,
}

impl Carried {
    /// Moment that the turning of its arm adds to the impulse, N m s; `turns`: rotation vectors of the bodies.
    pub fn turned(&self, integrator: &Integrator, turns: &[V3]) -> V3 {
        if !integrator.is_second_order() {
            return V3::zeros();
        }
        let shift = cayley_shift(&turns[self.body], &self.arm);
        (integrator.force_time() * shift).cross(&self.force)
    }
}
