//! Where a line meets the shapes with a closed form, how far a point is from them, and which way their surfaces look.
//!
//! All in the frame of the shape. A line is given by its point nearest to the shape's centre, so that what is left of double
//! precision does not depend on how far away it starts.

mod capsule;
mod cone_frustum;
mod cuboid;
mod ellipsoid;
mod sphere;

use crate::tree::Line;
use terraglue_numerics::rotation::dot;
use terraglue_subsystem::Geometry;

/// Relative width by which the parts of a surface overlap, so that no line passes between them.
const SEAM: f64 = 1e-12;

/// A shape with a closed form, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Primitive {
    Sphere {
        radius: f64,
    },
    Cuboid {
        half: [f64; 3],
    },
    Capsule {
        half: f64,
        radius: f64,
    },
    /// Radii at z = −half and z = half; a cylinder where they are equal.
    ConeFrustum {
        half: f64,
        bottom: f64,
        top: f64,
    },
    Ellipsoid {
        axes: [f64; 3],
    },
}

impl Primitive {
    /// The closed form of a geometry; none: it is a mesh.
    pub fn of(geometry: &Geometry) -> Option<Self> {
        Some(match *geometry {
            Geometry::Sphere { radius } => Self::Sphere { radius },
            Geometry::Box { half_extents } => Self::Cuboid { half: half_extents },
            Geometry::Capsule { half_length, radius } => Self::Capsule { half: half_length, radius },
            Geometry::Cylinder { half_length, radius } => {
                Self::ConeFrustum { half: half_length, bottom: radius, top: radius }
            }
            Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
                Self::ConeFrustum { half: half_length, bottom: radius_bottom, top: radius_top }
            }
            Geometry::Ellipsoid { semi_axes } => Self::Ellipsoid { axes: semi_axes },
            Geometry::ConvexMesh { .. } | Geometry::Mesh { .. } => return None,
        })
    }

    /// Distance along a line to the surface, not before its start; ∞: it misses.
    #[inline]
    pub fn cast(&self, line: &Line) -> f64 {
        let shift = -dot(line.origin, line.direction);
        let (near, d) = (line.at(shift), line.direction);
        let mut first = First { shift, best: f64::INFINITY };
        match self {
            Self::Sphere { radius } => sphere::cast(*radius, near, &mut first),
            Self::Cuboid { half } => cuboid::cast(half, near, d, &mut first),
            Self::Capsule { half, radius } => capsule::cast(*half, *radius, near, d, &mut first),
            Self::ConeFrustum { half, bottom, top } => {
                cone_frustum::cast(*half, [*bottom, *top], near, d, &mut first);
            }
            Self::Ellipsoid { axes } => ellipsoid::cast(axes, near, d, &mut first),
        }
        first.best
    }

    /// Outward direction of the surface at a point on it, of any length.
    pub fn outward(&self, p: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Sphere { .. } => p,
            Self::Cuboid { half } => cuboid::outward(half, p),
            Self::Capsule { half, .. } => [p[0], p[1], p[2] - p[2].clamp(-half, *half)],
            Self::ConeFrustum { half, bottom, top } => cone_frustum::outward(*half, [*bottom, *top], p),
            Self::Ellipsoid { axes } => std::array::from_fn(|k| p[k] / (axes[k] * axes[k])),
        }
    }

    /// Distance of a point from the solid; 0 inside.
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        match self {
            Self::Sphere { radius } => (dot(p, p).sqrt() - radius).max(0.0),
            Self::Cuboid { half } => cuboid::distance(half, p),
            Self::Capsule { half, radius } => {
                let along = p[2] - p[2].clamp(-half, *half);
                ((p[0] * p[0] + p[1] * p[1] + along * along).sqrt() - radius).max(0.0)
            }
            Self::ConeFrustum { half, bottom, top } => cone_frustum::distance(*half, [*bottom, *top], p),
            Self::Ellipsoid { axes } => ellipsoid::distance(axes, p),
        }
    }
}

/// The first place on a line, not before its start.
struct First {
    /// From the start to the point that lengths are counted from.
    shift: f64,
    best: f64,
}

impl First {
    /// The line meets a surface `s` behind the point that lengths are counted from.
    #[inline]
    fn offer(&mut self, s: f64) {
        let t = self.shift + s;
        if t >= 0.0 && t < self.best {
            self.best = t;
        }
    }
}

/// Roots of a·s² + 2·b·s + c, without cancellation; none: there are none.
#[inline]
fn roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let discriminant = b * b - a * c;
    if !(discriminant >= 0.0) {
        return None;
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    Some([q / a, c / q])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ahead(origin: [f64; 3]) -> Line {
        Line { origin, direction: [1.0, 0.0, 0.0] }
    }

    #[test]
    fn a_line_through_the_middle_meets_the_near_side_and_from_inside_the_far_one() {
        let shapes = [
            Primitive::Sphere { radius: 0.5 },
            Primitive::Cuboid { half: [0.5, 1.0, 2.0] },
            Primitive::Capsule { half: 1.0, radius: 0.5 },
            Primitive::ConeFrustum { half: 1.0, bottom: 0.7, top: 0.3 },
            Primitive::Ellipsoid { axes: [0.5, 0.1, 3.0] },
        ];
        for shape in shapes {
            let (outside, inside) = (shape.cast(&ahead([-2.0, 0.0, 0.0])), shape.cast(&ahead([0.0; 3])));
            assert!((outside - 1.5).abs() < 1e-15 && (inside - 0.5).abs() < 1e-15, "{shape:?}");
            assert_eq!(shape.cast(&ahead([2.0, 0.0, 0.0])), f64::INFINITY, "{shape:?}");
            let outward = shape.outward([-0.5, 0.0, 0.0]);
            assert!(outward[0] < 0.0 && outward[1] == 0.0, "{shape:?}");
            assert!(
                (shape.distance([-1.5, 0.0, 0.0]) - 1.0).abs() < 0.03
                    && shape.distance([0.1, 0.0, 0.0]) == 0.0
            );
        }
    }

    #[test]
    fn far_away_nothing_is_lost_but_the_last_digits_of_the_way() {
        let far = ahead([-1e6, 0.3, 0.1]);
        let t = Primitive::Sphere { radius: 0.5 }.cast(&far);
        let right = 1e6 - (0.25_f64 - 0.09 - 0.01).sqrt();
        assert!((t - right).abs() < 1e-9, "{t}");
    }

    #[test]
    fn the_seam_of_side_and_end_lets_nothing_through() {
        let stem = Primitive::ConeFrustum { half: 5.0, bottom: 0.3, top: 0.1 };
        let d = [0.6, 0.0, -0.8];
        for k in 0..1000 {
            let angle = f64::from(k) * 0.006;
            let rim = [0.1 * libm_cos(angle), 0.1 * libm_sin(angle), 5.0];
            let origin = std::array::from_fn(|k| rim[k] - 20.0 * d[k]);
            let t = stem.cast(&Line { origin, direction: d });
            // lines that reach the rim from outside the frustum touch it there
            assert!(rim[0] > 0.05 || (t - 20.0).abs() < 1e-6, "{k}: {t}");
        }
    }

    fn libm_cos(x: f64) -> f64 {
        terraglue_numerics::rotation::quaternion([2.0 * x, 0.0, 0.0])[0]
    }

    fn libm_sin(x: f64) -> f64 {
        terraglue_numerics::rotation::quaternion([2.0 * x, 0.0, 0.0])[1]
    }
}
