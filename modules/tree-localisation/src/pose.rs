//! Places and directions in the horizontal plane.

use std::f64::consts::{PI, TAU};

/// Place and direction of a frame in another one, seen from above.
///
/// ```
/// use terraglue_tree_localisation::Pose2;
/// let pose = Pose2 { x: 1.0, y: 2.0, yaw: std::f64::consts::FRAC_PI_2 };
/// let [x, y] = pose.place([3.0, 0.0]);
/// assert!((x - 1.0).abs() < 1e-12 && (y - 5.0).abs() < 1e-12);
/// let [x, y] = pose.inverse().place([x, y]);
/// assert!((x - 3.0).abs() < 1e-12 && y.abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Pose2 {
    /// Place, m.
    pub x: f64,
    /// Place, m.
    pub y: f64,
    /// Turn, counter-clockwise, rad.
    pub yaw: f64,
}
terraglue_subsystem::persist!(Pose2 { x, y, yaw });

impl Pose2 {
    /// A point of the inner frame in the outer one.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = (libm::sin(self.yaw), libm::cos(self.yaw));
        [self.x + c * x - s * y, self.y + s * x + c * y]
    }

    /// The pose of a frame that has the pose `inner` in this one.
    pub fn then(&self, inner: &Self) -> Self {
        let [x, y] = self.place([inner.x, inner.y]);
        Self { x, y, yaw: wrapped(self.yaw + inner.yaw) }
    }

    /// The pose of the outer frame in the inner one.
    pub fn inverse(&self) -> Self {
        let back = Self { x: 0.0, y: 0.0, yaw: -self.yaw };
        let [x, y] = back.place([-self.x, -self.y]);
        Self { x, y, yaw: back.yaw }
    }

    /// How far it is from another one, m, and by how much they are turned to each other, rad.
    pub fn gap(&self, other: &Self) -> (f64, f64) {
        let (x, y) = (self.x - other.x, self.y - other.y);
        ((x * x + y * y).sqrt(), wrapped(self.yaw - other.yaw).abs())
    }
}

/// An angle in −π … π.
pub fn wrapped(angle: f64) -> f64 {
    let turned = (angle + PI) / TAU;
    (turned - turned.floor()) * TAU - PI
}
