//! Grousers: plates, lugs or cleats on the rim of a wheel, and the soil that is caught between them.
//!
//! Soil between grousers that follow each other closely cannot stay behind: it is sheared along the circle of their tips, and the wheel bears
//! and pulls as a cylinder of that radius (Wong 2008, Theory of Ground Vehicles, ch. 4; Ishigami et al. 2007, J. Field Robotics 24). They
//! do where the chord between two tips passes below the rim, so that a plane would not touch it: R (1 − cos(pitch/2)) ≤ height.
//! Single paddles further apart count by their own shape alone. On firm ground, where thin tips cut in before the rim stands, the wheel stands
//! higher than that, by the height of the grousers at most.
//!
//! Grousers are found by the underside alone: nodes of a round underside that lie outside the circle of all others. A plate thinner than
//! a cell lies above a node now and then only; what was seen once is remembered.

/// A node that lies less outside the rim belongs to it, relative to the radius of the rim; one that lies further out than the other
/// is another shape.
const HEIGHTS: [f64; 2] = [0.02, 0.35];
/// A node counts as one of a tip from this part of the height of the grousers on.
const TIP: f64 = 0.7;
/// Cosine of the angle between the normal of a rim or a tip and its radius, at least.
const RADIAL: f64 = 0.95;
/// Most grousers below a wheel at a time that are told apart.
const MOST: usize = 32;
/// Distance from a rim over its radius from which on nodes count less, in the rounds of its fit by normals and in those by distances.
const BY_NORMALS: [f64; 2] = [0.3, 0.1];
const BY_DISTANCES: [f64; 5] = [0.1, 0.05, 0.02, 0.01, 0.005];
/// Part of the nodes that must lie on the rim.
const ON_RIM: f64 = 0.5;
/// Squared part of a normal across the axle from which on it is one of the rim or of grousers.
const ACROSS: f64 = 0.98;
/// A rim has this many faces or more; normals that differ by less are those of one.
const FACES: usize = 5;
const ALIKE: f64 = 1e-6;

/// Grousers of a wheel as they were found. Part of the committed state.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Grousers {
    /// Height above the rim, m; 0: none were seen.
    pub height: f64,
    /// Least angle between two of them, rad; 0: no two were seen at a time.
    pub pitch: f64,
}

/// Plane across the axle of a wheel.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// Direction of travel along t1 and t2.
    pub heading: [f64; 2],
    /// Sine and cosine of the lean of the axle.
    pub lean: [f64; 2],
}

impl Section {
    /// Across an axle, see [`Wheel::heading`] and [`Wheel::lean`].
    pub fn new(heading: [f64; 2], lean: f64) -> Self {
        Self { heading, lean: [libm::sin(lean), libm::cos(lean)] }
    }

    /// Parts of a vector along n, t1, t2 towards the axle and along the heading.
    #[inline]
    pub fn of(&self, v: [f64; 3]) -> [f64; 2] {
        let ([sin, cos], [a, b]) = (self.lean, self.heading);
        let across = v[2] * a - v[1] * b;
        [cos * v[0] + sin * across, v[1] * a + v[2] * b]
    }

    /// The vector along n, t1, t2 that has these parts.
    #[inline]
    pub fn vector(&self, [up, along]: [f64; 2]) -> [f64; 3] {
        let ([sin, cos], [a, b]) = (self.lean, self.heading);
        let side = up * sin;
        [up * cos, along * a - side * b, along * b + side * a]
    }
}

/// Rim of a wheel in its [`Section`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rim {
    /// The axle as seen from the port, towards the axle and along the heading, m.
    pub axle: [f64; 2],
    /// Its radius, m.
    pub radius: f64,
}

/// A point of the underside and its inward normal, both in the section.
pub type Point = ([f64; 2], [f64; 2]);

/// Whether the underside is that of a rim or of grousers there, and not that of the end of a cylinder that leans.
pub fn is_across((_, nu): &Point) -> bool {
    nu[0] * nu[0] + nu[1] * nu[1] > ACROSS
}

impl Rim {
    /// Whether none of the points lies outside the circle of a radius (m) through the port.
    pub fn is_even(radius: f64, points: impl Iterator<Item = Point>) -> bool {
        let most = (1.0 + HEIGHTS[0]) * radius;
        points.map(|([up, along], _)| (up - radius) * (up - radius) + along * along).all(|d| d <= most * most)
    }

    /// The circle of most of the points. Least squares in which a point counts less the further it lies off (weights of Geman and McClure
    /// 1985): first as the axle lies the radius from each along its normal, which needs no start; then by the distances from the axle
    /// (Gauss–Newton), which do not care that the faces of a mesh are flat. `None` where no circle has enough of them, some lie
    /// inside, or few faces make it, as those of a box on its edge.
    ///
    /// `known`: radius of the rim as it was found before, m, or 0. It stays where few nodes tell a new one.
    pub fn find(points: impl Iterator<Item = Point> + Clone, known: f64) -> Option<Self> {
        if known <= 0.0 {
            return Self::roughly(points.clone())?.refined(points);
        }
        let rough = Self::of_radius(known, points.clone());
        let fine = rough.refined(points.clone()).filter(|rim| rim.has(known));
        fine.or_else(|| points.into_iter().all(|(p, _)| rough.may_hold(p)).then_some(rough))
    }

    /// Whether its radius is about `radius`, m.
    pub fn has(&self, radius: f64) -> bool {
        (self.radius - radius).abs() < HEIGHTS[0] * radius
    }

    /// Where most of the points see the axle of a rim of this radius (m): mean shift.
    fn of_radius(radius: f64, points: impl Iterator<Item = Point> + Clone) -> Self {
        let mut axle: Option<[f64; 2]> = None;
        for scale in [f64::INFINITY, 1.0, 0.3, 0.1, 0.05] {
            let (mut all, mut sum) = (0.0, [0.0; 2]);
            for (p, nu) in points.clone() {
                let seen = [0, 1].map(|c| p[c] + radius * nu[c]);
                let w = axle.map_or(1.0, |axle| weight(distance(seen, axle), scale * radius));
                all += w;
                sum = [0, 1].map(|c| sum[c] + w * seen[c]);
            }
            axle = Some(sum.map(|s| s / all));
        }
        Self { axle: axle.unwrap_or_default(), radius }
    }

    /// Fitted from here.
    fn refined(self, points: impl Iterator<Item = Point> + Clone) -> Option<Self> {
        let mut rim = self;
        for scale in BY_DISTANCES {
            rim = rim.by_distances(points.clone(), scale)?;
        }
        let (mut all, mut near, mut faces, mut count) = (0.0, 0.0, [[0.0; 2]; FACES], 0);
        for (p, nu) in points {
            all += 1.0;
            if !rim.may_hold(p) {
                return None;
            }
            let [up, along] = [rim.axle[0] - p[0], rim.axle[1] - p[1]];
            let size = (up * up + along * along).sqrt();
            if size < (1.0 + HEIGHTS[0]) * rim.radius && up * nu[0] + along * nu[1] > RADIAL * size {
                near += 1.0;
                if count < FACES && faces[..count].iter().all(|face| distance(*face, nu) > ALIKE) {
                    faces[count] = nu;
                    count += 1;
                }
            }
        }
        (near > ON_RIM * all && count == FACES).then_some(rim)
    }

    /// Whether a point may be one of the rim or of grousers.
    fn may_hold(&self, p: [f64; 2]) -> bool {
        let off = distance(p, self.axle) / self.radius - 1.0;
        (-HEIGHTS[0]..HEIGHTS[1]).contains(&off)
    }

    /// From nothing.
    fn roughly(points: impl Iterator<Item = Point> + Clone) -> Option<Self> {
        let mut rim = Self::by_normals(points.clone().map(|(p, nu)| (p, nu, 1.0)))?;
        for scale in BY_NORMALS {
            let weighted = |(p, nu): Point| {
                let off = [0, 1].map(|c| p[c] + rim.radius * nu[c] - rim.axle[c]);
                (p, nu, weight((off[0] * off[0] + off[1] * off[1]).sqrt(), scale * rim.radius))
            };
            rim = Self::by_normals(points.clone().map(weighted))?;
        }
        Some(rim)
    }

    /// Weighted least squares of p + r·ν = axle.
    fn by_normals(points: impl Iterator<Item = ([f64; 2], [f64; 2], f64)> + Clone) -> Option<Self> {
        let (mut all, mut p_mean, mut nu_mean) = (0.0, [0.0; 2], [0.0; 2]);
        for (p, nu, w) in points.clone() {
            all += w;
            p_mean = [p_mean[0] + w * p[0], p_mean[1] + w * p[1]];
            nu_mean = [nu_mean[0] + w * nu[0], nu_mean[1] + w * nu[1]];
        }
        let (p_mean, nu_mean) = (p_mean.map(|s| s / all), nu_mean.map(|s| s / all));
        let (mut product, mut square) = (0.0, 0.0);
        for (p, nu, w) in points {
            let d = [0, 1].map(|c| nu[c] - nu_mean[c]);
            product += w * (d[0] * (p[0] - p_mean[0]) + d[1] * (p[1] - p_mean[1]));
            square += w * (d[0] * d[0] + d[1] * d[1]);
        }
        let radius = -product / square;
        let axle = [0, 1].map(|c| p_mean[c] + radius * nu_mean[c]);
        (radius > 0.0 && radius.is_finite()).then_some(Self { axle, radius })
    }

    /// One round of |p − axle| = r for points whose normal is radial, linearised here.
    fn by_distances(&self, points: impl Iterator<Item = Point> + Clone, scale: f64) -> Option<Self> {
        let each = points.map(|(p, nu)| {
            let size = distance(p, self.axle);
            let u = [0, 1].map(|c| (p[c] - self.axle[c]) / size);
            let radial = u[0] * nu[0] + u[1] * nu[1] < -RADIAL;
            let weight = if radial { weight(size - self.radius, scale * self.radius) } else { 0.0 };
            (u, size, weight)
        });
        let (mut all, mut u_mean, mut size_mean) = (0.0, [0.0; 2], 0.0);
        for (u, size, w) in each.clone() {
            all += w;
            u_mean = [u_mean[0] + w * u[0], u_mean[1] + w * u[1]];
            size_mean += w * size;
        }
        let (u_mean, size_mean) = (u_mean.map(|s| s / all), size_mean / all);
        let (mut matrix, mut right) = ([0.0; 3], [0.0; 2]);
        for (u, size, w) in each {
            let d = [0, 1].map(|c| u[c] - u_mean[c]);
            matrix = [matrix[0] + w * d[0] * d[0], matrix[1] + w * d[0] * d[1], matrix[2] + w * d[1] * d[1]];
            right = [0, 1].map(|c| right[c] + w * d[c] * (size - size_mean));
        }
        let [xx, xy, yy] = matrix;
        let determinant = xx * yy - xy * xy;
        let moved =
            [(yy * right[0] - xy * right[1]) / determinant, (xx * right[1] - xy * right[0]) / determinant];
        let radius = size_mean - u_mean[0] * moved[0] - u_mean[1] * moved[1];
        let axle = [0, 1].map(|c| self.axle[c] + moved[c]);
        (radius > 0.0 && radius.is_finite()).then_some(Self { axle, radius })
    }
}

/// Weight of a point that lies `off` (m) the circle.
fn weight(off: f64, scale: f64) -> f64 {
    let part = off * off / (scale * scale);
    1.0 / ((1.0 + part) * (1.0 + part))
}

impl Grousers {
    /// Whether two of them were seen at a time.
    pub fn is_sure(&self) -> bool {
        self.pitch > 0.0
    }

    /// Whether a plane that touches two of them does not touch the rim.
    pub fn are_close(&self, rim: &Rim) -> bool {
        let rises = (rim.radius + self.height) * (1.0 - libm::cos(0.5 * self.pitch));
        self.is_sure() && rises <= self.height
    }

    /// With what the points of a wheel with this rim show.
    pub fn seen(self, rim: &Rim, points: impl Iterator<Item = Point> + Clone) -> Self {
        let out = |p: [f64; 2]| distance(p, rim.axle) - rim.radius;
        let highest = points.clone().fold(self.height, |most, (p, _)| most.max(out(p)));
        if highest < HEIGHTS[0] * rim.radius {
            return self;
        }
        let (mut angles, mut count) = ([0.0; MOST], 0);
        // two places nearer than the grousers are high belong to one
        let apart = highest / rim.radius;
        for (p, nu) in points.filter(|(p, _)| out(*p) > TIP * highest) {
            let (d, size) = ([rim.axle[0] - p[0], rim.axle[1] - p[1]], rim.radius + out(p));
            let radial = (d[0] * nu[0] + d[1] * nu[1]) / size > RADIAL;
            let angle = libm::atan2(-nu[1], nu[0]);
            if radial && count < MOST && angles[..count].iter().all(|a: &f64| (a - angle).abs() > apart) {
                angles[count] = angle;
                count += 1;
            }
        }
        let found = &mut angles[..count];
        found.sort_unstable_by(f64::total_cmp);
        let known = if self.is_sure() { self.pitch } else { f64::INFINITY };
        let pitch = found.windows(2).fold(known, |least, pair| least.min(pair[1] - pair[0]));
        Self { height: highest, pitch: if pitch.is_finite() { pitch } else { 0.0 } }
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    ((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])).sqrt()
}

terraglue_subsystem::persist!(Grousers { height, pitch });

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const RADIUS: f64 = 0.092;
    const HEIGHT: f64 = 0.005;

    /// Points of a rim whose axle lies at `axle`, every other degree, and of the ends and sides of thin plates `pitch` (rad) apart from `start` on.
    fn points(axle: [f64; 2], start: f64, pitch: f64) -> Vec<Point> {
        let radial = |angle: f64| [libm::cos(angle), -libm::sin(angle)];
        let at = |radius: f64, angle: f64| [0, 1].map(|c| axle[c] - radius * radial(angle)[c]);
        let rim = (-30..=30).map(|k| 2.0 * f64::from(k) * std::f64::consts::PI / 180.0);
        let mut all: Vec<Point> = rim.map(|a| (at(RADIUS, a), radial(a))).collect();
        let mut angle = start;
        while angle < 1.0 {
            let (end, [x, y]) = (at(RADIUS + HEIGHT, angle), radial(angle));
            all.extend([
                (end, radial(angle)),
                (at(RADIUS + 0.5 * HEIGHT, angle), [y.abs(), -x * y.signum()]),
            ]);
            angle += pitch;
        }
        all
    }

    proptest! {
        #[test]
        fn rim_and_pitch_are_found_wherever_the_plates_are(
            axle in prop::array::uniform2(-0.01..0.01f64), start in -1.0..-0.7f64, pitch in 0.15..0.6f64,
        ) {
            let points = points([RADIUS + axle[0], axle[1]], start, pitch);
            let rim = Rim::find(points.iter().copied(), 0.0).expect("a rim");
            prop_assert!((rim.radius - RADIUS).abs() < 2e-3 * RADIUS, "{rim:?}");
            prop_assert!(distance(rim.axle, [RADIUS + axle[0], axle[1]]) < 2e-3 * RADIUS, "{rim:?}");
            prop_assert!(!Rim::is_even(rim.radius, points.iter().map(|(p, nu)| ([p[0] - axle[0], p[1] - axle[1]], *nu))));
            let seen = Grousers::default().seen(&rim, points.into_iter());
            prop_assert!((seen.height - HEIGHT).abs() < 2e-3 * RADIUS && (seen.pitch - pitch).abs() < 1e-6, "{seen:?}");
        }

        #[test]
        fn a_section_gives_back_its_vectors(angle in -3.0..3.0f64, lean in -0.5..0.5f64, parts in prop::array::uniform2(-1.0..1.0f64)) {
            let section = Section::new([libm::cos(angle), libm::sin(angle)], lean);
            let back = section.of(section.vector(parts));
            prop_assert!((0..2).all(|c| (back[c] - parts[c]).abs() < 1e-14));
        }
    }

    /// A box that comes down on its edge is no wheel, whatever its angle.
    #[test]
    fn a_wedge_has_no_rim() {
        for angle in [0.2_f64, 0.6, 1.0] {
            let face = |sign: f64| {
                (1..20).map(move |k| {
                    let s = 0.005 * f64::from(k);
                    (
                        [s * libm::sin(angle), sign * s * libm::cos(angle)],
                        [libm::cos(angle), -sign * libm::sin(angle)],
                    )
                })
            };
            assert_eq!(Rim::find(face(1.0).chain(face(-1.0)), 0.0), None, "{angle}");
        }
    }
}
