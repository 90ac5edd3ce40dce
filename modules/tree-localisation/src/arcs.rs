//! Stage 3a: arcs: pieces of a beam that may lie on a stem, each with the circle that fits it.
//!
//! A circle with radius R at the distance d takes the angle 2·asin(R/d), whatever the step of the scanner; of n firings that meet
//! it, the mean of n·step is that angle. Its returns lie R·√(1 − u²) before its middle at the share u of its width, in the mean
//! R·π/4. Two equations for R and d.

use crate::rings::{Return, Rings};
use std::f64::consts::{FRAC_PI_4, TAU};

/// A piece of a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Middle of the circle, m.
    pub centre: [f64; 3],
    /// Diameter, m; a lower bound where a side is hidden.
    pub diameter: f64,
    /// Whether both its sides are seen.
    pub is_whole: bool,
    /// Deviation of the middle along and across the view, m.
    pub deviation: f64,
    /// Deviation of the diameter, m.
    pub diameter_deviation: f64,
    /// Height above the ground, m.
    pub height: f64,
    /// Number of the beam among those of its turn, and of the turn.
    pub ring: u32,
    /// Number of its turn.
    pub turn: u32,
}

/// Widest and thinnest stem, m.
const WIDTHS: [f64; 2] = [0.04, 1.6];
/// Firings that may be lost in a piece, in steps.
const LOST: f64 = 2.6;
/// Noise of a range that is expected, m.
const NOISE: f64 = 0.03;

/// Pieces of a turn whose widths are those of stems; `centre` is from the scanner, `height` is not known yet.
pub(crate) fn arcs(rings: &Rings, turn: u32) -> Vec<Arc> {
    let mut found = Vec::new();
    for (number, ring) in (0..).zip(&rings.rings) {
        let returns = from_a_break(&ring.returns, rings.step);
        for piece in Pieces::of(&returns, rings.step) {
            if let Some(arc) = piece.arc(rings.step) {
                found.push(Arc { ring: number, turn, ..arc });
            }
        }
    }
    found
}

/// The same returns from the first break on, so that no stem is cut where azimuths begin again.
fn from_a_break(returns: &[Return], step: f64) -> Vec<Return> {
    let pieces = Pieces::of(returns, step);
    let first = returns.windows(2).position(|w| pieces.is_break(&w[0], &w[1])).map_or(0, |k| k + 1);
    let again = returns[..first].iter().map(|r| Return { azimuth: r.azimuth + TAU, ..*r });
    returns[first..].iter().copied().chain(again).collect()
}

/// A piece between two jumps of the distance.
struct Piece<'a> {
    returns: &'a [Return],
    is_whole: bool,
}

/// Pieces of a ring, one after the other.
struct Pieces<'a> {
    returns: &'a [Return],
    step: f64,
    first: usize,
}

impl<'a> Pieces<'a> {
    fn of(returns: &'a [Return], step: f64) -> Self {
        Self { returns, step, first: 0 }
    }

    /// Jump of the distance between neighbours that ends a piece: the largest on a stem of half a metre, and noise.
    fn jump(&self, distance: f64) -> f64 {
        4.0 * NOISE + (0.5 * self.step * distance).sqrt().min(0.5)
    }

    fn is_break(&self, a: &Return, b: &Return) -> bool {
        b.azimuth - a.azimuth > LOST * self.step || (a.distance - b.distance).abs() > self.jump(a.distance)
    }

    /// Whether a neighbour beyond the end hides a continuation.
    fn hides(&self, end: &Return, beyond: Option<&Return>) -> bool {
        beyond
            .is_some_and(|b| (b.azimuth - end.azimuth).abs() < LOST * self.step && b.distance < end.distance)
    }
}

impl<'a> Iterator for Pieces<'a> {
    type Item = Piece<'a>;

    fn next(&mut self) -> Option<Piece<'a>> {
        let (all, first) = (self.returns, self.first);
        let start = all.get(first)?;
        let mut last = first;
        while let Some(next) = all.get(last + 1) {
            if self.is_break(&all[last], next) {
                break;
            }
            last += 1;
        }
        self.first = last + 1;
        let left = first.checked_sub(1).and_then(|k| all.get(k));
        let is_whole = !self.hides(start, left) && !self.hides(&all[last], all.get(last + 1));
        Some(Piece { returns: &all[first..=last], is_whole })
    }
}

impl Piece<'_> {
    /// The circle; its middle is as high as the beam.
    fn arc(&self, step: f64) -> Option<Arc> {
        let (first, last) = (self.returns.first()?, self.returns.last()?);
        let n = self.returns.len() as f64;
        let span = last.azimuth - first.azimuth + step;
        let mean = self.returns.iter().map(|r| r.distance).sum::<f64>() / n;
        let sine = libm::sin(0.5 * span.min(2.5));
        let radius = mean * sine / (1.0 - FRAC_PI_4 * sine);
        if !(WIDTHS[0]..WIDTHS[1]).contains(&(2.0 * radius)) {
            return None;
        }
        let (distance, azimuth) = (mean + FRAC_PI_4 * radius, 0.5 * (first.azimuth + last.azimuth));
        if !self.is_round(azimuth, distance, radius) {
            return None;
        }
        let width = step * mean;
        let slope = self.returns.iter().map(|r| r.rise).sum::<f64>() / (mean * n);
        let centre = [distance * libm::cos(azimuth), distance * libm::sin(azimuth), slope * distance];
        // each edge lies anywhere within a step; the two errors shift the middle and change the width
        let across = if self.is_whole { width / 24.0_f64.sqrt() } else { width + 0.5 * radius };
        let deviation = (across * across + NOISE * NOISE / n + 0.05 * 0.05 * radius * radius).sqrt();
        Some(Arc {
            centre,
            diameter: 2.0 * radius,
            is_whole: self.is_whole,
            deviation,
            diameter_deviation: (width * width / 6.0 + 1e-4).sqrt(),
            height: 0.0,
            ring: 0,
            turn: 0,
        })
    }

    /// Whether the returns lie on the circle and not on a wall or in a bush.
    fn is_round(&self, azimuth: f64, distance: f64, radius: f64) -> bool {
        if self.returns.len() < 4 || !self.is_whole {
            return true;
        }
        let residual = |r: &Return| {
            let u = (distance * libm::sin(r.azimuth - azimuth) / radius).clamp(-1.0, 1.0);
            r.distance - (distance - radius * (1.0 - u * u).sqrt())
        };
        let square: f64 = self.returns.iter().map(|r| residual(r) * residual(r)).sum();
        (square / self.returns.len() as f64).sqrt() < 1.3 * NOISE + 0.3 * radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Point;

    /// A turn of a scanner around a circle at a distance, with steps that begin anywhere.
    fn circle(distance: f64, radius: f64, step: f64, begin: f64) -> Vec<Point> {
        let count = (0.5 / step) as i32;
        let azimuth = |k: i32| f64::from(k) * step + begin;
        let ray = |azimuth: f64| {
            let across = distance * libm::sin(azimuth);
            let root = radius * radius - across * across;
            let range = if root > 0.0 { distance * libm::cos(azimuth) - root.sqrt() } else { 50.0 };
            let at = |r: f64, z: f64| [r * libm::cos(azimuth), r * libm::sin(azimuth), z];
            [Point { ring: 0, ..Point::at(at(range, 0.0)) }, Point { ring: 1, ..Point::at(at(50.0, 1.0)) }]
        };
        (-count..count).flat_map(|k| ray(azimuth(k))).collect()
    }

    #[test]
    fn circles_have_no_bias_however_few_rays_meet_them() {
        for (distance, radius) in [(4.0, 0.2), (10.0, 0.15), (20.0, 0.12)] {
            let mut sums = [0.0; 2];
            let phases = 50;
            for k in 0..phases {
                let step = 0.006;
                let points = circle(distance, radius, step, step * f64::from(k) / f64::from(phases));
                let rings = Rings::of(&points, [0.0; 3]).expect("rings");
                let all = arcs(&rings, 0);
                let arc =
                    all.iter().find(|a| a.ring == 0 && a.is_whole && (a.centre[0] - distance).abs() < 0.5);
                let arc = arc.expect("an arc");
                sums[0] += arc.diameter / f64::from(phases);
                sums[1] += arc.centre[0] / f64::from(phases);
            }
            assert!((sums[0] - 2.0 * radius).abs() < 0.01, "{distance}: {sums:?}");
            assert!((sums[1] - distance).abs() < 0.02, "{distance}: {sums:?}");
        }
    }
}
