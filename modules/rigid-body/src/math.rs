//! Small rotations and matrices that the dynamics needs.

use nalgebra::{Matrix3, Quaternion, Unit, UnitQuaternion, Vector3};

/// Vector, world axes unless stated otherwise.
pub(crate) type V3 = Vector3<f64>;
/// 3 × 3 matrix.
pub(crate) type M3 = Matrix3<f64>;
/// Rotation.
pub(crate) type Q = UnitQuaternion<f64>;

/// Rotation by the Cayley transform of a rotation vector r (rad): half angle atan(|r|/2). Differs from the
/// exponential by |r|³/12, needs no transcendental function, and conserves energy and momentum of a free body
/// together with the midpoint rule (Austin, Krishnaprasad and Wang 1993).
pub(crate) fn cayley(r: &V3) -> Q {
    Unit::new_normalize(Quaternion::new(1.0, 0.5 * r.x, 0.5 * r.y, 0.5 * r.z))
}

/// Rotation vector (rad) of the Cayley transform of r.
pub(crate) fn cayley_vector(r: &V3) -> V3 {
    let half = 0.5 * r.norm();
    let factor = if half < 1e-4 { 1.0 - half * half / 3.0 } else { libm::atan(half) / half };
    r * factor
}

/// Way of the tip of an arm under the Cayley transform R of a rotation vector, (R − 1)·arm, without cancellation.
pub(crate) fn cayley_shift(r: &V3, arm: &V3) -> V3 {
    let q = cayley(r);
    let twice = 2.0 * q.imag().cross(arm);
    q.w * twice + q.imag().cross(&twice)
}

/// x× as a matrix.
pub(crate) fn skew(v: &V3) -> M3 {
    v.cross_matrix()
}

/// Roll, pitch, yaw (z-y-x Euler angles), rad.
pub(crate) fn euler(q: &Q) -> [f64; 3] {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    let roll = libm::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y));
    let pitch = libm::asin((2.0 * (w * y - z * x)).clamp(-1.0, 1.0));
    let yaw = libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    [roll, pitch, yaw]
}

/// A right-handed frame whose x is `axis`.
pub(crate) fn frame_along(axis: &V3) -> Q {
    let smallest = axis.iamin();
    let t1 = V3::ith(smallest, 1.0).cross(axis).normalize();
    let m = M3::from_columns(&[*axis, t1, axis.cross(&t1)]);
    Q::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(m))
}

/// The angle of `angle + 2πk` that lies nearest to `near`.
pub(crate) fn unwrap_angle(angle: f64, near: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle + turn * ((near - angle) / turn).round()
}

/// A right-handed frame whose tangents do not jump while the normal turns a little.
pub(crate) fn frame_of_normal(n: V3) -> [V3; 3] {
    let along = if n.x.abs() < 0.8 { V3::x() } else { V3::y() };
    let t1 = (along - n * n.dot(&along)).normalize();
    [n, t1, n.cross(&t1)]
}

#[cfg(test)]
#[path = "../tests/unit/math.rs"]
mod tests;
