//! Vectors and unit quaternions (w, x, y, z) for parts that the coordinator turns: glue, feet and bodies of FMUs.

/// Vector, in m or the unit of the value.
pub type Vector = [f64; 3];
/// Unit quaternion w, x, y, z.
pub type Quaternion = [f64; 4];

/// No rotation.
pub const IDENTITY: Quaternion = [1.0, 0.0, 0.0, 0.0];

/// a + b.
#[inline]
pub fn plus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

/// a − b.
#[inline]
pub fn minus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] - b[k])
}

/// a · b.
#[inline]
pub fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

/// a × b.
#[inline]
pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// |v|.
#[inline]
pub fn length(v: Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The rotation back.
pub fn conjugate([w, x, y, z]: Quaternion) -> Quaternion {
    [w, -x, -y, -z]
}

/// First b, then a.
pub fn product([aw, ax, ay, az]: Quaternion, [bw, bx, by, bz]: Quaternion) -> Quaternion {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

/// A vector turned.
pub fn turned(q: Quaternion, v: Vector) -> Vector {
    let [_, x, y, z] = product(product(q, [0.0, v[0], v[1], v[2]]), conjugate(q));
    [x, y, z]
}

/// Way of the tip of an arm that is turned, (R − 1)·arm, without cancellation.
pub fn swing([w, x, y, z]: Quaternion, arm: Vector) -> Vector {
    let u = [x, y, z];
    let twice = cross(u, arm).map(|x| 2.0 * x);
    plus(twice.map(|x| w * x), cross(u, twice))
}

/// Unit quaternion of a rotation vector, rad.
pub fn quaternion(turn: Vector) -> Quaternion {
    let angle = length(turn);
    if angle == 0.0 {
        return IDENTITY;
    }
    let s = libm::sin(0.5 * angle) / angle;
    [libm::cos(0.5 * angle), s * turn[0], s * turn[1], s * turn[2]]
}

/// Rotation vector of a unit quaternion, the short way round, rad.
pub fn rotation_vector([w, x, y, z]: Quaternion) -> Vector {
    let flip = if w < 0.0 { -1.0 } else { 1.0 };
    let s = length([x, y, z]);
    if s == 0.0 {
        return [0.0; 3];
    }
    let factor = flip * 2.0 * libm::atan2(s, flip * w) / s;
    [factor * x, factor * y, factor * z]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: Vector, b: Vector) -> bool {
        length(minus(a, b)) < 1e-15
    }

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let q = quaternion([0.0, 0.0, std::f64::consts::FRAC_PI_2]);
        assert!(near(turned(q, [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]));
        assert!(near(swing(q, [1.0, 0.0, 0.5]), [-1.0, 1.0, 0.0]));
    }

    #[test]
    fn the_rotation_vector_is_the_short_way_of_either_sign() {
        let turn = [0.3, -0.5, 0.2];
        let q = quaternion(turn);
        assert!(near(rotation_vector(q), turn) && near(rotation_vector(q.map(|x| -x)), turn));
        let small = [1e-9, 2e-9, -1e-9];
        assert!(length(minus(rotation_vector(quaternion(small)), small)) < 1e-24);
    }

    #[test]
    fn a_small_swing_keeps_its_digits() {
        let (turn, arm) = ([0.0, 0.0, 1e-12], [1.0, 0.0, 0.0]);
        let [x, y, _] = swing(quaternion(turn), arm);
        assert!((y / 1e-12 - 1.0).abs() < 1e-15 && (x / -5e-25 - 1.0).abs() < 1e-12, "{x:e} {y:e}");
    }
}
