//! Stage 1: leaves out points at infinity, points of the machine itself and points without company.

use crate::scan::{Point, Scan};
use std::f64::consts::{PI, TAU};

/// A box in the frame of the points, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Lowest corner.
    pub low: [f64; 3],
    /// Highest corner.
    pub high: [f64; 3],
}

impl Volume {
    fn contains(&self, p: &[f64; 3]) -> bool {
        (0..3).all(|k| p[k] >= self.low[k] && p[k] <= self.high[k])
    }
}

/// Which points are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    /// Nearest and farthest distance from the scanner, m.
    pub range_m: [f64; 2],
    /// Bodies of the machine itself.
    pub own_bodies: Vec<u32>,
    /// Where the machine itself is, for scans that do not name bodies.
    pub own_volumes: Vec<Volume>,
    /// Whether points without another one nearby are left out.
    pub drops_sparse: bool,
}

impl Default for Filter {
    fn default() -> Self {
        Self { range_m: [0.5, 60.0], own_bodies: Vec::new(), own_volumes: Vec::new(), drops_sparse: true }
    }
}

/// How many points were left out, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Dropped {
    /// Numbers that are none.
    pub not_finite: usize,
    /// Too near or too far.
    pub out_of_range: usize,
    /// On the machine itself.
    pub own: usize,
    /// Without another point nearby.
    pub sparse: usize,
}

impl Dropped {
    /// All of them.
    pub fn total(&self) -> usize {
        self.not_finite + self.out_of_range + self.own + self.sparse
    }
}

/// Edge of the cells that a point shares with its company: share of a turn, and distance, m.
const CELL: [f64; 2] = [0.00625, 0.6];

/// Sectors of a turn that are examined for obstruction.
const SECTORS: usize = 120;

impl Filter {
    /// The points that stay, and how many do not.
    pub fn apply(&self, scan: &Scan) -> (Vec<Point>, Dropped) {
        let mut dropped = Dropped::default();
        let eye = scan.eye.unwrap_or([0.0; 3]);
        let mut kept = Vec::with_capacity(scan.points.len());
        for point in &scan.points {
            let square: f64 =
                (0..3).map(|k| (point.position[k] - eye[k]) * (point.position[k] - eye[k])).sum();
            let [near, far] = self.range_m;
            match () {
                () if !point.is_finite() => dropped.not_finite += 1,
                () if self.is_own(point) => dropped.own += 1,
                () if scan.eye.is_some() && (square < near * near || square > far * far) => {
                    dropped.out_of_range += 1;
                }
                () => kept.push(*point),
            }
        }
        if self.drops_sparse && scan.eye.is_some() {
            let before = kept.len();
            drop_sparse(&mut kept, eye);
            dropped.sparse = before - kept.len();
        }
        (kept, dropped)
    }

    /// Sectors in which the machine itself hides the view: azimuths from and to, rad, −π … π, in steps of 3°. A sector
    /// counts as hidden where a third or more of the returns around the horizon (10° down to 10° up) are its own.
    pub fn hidden(&self, scan: &Scan) -> Vec<[f64; 2]> {
        let eye = scan.eye.unwrap_or([0.0; 3]);
        let mut counts = [[0_u32; 2]; SECTORS];
        for point in scan.points.iter().filter(|p| p.is_finite()) {
            let [x, y, z] = [0, 1, 2].map(|k| point.position[k] - eye[k]);
            if z * z < 0.031 * (x * x + y * y) {
                let share = (libm::atan2(y, x) + PI) / TAU;
                let place = ((share * SECTORS as f64) as usize).min(SECTORS - 1);
                counts[place][usize::from(self.is_own(point))] += 1;
            }
        }
        let is_hidden = |[others, own]: [u32; 2]| own > 0 && 2 * own >= others;
        let at = |k: usize| TAU * k as f64 / SECTORS as f64 - PI;
        let mut sectors: Vec<[f64; 2]> = Vec::new();
        for k in (0..SECTORS).filter(|k| is_hidden(counts[*k])) {
            match sectors.last_mut().filter(|s| (s[1] - at(k)).abs() < 1e-9) {
                Some(sector) => sector[1] = at(k + 1),
                None => sectors.push([at(k), at(k + 1)]),
            }
        }
        sectors
    }

    fn is_own(&self, point: &Point) -> bool {
        self.own_bodies.contains(&point.body) || self.own_volumes.iter().any(|v| v.contains(&point.position))
    }
}

/// Points whose cell of azimuth and distance, and all cells around it, hold no other point.
fn drop_sparse(points: &mut Vec<Point>, eye: [f64; 3]) {
    const AROUND: i64 = (1.0 / CELL[0]) as i64;
    let cell = |p: &Point| {
        let (x, y) = (p.position[0] - eye[0], p.position[1] - eye[1]);
        ((turn(x, y) / CELL[0]) as i64, (libm::sqrt(x * x + y * y) / CELL[1]) as i64)
    };
    let key = |(a, r): (i64, i64)| a.rem_euclid(AROUND) * (1 << 20) + r;
    let cells: Vec<(i64, i64)> = points.iter().map(cell).collect();
    let reach = cells.iter().map(|c| c.1).max().unwrap_or(0) as usize + 2;
    let mut counts = vec![0_u32; AROUND as usize * reach];
    let place = |c: (i64, i64)| {
        let k = key(c);
        (k >> 20) as usize * reach + (k & 0xfffff) as usize
    };
    cells.iter().for_each(|c| counts[place(*c)] += 1);
    let alone = |c: (i64, i64)| {
        let around = (-1..=1).flat_map(|a| (-1..=1).map(move |r| (c.0 + a, c.1 + r)));
        around.filter(|c| c.1 >= 0 && (c.1 as usize) < reach).map(|c| counts[place(c)]).sum::<u32>() <= 1
    };
    let mut k = 0;
    points.retain(|_| {
        k += 1;
        !alone(cells[k - 1])
    });
}

/// A number that grows from 0 to 1 with the azimuth, by the edge of a square, not a circle: enough to distinguish cells.
fn turn(x: f64, y: f64) -> f64 {
    let sum = x.abs() + y.abs();
    let quarter = if sum > 0.0 { 0.25 * x / sum } else { 0.0 };
    if y < 0.0 { 0.75 + quarter } else { 0.25 - quarter }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_is_counted() {
        let own = Point { body: 7, ..Point::at([2.0, 0.0, 0.0]) };
        let points = vec![
            Point::at([f64::NAN, 0.0, 0.0]),
            Point::at([1e4, 0.0, 0.0]),
            Point::at([0.1, 0.0, 0.0]),
            own,
            Point::at([-3.0, 0.0, 0.5]),
            Point::at([10.0, 10.0, 0.0]),
            Point::at([10.0, 10.1, 0.0]),
            Point::at([-10.0, 10.1, 0.0]),
        ];
        let volume = Volume { low: [-4.0, -1.0, 0.0], high: [-2.0, 1.0, 1.0] };
        let filter = Filter { own_bodies: vec![7], own_volumes: vec![volume], ..Filter::default() };
        let (kept, dropped) = filter.apply(&Scan::from_origin(points));
        assert_eq!(dropped, Dropped { not_finite: 1, out_of_range: 2, own: 2, sparse: 1 });
        assert_eq!((kept.len(), dropped.total()), (2, 6));
    }
}
