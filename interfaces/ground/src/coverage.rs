//! Areas of a footprint inside a lattice cell, in closed form.

use libm::asin;

/// Area of a disc (centre, radius) inside the rectangle low … high, m².
///
/// Inclusion and exclusion of four quadrant areas of the unit disc, each in closed form.
pub fn disc_in_rectangle(centre: [f64; 2], radius: f64, low: [f64; 2], high: [f64; 2]) -> f64 {
    let edge = |k: usize, v: f64| Edge::at((v - centre[k]) / radius);
    let [x0, x1] = [low, high].map(|v| edge(0, v[0]));
    let [y0, y1] = [low, high].map(|v| edge(1, v[1]));
    let area = quadrant(&x1, &y1) - quadrant(&x0, &y1) - quadrant(&x1, &y0) + quadrant(&x0, &y0);
    (area * radius * radius).max(0.0)
}

/// A line across the unit disc.
struct Edge {
    /// Its distance from the middle, −1 … 1.
    at: f64,
    /// [`segment`] there.
    segment: f64,
}

impl Edge {
    fn at(v: f64) -> Self {
        let at = v.clamp(-1.0, 1.0);
        Self { at, segment: segment(at) }
    }
}

/// Area of the unit disc where X ≤ x and Y ≤ y.
fn quadrant(x: &Edge, y: &Edge) -> f64 {
    if x.at * x.at + y.at * y.at <= 1.0 {
        return std::f64::consts::FRAC_PI_4 + x.at * y.at + 0.5 * (x.segment + y.segment);
    }
    match (x.at > 0.0, y.at > 0.0) {
        (true, true) => x.segment + y.segment,
        (false, true) => std::f64::consts::FRAC_PI_2 + x.segment,
        (true, false) => std::f64::consts::FRAC_PI_2 + y.segment,
        (false, false) => 0.0,
    }
}

/// x·√(1 − x²) + asin x: area of the unit disc between 0 and x.
fn segment(x: f64) -> f64 {
    x * (1.0 - x * x).max(0.0).sqrt() + asin(x)
}

/// Corners that a polygon has at most.
pub const MOST_CORNERS: usize = 34;

/// Area of a convex polygon (counter-clockwise, at most `MOST_CORNERS`) inside the rectangle low … high, m².
///
/// Sutherland and Hodgman (1974): clip at the four sides, then the shoelace formula.
pub fn polygon_in_rectangle(corners: &[[f64; 2]], low: [f64; 2], high: [f64; 2]) -> f64 {
    let mut polygon = Corners::none();
    corners.iter().for_each(|c| polygon.push(*c));
    for (axis, bound, sign) in [(0, low[0], 1.0), (0, high[0], -1.0), (1, low[1], 1.0), (1, high[1], -1.0)] {
        polygon = polygon.clipped(axis, bound, sign);
    }
    polygon.area(low)
}

/// Corners in place: a clip at a line adds at most one.
#[derive(Clone, Copy)]
struct Corners {
    count: usize,
    points: [[f64; 2]; MOST_CORNERS + 4],
}

impl Corners {
    fn none() -> Self {
        Self { count: 0, points: [[0.0; 2]; MOST_CORNERS + 4] }
    }

    fn push(&mut self, p: [f64; 2]) {
        if self.count < self.points.len() {
            self.points[self.count] = p;
            self.count += 1;
        }
    }

    /// The part where sign·(p[axis] − bound) ≥ 0.
    fn clipped(&self, axis: usize, bound: f64, sign: f64) -> Self {
        let mut out = Self::none();
        for k in 0..self.count {
            let (a, b) = (self.points[k], self.points[(k + 1) % self.count]);
            let (da, db) = (sign * (a[axis] - bound), sign * (b[axis] - bound));
            if da >= 0.0 {
                out.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                let s = da / (da - db);
                out.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]);
            }
        }
        out
    }

    /// Shoelace formula about `base`, which keeps the numbers small.
    fn area(&self, base: [f64; 2]) -> f64 {
        let shifted = |k: usize| {
            let p = self.points[k % self.count];
            [p[0] - base[0], p[1] - base[1]]
        };
        let twice = |k: usize| {
            let (a, b) = (shifted(k), shifted(k + 1));
            a[0] * b[1] - a[1] * b[0]
        };
        (0.5 * (0..self.count).map(twice).sum::<f64>()).max(0.0)
    }
}
