//! Start of a step: the motion there, and the motion of the bodies without impulses.

use super::gyro;
use super::scheme::Acceleration;
use crate::closure::Poses;
use crate::math::{Q, V3, cayley};
use crate::model::{Body, Model};
use crate::motion::Motion;
use crate::state::{Load, State};

/// The start of a step.
pub(crate) struct StepStart {
    pub bodies: Vec<Motion>,
    /// Accelerations and other data that the second-order options read from the state.
    pub accelerations: Vec<Acceleration>,
    pub(super) angles: Vec<f64>,
    pub(super) loads: Vec<Load>,
    /// World rates of free rotation in the middle and at the end of the step.
    pub(super) middle_rate: Vec<V3>,
    pub(super) free_rate: Vec<V3>,
    /// Rates of the force-free motion, laid out as the unknowns.
    pub(super) free: Vec<f64>,
}

impl StepStart {
    /// For so many bodies, joints and unknowns.
    pub fn new(bodies: usize, joints: usize, unknowns: usize) -> Self {
        Self {
            bodies: vec![Motion::at(V3::zeros(), Q::identity()); bodies],
            accelerations: vec![Acceleration::default(); bodies],
            angles: vec![0.0; joints],
            loads: vec![Load::default(); bodies],
            middle_rate: vec![V3::zeros(); bodies],
            free_rate: vec![V3::zeros(); bodies],
            free: vec![0.0; unknowns],
        }
    }

    /// Takes over the motion of a state.
    pub fn take(&mut self, state: &State) {
        self.bodies.clone_from(&state.bodies);
        self.angles.clear();
        self.angles.extend(state.joints.iter().map(|j| j.angle));
    }

    /// Finds how body b rotates over h without moments. Rates at the end are given in the axes of the turned body.
    pub fn rotate_freely(&mut self, b: usize, body: &Body, h: f64) {
        let m = &self.bodies[b];
        let (middle, end) = gyro::free_rotation(&body.inertia, &m.q.inverse_transform_vector(&m.w), h);
        self.middle_rate[b] = m.q * middle;
        self.free_rate[b] = cayley(&(h * self.middle_rate[b])) * (m.q * end);
    }

    /// The force-free motion of first order: rates as they are, turned as in free rotation; `body_at`: unknowns of the bodies.
    pub fn go_on_freely(&mut self, body_at: &[usize]) {
        for (b, at) in body_at.iter().enumerate() {
            self.free[*at..at + 3].copy_from_slice(self.bodies[b].v.as_slice());
            self.free[at + 3..at + 6].copy_from_slice(self.free_rate[b].as_slice());
        }
    }

    /// Poses of the start, for the connections beyond the tree.
    pub fn poses<'a>(&'a self, model: &'a Model) -> Poses<'a> {
        Poses { joints: &model.joints, before: None, bodies: &self.bodies, near: &self.angles }
    }
}
