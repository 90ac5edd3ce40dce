//! Answers of the last trials of both sides, packed over the ports of a group.

use super::glue::ConstraintKind;

/// Motion of one side at its last trial.
#[derive(Debug, Default)]
pub struct SideMotion {
    /// End-of-step displacement.
    pub x: Vec<f64>,
    /// Velocity.
    pub v: Vec<f64>,
    /// Acceleration.
    pub a: Vec<f64>,
}

impl SideMotion {
    /// At rest, with n components.
    pub(super) fn reset(&mut self, n: usize) {
        for buffer in [&mut self.x, &mut self.v, &mut self.a] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
    }

    /// X, V and A to be written.
    pub(super) fn parts(&mut self) -> [&mut [f64]; 3] {
        [&mut self.x, &mut self.v, &mut self.a]
    }

    /// Soils follow the bodies' motion: their surface is where the body is.
    pub(super) fn follow(&mut self, bodies: &Self, kinds: &[ConstraintKind]) {
        for i in (0..self.x.len()).filter(|i| kinds[*i] != ConstraintKind::Joint) {
            self.x[i] = bodies.x[i];
        }
    }
}

/// Wrenches that side 2 answers to a motion.
#[derive(Debug, Default)]
pub struct LawWrenches {
    /// Of the soils' laws at the committed state.
    pub at_start: Vec<f64>,
    /// Of the last trial.
    pub last: Vec<f64>,
}

impl LawWrenches {
    /// No wrench, with n components.
    pub(super) fn reset(&mut self, n: usize) {
        for buffer in [&mut self.at_start, &mut self.last] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
    }
}
