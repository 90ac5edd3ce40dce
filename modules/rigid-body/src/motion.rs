//! The motion of one body at one time.

use crate::math::{Q, V3};

/// Motion of a body: centre of mass, orientation, and their rates in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    pub c: V3,
    pub q: Q,
    pub v: V3,
    pub w: V3,
}

impl Motion {
    pub const fn at(c: V3, q: Q) -> Self {
        Self { c, q, v: V3::new(0.0, 0.0, 0.0), w: V3::new(0.0, 0.0, 0.0) }
    }

    /// Position in the world of a point given from the centre of mass in body axes.
    pub fn point(&self, p: &V3) -> V3 {
        self.c + self.q * p
    }
}
