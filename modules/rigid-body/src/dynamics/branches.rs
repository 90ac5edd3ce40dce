//! The branches on which the axes of the joints are: motors within their bounds or at them, stops, brakes.

use crate::actuator::curve::Mode;
use crate::drive::{Axis, Span, YIELDING};
use crate::joint::Joint;
use crate::state::JointState;

/// The axes of all joints, and the branch of each.
pub(crate) struct Branches {
    pub axes: Vec<Axis>,
    /// Those for which the factor stands.
    pub modes: Vec<Mode>,
    next_modes: Vec<Mode>,
    pub(super) broken: Vec<bool>,
    /// See [`YIELDING`].
    pub yielding: f64,
}

impl Branches {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self {
            axes: vec![Axis::idle(); joints],
            modes: vec![Mode::Free; joints],
            next_modes: vec![Mode::Free; joints],
            broken: vec![false; joints],
            yielding: 0.0,
        }
    }

    /// Number of axes.
    pub fn len(&self) -> usize {
        self.axes.len()
    }

    /// Makes the axis of joint j for a step, on the branch where the last one left it.
    pub fn renew(&mut self, j: usize, joint: &Joint, s: &JointState, span: &Span) {
        self.broken[j] = s.broken;
        self.axes[j].renew(s, joint.limits, span);
        self.modes[j] = self.axes[j].start(s.mode);
    }

    /// The free row of joint j, unless it is broken.
    pub fn free(&self, j: usize, joint: &Joint) -> Option<usize> {
        joint.free_row().filter(|_| !self.broken[j])
    }

    /// Compliance and right-hand side of the row that axis j is on its branch; none: it acts as an impulse.
    pub fn row(&self, j: usize) -> Option<(f64, f64)> {
        self.axes[j].row(self.modes[j])
    }

    /// Impulse of axis j on its branch where it is no row.
    pub fn impulse(&self, j: usize) -> f64 {
        self.axes[j].impulse(self.modes[j])
    }

    /// Lets rigid motors give way from the start, or not at all.
    pub fn yield_where(&mut self, touches: bool) {
        self.yielding = if touches { YIELDING } else { 0.0 };
    }

    /// A round of changes begins.
    pub fn begin_changes(&mut self) {
        self.next_modes.clone_from(&self.modes);
    }

    /// Notes the branch on which axis j lies with that rate and impulse; whether it is another one.
    pub fn propose(&mut self, j: usize, (rate, impulse): (f64, f64), takes: bool) -> bool {
        let next = self.axes[j].next(self.modes[j], rate, impulse);
        let changes = next != self.modes[j] && takes;
        if changes {
            self.next_modes[j] = next;
        }
        changes
    }

    /// Takes the changes of the round.
    pub fn accept_changes(&mut self) {
        std::mem::swap(&mut self.modes, &mut self.next_modes);
    }
}
