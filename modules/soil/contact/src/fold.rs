//! The upper envelope of some planes over the cell of a node: an underside with edges.

use crate::patch_nodes::Plane;

/// Points along each side of a cell at which an underside with an edge is sampled.
const SAMPLES: usize = 4;
const POINTS: usize = SAMPLES * SAMPLES;
/// Distance of the outermost of them from the node, in cells.
const OUTERMOST: f64 = 0.5 - 0.5 / SAMPLES as f64;
/// The standard deviation of evenly spaced mid-points is smaller than that of the intervals they represent.
const MIDPOINTS: f64 = 1.032_795_558_988_644;
/// Weight of points that are not in the soil, so that an underside looks somewhere before it touches.
const OUTSIDE: f64 = 1e-3;
/// The plane of the node and those of its eight neighbours.
const FACES: usize = 9;

/// Shape of the underside in a cell, relative to its node; heights vertical.
pub struct Underside {
    /// Mean height above the node, m.
    pub rise: f64,
    /// Variance of the height above the plane of the ground, m².
    pub variance: f64,
    /// ∂z/∂x and ∂z/∂y of the part in the soil.
    pub slope: [f64; 2],
    /// Mean of √(1 + slope²) over that of the mean slope.
    pub steeper: f64,
}

impl Underside {
    /// Of one plane alone.
    pub fn of(plane: &Plane, spacing: f64, ground: [f64; 2]) -> Self {
        let tilt = [0, 1].map(|c| plane.slope[c] - ground[c]);
        let variance = spacing * spacing / 12.0 * (tilt[0] * tilt[0] + tilt[1] * tilt[1]);
        Self { rise: 0.0, variance, slope: plane.slope, steeper: 1.0 }
    }
}

/// The planes that meet in a cell. The envelope faces as its part in the soil does: the faces of a wedge in the soil press it, not those
/// above.
pub struct Fold {
    planes: [Plane; FACES],
    count: usize,
    spacing: f64,
    ground: [f64; 2],
}

impl Fold {
    /// Of the plane of a node alone, in a cell of side `spacing` (m) over ground with the slopes `ground`.
    pub fn new(own: Plane, spacing: f64, ground: [f64; 2]) -> Self {
        Self { planes: [own; FACES], count: 1, spacing, ground }
    }

    /// Adds the plane of a neighbour, if it lies highest at one point at least.
    pub fn add(&mut self, plane: Plane) {
        let own = &self.planes[0];
        let rises = (plane.slope[0] - own.slope[0]).abs() + (plane.slope[1] - own.slope[1]).abs();
        if plane.height - own.height + OUTERMOST * self.spacing * rises > 0.0 {
            self.planes[self.count] = plane;
            self.count += 1;
        }
    }

    /// The underside where the soil lies `level` (m) above the node.
    pub fn underside(&self, level: f64) -> Underside {
        match self.count {
            1 => Underside::of(&self.planes[0], self.spacing, self.ground),
            _ => self.envelope(level),
        }
    }

    fn envelope(&self, level: f64) -> Underside {
        let planes = &self.planes[..self.count];
        let own = &planes[0];
        let mut faces = [Face::default(); FACES];
        let place: [f64; SAMPLES] =
            std::array::from_fn(|s| ((s as f64 + 0.5) / SAMPLES as f64 - 0.5) * self.spacing);
        let (mut top, mut highest) = (heights(own, &place), [0; POINTS]);
        faces[0] = self.face(own);
        for (number, plane) in planes.iter().enumerate().skip(1) {
            faces[number] = self.face(plane);
            let z = heights(plane, &place);
            for s in 0..POINTS {
                let over = z[s] > top[s];
                (top[s], highest[s]) = if over { (z[s], number) } else { (top[s], highest[s]) };
            }
        }
        let ground = heights(&Plane { height: own.height, slope: self.ground }, &place);
        let (mut sum, mut rise, mut square, mut stretch, mut weights) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for s in 0..POINTS {
            let face = &faces[highest[s]];
            let over = top[s] - ground[s];
            sum += over;
            rise += top[s] - own.height;
            square += over * over;
            let weight = (face.inside[0] + (level - over) * face.inside[1]).clamp(0.0, 1.0) + OUTSIDE;
            stretch += weight * face.stretch;
            weights += weight;
        }
        let count = POINTS as f64;
        let (mean, [a, b]) = (sum / count, [0, 1].map(|axis| self.mean_slope(axis, &place, level)));
        Underside {
            rise: rise / count,
            variance: (square / count - mean * mean).max(0.0) * MIDPOINTS * MIDPOINTS,
            slope: [a, b],
            steeper: stretch / weights / (1.0 + a * a + b * b).sqrt(),
        }
    }

    /// Mean slope along an axis of the part in the soil, on lines at `place`: how much the underside rises from where it enters the soil
    /// to where it leaves it. Summed over cells, what rises and what falls again cancel, so that soil at one pressure does not
    /// push a level sole aside, whatever its sides look like.
    fn mean_slope(&self, axis: usize, place: &[f64; SAMPLES], level: f64) -> f64 {
        let half = 0.5 * self.spacing;
        let (mut low, mut high) = ([-half; SAMPLES], [half; SAMPLES]);
        let mut ends = [[f64::NEG_INFINITY; SAMPLES]; 2];
        // plane by plane, all lines at once: a plane rises alike along each of them
        for plane in &self.planes[..self.count] {
            let tilt = [0, 1].map(|c| plane.slope[c] - self.ground[c]);
            let (along, over) = (tilt[axis], plane.height - self.planes[0].height);
            let mut below = [0.0; SAMPLES];
            for s in 0..SAMPLES {
                let at = over + tilt[1 - axis] * place[s];
                ends[0][s] = larger(ends[0][s], at - along * half);
                ends[1][s] = larger(ends[1][s], at + along * half);
                below[s] = level - at;
            }
            if along > 0.0 {
                (0..SAMPLES).for_each(|s| high[s] = smaller(high[s], below[s] / along));
            } else if along < 0.0 {
                (0..SAMPLES).for_each(|s| low[s] = larger(low[s], below[s] / along));
            } else {
                let outside = |s: &usize| below[*s] < 0.0;
                (0..SAMPLES).filter(outside).for_each(|s| high[s] = f64::NEG_INFINITY);
            }
        }
        let (mut rises, mut length) = (0.0, 0.0);
        for s in 0..SAMPLES {
            let (low, high, ends) = (low[s], high[s], [ends[0][s], ends[1][s]]);
            if high > low {
                let enters = if low > -half { level } else { ends[0] };
                let leaves = if high < half { level } else { ends[1] };
                rises += leaves - enters;
                length += high - low;
            }
            rises += OUTSIDE * (ends[1] - ends[0]);
            length += OUTSIDE * self.spacing;
        }
        self.ground[axis] + rises / length
    }

    fn face(&self, plane: &Plane) -> Face {
        let [a, b] = plane.slope;
        let falls = ((a - self.ground[0]).abs() + (b - self.ground[1]).abs()) * self.spacing / SAMPLES as f64;
        let inside = if falls > 0.0 { [0.5, 1.0 / falls] } else { [1.0, 0.0] };
        Face { stretch: (1.0 + a * a + b * b).sqrt(), inside }
    }
}

/// The larger of two numbers; the first where they do not compare.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The smaller of two numbers; the first where they do not compare.
#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// Contribution of a face of an underside at each point.
#[derive(Clone, Copy, Default)]
struct Face {
    /// √(1 + slope²).
    stretch: f64,
    /// Part of the cell around a point that is in the soil where the point lies at its level, and its change with the height, 1/m: one
    /// over the height by which the face falls there; one that is level is in the soil as a whole.
    inside: [f64; 2],
}

/// Heights of a plane at the points of a cell, x fastest, whose x and y (m) are `place`.
fn heights(plane: &Plane, place: &[f64; SAMPLES]) -> [f64; POINTS] {
    let x = place.map(|x| plane.height + plane.slope[0] * x);
    let y = place.map(|y| plane.slope[1] * y);
    std::array::from_fn(|s| x[s % SAMPLES] + y[s / SAMPLES])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A plane that lies below the first one at all points changes nothing, and the points reproduce one alone.
        #[test]
        fn what_lies_lower_everywhere_is_left_out(
            slope in prop::array::uniform2(-1.0..1.0f64), other in prop::array::uniform2(-2.0..2.0f64), below in -0.01..0.01f64,
        ) {
            let own = Plane { height: 0.3, slope };
            let mut fold = Fold::new(own, 0.01, [0.1, -0.05]);
            fold.add(Plane { height: own.height - below, slope: other });
            let [found, points] = [fold.underside(0.001), Fold { count: 2, ..fold }.envelope(0.001)];
            let near = |a: f64, b: f64, size: f64| (a - b).abs() <= 1e-9 * size;
            prop_assert!(near(found.rise, points.rise, 0.01));
            prop_assert!(near(found.variance, points.variance, 1e-6));
            prop_assert!((0..2).all(|c| near(found.slope[c], points.slope[c], 1.0)));
            prop_assert!(near(found.steeper, points.steeper, 1.0));
        }

        /// The mean slope of the part in the soil against many points along the same lines.
        #[test]
        fn the_underside_faces_as_its_part_in_the_soil(
            slopes in prop::array::uniform3(prop::array::uniform2(-2.0..2.0f64)), below in prop::array::uniform2(0.0..0.004f64),
            level in -0.002..0.01f64,
        ) {
            let [own, others @ ..] = slopes;
            let (spacing, ground) = (0.01, [0.1, -0.05]);
            let mut fold = Fold::new(Plane { height: 0.3, slope: own }, spacing, ground);
            for (slope, below) in others.into_iter().zip(below) {
                fold.add(Plane { height: 0.3 - below, slope });
            }
            let place: [f64; SAMPLES] = std::array::from_fn(|s| ((s as f64 + 0.5) / SAMPLES as f64 - 0.5) * spacing);
            for axis in [0, 1] {
                let count = 4000;
                let (mut sum, mut weights) = (0.0, 0.0);
                for across in place {
                    for k in 0..count {
                        let along = ((f64::from(k) + 0.5) / f64::from(count) - 0.5) * spacing;
                        let over = |p: &Plane| {
                            let tilt = [0, 1].map(|c| p.slope[c] - ground[c]);
                            (p.height - 0.3 + tilt[axis] * along + tilt[1 - axis] * across, tilt[axis])
                        };
                        let faces = fold.planes[..fold.count].iter().map(over);
                        let (top, tilt) = faces.fold((f64::NEG_INFINITY, 0.0), |a, b| if b.0 > a.0 { b } else { a });
                        let weight = f64::from(u8::from(top < level)) + OUTSIDE;
                        sum += weight * tilt;
                        weights += weight;
                    }
                }
                let found = fold.mean_slope(axis, &place, level);
                // where each of the lines enters the soil and leaves it one point may lie on the wrong side
                let off = (found - ground[axis] - sum / weights).abs();
                prop_assert!(off <= 2.0 * SAMPLES as f64 * 4.2 / weights, "{} {}", found - ground[axis], sum / weights);
            }
        }
    }
}
