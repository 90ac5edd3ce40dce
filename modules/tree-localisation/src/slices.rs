//! Stage 3a for clouds without beams, such as those of several places: arcs from horizontal slices, in whose clusters circles are found.
//!
//! Circles go through three points that are drawn again and again; the one that most points lie on counts (M. A. Fischler and
//! R. C. Bolles, "Random sample consensus", 1981), then least squares after I. Kåsa, "A circle fitting procedure and its error
//! analysis", 1976.

use crate::arcs::Arc;
use crate::ground::Ground;
use crate::scan::Point;
use nalgebra::{Matrix3, Vector3};

/// Thickness of a slice, m.
const SLICE: f64 = 0.25;
/// Edge of the cells that join points to clusters, m.
const CELL: f64 = 0.06;
/// Fewest points of a cluster, and its widest extent, m.
const FEWEST: usize = 8;
const WIDEST: f64 = 1.6;
/// Circles that are tried.
const TRIES: usize = 80;
/// Distance up to which a point lies on a circle, m.
const NEAR: f64 = 0.02;
/// Radii of stems, m.
const RADII: [f64; 2] = [0.025, 0.8];
/// Of the points of a cluster, those that lie on the circle, and those well inside of it.
const ON: f64 = 0.45;
const INSIDE: f64 = 0.15;
/// Sixteenths of the circle on which points lie.
const SECTORS: u32 = 5;

/// Arcs of the slices between two heights above the ground; the number of a slice counts as that of a beam.
pub(crate) fn arcs(points: &[Point], ground: &Ground, [low, high]: [f64; 2]) -> Vec<Arc> {
    let count = ((high - low) / SLICE).max(0.0) as usize;
    let mut slices: Vec<Vec<[f64; 2]>> = vec![Vec::new(); count];
    let mut levels = vec![(0.0, 0.0); count];
    for p in points {
        let [x, y, z] = p.position;
        let height = z - ground.height([x, y]);
        if height < low {
            continue;
        }
        let k = ((height - low) / SLICE) as usize;
        if let Some(slice) = slices.get_mut(k) {
            slice.push([x, y]);
            levels[k].0 += z;
            levels[k].1 += height;
        }
    }
    let mut found = Vec::new();
    for (number, slice) in (0..).zip(&slices) {
        for cluster in clusters(slice) {
            let Some(circle) = circle(&cluster) else { continue };
            let height = low + SLICE * (f64::from(number) + 0.5);
            let z = ground.height([circle.x, circle.y]) + height;
            found.push(circle.arc(z, height, number));
        }
    }
    found
}

/// Points whose cells touch each other, corner to corner included.
fn clusters(points: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let cell = |p: &[f64; 2]| ((p[1] / CELL).floor() as i64, (p[0] / CELL).floor() as i64);
    let mut order: Vec<((i64, i64), u32)> = points.iter().map(cell).zip(0..).collect();
    order.sort_unstable();
    let mut parents: Vec<u32> = (0..points.len() as u32).collect();
    let first = |c: (i64, i64)| {
        let k = order.partition_point(|(other, _)| *other < c);
        order.get(k).filter(|(other, _)| *other == c).map(|(_, point)| *point)
    };
    for pair in order.windows(2).filter(|w| w[0].0 == w[1].0) {
        join(&mut parents, pair[0].1, pair[1].1);
    }
    for (k, (c, point)) in order.iter().enumerate() {
        if k > 0 && order[k - 1].0 == *c {
            continue;
        }
        for (j, i) in [(0, 1), (1, -1), (1, 0), (1, 1)] {
            if let Some(other) = first((c.0 + j, c.1 + i)) {
                join(&mut parents, *point, other);
            }
        }
    }
    let mut members: Vec<(u32, u32)> = (0..points.len() as u32).map(|k| (root(&mut parents, k), k)).collect();
    members.sort_unstable();
    let groups = members.chunk_by(|a, b| a.0 == b.0);
    groups.map(|g| g.iter().map(|(_, k)| points[*k as usize]).collect()).collect()
}

fn root(parents: &mut [u32], mut k: u32) -> u32 {
    while parents[k as usize] != k {
        parents[k as usize] = parents[parents[k as usize] as usize];
        k = parents[k as usize];
    }
    k
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    let (low, high) = (a.min(b), a.max(b));
    parents[high as usize] = low;
}

/// A circle with its support.
struct Circle {
    x: f64,
    y: f64,
    radius: f64,
    /// Root of the mean squared distance of its points, m, and their number.
    residual: f64,
    on: f64,
}

impl Circle {
    fn arc(&self, z: f64, height: f64, number: u32) -> Arc {
        let deviation = 0.01 + 2.0 * self.residual / self.on.sqrt();
        Arc {
            centre: [self.x, self.y, z],
            diameter: 2.0 * self.radius,
            is_whole: true,
            deviation,
            diameter_deviation: 2.0 * deviation,
            height,
            ring: number,
            turn: 0,
        }
    }
}

/// The circle of a cluster; none: it is not round.
fn circle(cluster: &[[f64; 2]]) -> Option<Circle> {
    let extent = |k: usize| {
        let all = || cluster.iter().map(|p| p[k]);
        all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min)
    };
    let n = cluster.len();
    if n < FEWEST || extent(0).max(extent(1)) > 2.0 * WIDEST {
        return None;
    }
    let on = |c: &[f64; 3], p: &[f64; 2]| (away(c, p) - c[2]).abs() < NEAR;
    let mut best: Option<(usize, [f64; 3])> = None;
    for k in 0..TRIES {
        // places spread over the cluster by the golden ratio, the same ones each time
        let place = |j: usize| ((k * 3 + j) as f64 * 0.618_033_988_749_895 % 1.0 * n as f64) as usize;
        let Some(c) = fitted(&[cluster[place(0)], cluster[place(1)], cluster[place(2)]]) else { continue };
        let count = cluster.iter().filter(|p| on(&c, p)).count();
        if best.is_none_or(|(most, _)| count > most) {
            best = Some((count, c));
        }
    }
    let (_, mut c) = best?;
    for _ in 0..2 {
        let near: Vec<[f64; 2]> = cluster.iter().filter(|p| on(&c, p)).copied().collect();
        c = fitted(&near)?;
    }
    let near: Vec<&[f64; 2]> = cluster.iter().filter(|p| on(&c, p)).collect();
    let inside = cluster.iter().filter(|p| away(&c, p) < 0.7 * c[2]).count() as f64;
    let sector = |p: &&[f64; 2]| {
        let turn = libm::atan2(p[1] - c[1], p[0] - c[0]) / std::f64::consts::TAU + 0.5;
        1_u32 << ((16.0 * turn) as u32).min(15)
    };
    let sectors = near.iter().map(sector).fold(0, |a, b| a | b).count_ones();
    let round = near.len() as f64 >= ON * n as f64 && inside <= INSIDE * n as f64 && sectors >= SECTORS;
    let square: f64 = near.iter().map(|p| (away(&c, p) - c[2]) * (away(&c, p) - c[2])).sum();
    let residual = (square / near.len().max(1) as f64).sqrt();
    round.then_some(Circle { x: c[0], y: c[1], radius: c[2], residual, on: near.len() as f64 })
}

/// Distance of a point from the middle of a circle, m.
fn away([x, y, _]: &[f64; 3], p: &[f64; 2]) -> f64 {
    ((p[0] - x) * (p[0] - x) + (p[1] - y) * (p[1] - y)).sqrt()
}

/// The circle x, y, r of least squares of x² + y² = 2ax + 2by + c; none: the points lie on a line, or it is no stem.
fn fitted(points: &[[f64; 2]]) -> Option<[f64; 3]> {
    let [u, v] = *points.first()?;
    let (mut left, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for p in points {
        let (x, y) = (p[0] - u, p[1] - v);
        let row = Vector3::new(2.0 * x, 2.0 * y, 1.0);
        left += row * row.transpose();
        right += row * (x * x + y * y);
    }
    let solved = left.try_inverse()? * right;
    let radius = (solved.z + solved.x * solved.x + solved.y * solved.y).max(0.0).sqrt();
    (RADII[0]..RADII[1]).contains(&radius).then_some([u + solved.x, v + solved.y, radius])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trees of a stand as seen from everywhere, without beams: points on their stems, and on the ground.
    fn cloud(stems: &[([f64; 2], f64)]) -> Vec<Point> {
        let mut points = Vec::new();
        for k in 0..4000_u32 {
            let at = [f64::from(k % 64) * 0.15, f64::from(k / 64) * 0.15];
            points.push(Point::at([at[0], at[1], 100.0]));
        }
        for ([x, y], d) in stems {
            for k in 0..3000_u32 {
                let (angle, z) = (f64::from(k) * 2.399_963, 100.0 + 8.0 * f64::from(k) / 3000.0);
                let r = 0.5 * d + 0.005 * libm::sin(f64::from(k) * 1.7);
                points.push(Point::at([x + r * libm::cos(angle), y + r * libm::sin(angle), z]));
            }
        }
        points
    }

    #[test]
    fn circles_of_slices_have_the_places_and_diameters_of_the_stems() {
        let stems = [([2.0, 3.0], 0.15), ([6.0, 5.0], 0.3)];
        let points = cloud(&stems);
        let ground = Ground::below(&points).expect("ground");
        let found = arcs(&points, &ground, [0.4, 6.0]);
        assert!(found.len() > 40, "{}", found.len());
        for arc in found {
            let near = stems.iter().find(|(p, _)| (p[0] - arc.centre[0]).hypot(p[1] - arc.centre[1]) < 0.01);
            let (_, d) = near.expect("a stem there");
            assert!((arc.diameter - d).abs() < 0.01);
        }
        let scan = crate::Scan { points, eye: None };
        let detection = crate::Detector::default().detect(&scan);
        assert_eq!(detection.stems.len(), 2, "{detection:?}");
    }
}
