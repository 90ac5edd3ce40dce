//! Points of a turn by beam and azimuth, and which angles the beams have.

use crate::scan::{NO_RING, Point};
use std::f64::consts::{PI, TAU};

/// A point as its beam sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Return {
    /// Azimuth, rad, −π … π.
    pub azimuth: f64,
    /// Distance in the horizontal plane, m.
    pub distance: f64,
    /// Height above the scanner, m.
    pub rise: f64,
}

impl Return {
    /// Azimuth, by whole turns ahead, and slope.
    fn ahead(&self, turns: f64) -> (f64, f64) {
        (self.azimuth + turns, self.rise / self.distance)
    }
}

/// Points of a turn, beam by beam in the order of their azimuths.
#[derive(Clone, Debug, PartialEq)]
pub struct Rings {
    pub(crate) rings: Vec<Ring>,
    /// Angle between two firings, rad.
    pub(crate) step: f64,
}

/// The returns of a beam.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ring {
    pub returns: Vec<Return>,
}

/// Beams of a scan that does not name them: at most so many, and elevations of one beam are not farther apart than this, rad.
const MOST_RINGS: usize = 256;
const SAME: f64 = 1e-3;
/// Smallest and largest angle between two firings that is believed, rad.
const STEPS: [f64; 2] = [2e-4, 0.05];

impl Rings {
    /// Sorts the points that a scanner at `eye` saw. None: the beams cannot be distinguished.
    pub fn of(points: &[Point], eye: [f64; 3]) -> Option<Self> {
        let seen = |p: &Point| {
            let [x, y, z] = [0, 1, 2].map(|k| p.position[k] - eye[k]);
            Return { azimuth: libm::atan2(y, x), distance: (x * x + y * y).sqrt(), rise: z }
        };
        let returns: Vec<Return> = points.iter().map(seen).collect();
        let known = !points.is_empty() && points.iter().all(|p| p.ring != NO_RING);
        let numbers = if known { points.iter().map(|p| p.ring).collect() } else { by_elevation(&returns)? };
        let count = numbers.iter().max().map_or(0, |n| usize::from(*n) + 1);
        let mut rings: Vec<Ring> = (0..count).map(|_| Ring { returns: Vec::new() }).collect();
        for (number, r) in numbers.iter().zip(returns) {
            if r.distance > 1e-6 {
                rings[usize::from(*number)].returns.push(r);
            }
        }
        rings.retain(|ring| ring.returns.len() > 1);
        for ring in &mut rings {
            ring.returns.sort_unstable_by(|a, b| a.azimuth.total_cmp(&b.azimuth));
        }
        let step = step(&rings)?;
        Some(Self { rings, step })
    }
}

impl Ring {
    /// Rise of the beam for each metre of horizontal distance in a direction, by the returns on both sides of it: the beams of a scanner
    /// that leans rise on one side and fall on the other.
    pub fn slope(&self, azimuth: f64) -> f64 {
        let count = self.returns.len();
        let next = self.returns.partition_point(|r| r.azimuth < azimuth);
        let around = |k: usize, round: f64| self.returns[k % count].ahead(round);
        let (a, b) = if next == 0 {
            (around(count - 1, -TAU), around(0, 0.0))
        } else {
            (around(next - 1, 0.0), around(next, if next == count { TAU } else { 0.0 }))
        };
        let gap = b.0 - a.0;
        if gap > 0.0 { a.1 + (b.1 - a.1) * (azimuth - a.0) / gap } else { a.1 }
    }

    /// Returns with azimuths within `half` of a direction, going on at −π.
    pub fn within(&self, azimuth: f64, half: f64) -> impl Iterator<Item = &Return> {
        let (low, high) = (azimuth - half, azimuth + half);
        let part = move |low: f64, high: f64| {
            let first = self.returns.partition_point(|r| r.azimuth < low);
            self.returns[first..].iter().take_while(move |r| r.azimuth <= high)
        };
        let below = if low < -PI { Some(part(low + TAU, high + TAU)) } else { None };
        let above = if high > PI { Some(part(low - TAU, high - TAU)) } else { None };
        part(low, high).chain(below.into_iter().flatten()).chain(above.into_iter().flatten())
    }
}

/// Number of the beam of each return, by gaps between elevations.
fn by_elevation(returns: &[Return]) -> Option<Vec<u16>> {
    let elevation = |r: &Return| libm::atan2(r.rise, r.distance);
    let mut order: Vec<(f64, u32)> = returns.iter().map(elevation).zip(0..).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut numbers = vec![0; returns.len()];
    let (mut number, mut before) = (0_usize, order.first()?.0);
    for (elevation, k) in order {
        if elevation - before > SAME {
            number += 1;
        }
        if number >= MOST_RINGS {
            return None;
        }
        numbers[k as usize] = number as u16;
        before = elevation;
    }
    // a cloud without gaps is no turn of a few beams
    (number > 0).then_some(numbers)
}

/// Angle between two firings: the most common distance of neighbours.
fn step(rings: &[Ring]) -> Option<f64> {
    let mut gaps: Vec<f64> = rings
        .iter()
        .flat_map(|ring| ring.returns.windows(2).step_by(7).map(|w| w[1].azimuth - w[0].azimuth))
        .filter(|gap| *gap > STEPS[0])
        .collect();
    if gaps.is_empty() {
        return None;
    }
    let middle = gaps.len() / 4;
    let (_, gap, _) = gaps.select_nth_unstable_by(middle, f64::total_cmp);
    (*gap < STEPS[1]).then_some(*gap)
}
