//! Prior knowledge of a pose, before it is searched.

use crate::pose::{Pose2, wrapped};

/// By how much an area that is searched is larger than the prior, so that a wrong prior is noticed.
pub(super) const SLACK: f64 = 1.5;

/// Prior knowledge of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Place, m.
    pub place: [f64; 2],
    /// The pose is within this distance of it, m.
    pub radius: f64,
    /// Direction and by how much it may be wrong, rad.
    pub yaw: Option<[f64; 2]>,
}

impl Prior {
    pub(super) fn allows_place(&self, at: [f64; 2], slack: f64) -> bool {
        let (x, y) = (at[0] - self.place[0], at[1] - self.place[1]);
        x * x + y * y <= slack * slack * self.radius * self.radius
    }

    /// Whether a pose is within it; `slack` stretches it.
    pub(super) fn allows(&self, pose: &Pose2, slack: f64) -> bool {
        self.allows_place([pose.x, pose.y], slack)
            && self.yaw.is_none_or(|[yaw, off]| wrapped(pose.yaw - yaw).abs() <= slack * off)
    }
}
