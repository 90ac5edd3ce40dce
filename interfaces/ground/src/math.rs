//! The little vector algebra that placed shapes need.

use terraglue_subsystem::Pose;

/// Columns are the shape's axes in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation(pub [[f64; 3]; 3]);

impl Rotation {
    /// From a quaternion w, x, y, z; it need not have exactly unit length.
    pub fn from_quaternion(q: [f64; 4]) -> Self {
        let norm = q.iter().map(|c| c * c).sum::<f64>();
        let s = if norm > 0.0 { 2.0 / norm } else { 0.0 };
        let [w, x, y, z] = q;
        Self([
            [1.0 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)],
            [s * (x * y - w * z), 1.0 - s * (x * x + z * z), s * (y * z + w * x)],
            [s * (x * z + w * y), s * (y * z - w * x), 1.0 - s * (x * x + y * y)],
        ])
    }

    /// A vector of the shape's frame in world axes.
    #[inline]
    pub fn to_world(&self, v: [f64; 3]) -> [f64; 3] {
        let c = &self.0;
        std::array::from_fn(|k| c[0][k] * v[0] + c[1][k] * v[1] + c[2][k] * v[2])
    }

    /// A world vector in the shape's axes.
    #[inline]
    pub fn to_shape(&self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| dot(self.0[k], v))
    }
}

#[inline]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
pub(crate) fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

#[inline]
pub(crate) fn scaled(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|c| c * s)
}

/// A point of the shape's frame in the world.
#[inline]
pub(crate) fn point(pose: &Pose, rotation: &Rotation, p: [f64; 3]) -> [f64; 3] {
    add(rotation.to_world(p), pose.position)
}

/// `a_from_c` from `a_from_b` and `b_from_c`.
pub fn compose(a: &Pose, b: &Pose) -> Pose {
    let rotation = Rotation::from_quaternion(a.orientation);
    let [aw, ax, ay, az] = a.orientation;
    let [bw, bx, by, bz] = b.orientation;
    Pose {
        position: point(a, &rotation, b.position),
        orientation: [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
    }
}
