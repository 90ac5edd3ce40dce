//! The plane through the standing feet: it separates height and tilt of the body from the relief of the ground.

/// z = height + slope · (p − centre).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Mean of the points, m.
    pub centre: [f64; 2],
    /// Mean of the heights, m.
    pub height: f64,
    /// Rise along x and y, m/m.
    pub slope: [f64; 2],
}

/// Least spread of the points across any direction, m, at which they have a slope.
const SPREAD: f64 = 0.05;

impl Plane {
    /// Of least squares; level where the points lie on a line, none without points.
    pub fn through(points: impl Iterator<Item = ([f64; 2], f64)> + Clone) -> Option<Self> {
        let count = points.clone().count();
        if count == 0 {
            return None;
        }
        let share = 1.0 / count as f64;
        let mean = |of: fn(&([f64; 2], f64)) -> f64| points.clone().map(|p| share * of(&p)).sum::<f64>();
        let (centre, height) = ([mean(|p| p.0[0]), mean(|p| p.0[1])], mean(|p| p.1));
        let (mut xx, mut xy, mut yy, mut xz, mut yz) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (p, z) in points.clone() {
            let (x, y, z) = (p[0] - centre[0], p[1] - centre[1], z - height);
            (xx, xy, yy) = (xx + share * x * x, xy + share * x * y, yy + share * y * y);
            (xz, yz) = (xz + share * x * z, yz + share * y * z);
        }
        let determinant = xx * yy - xy * xy;
        // The smaller of two principal spreads is at least determinant / trace.
        let wide = determinant > SPREAD * SPREAD * (xx + yy);
        let slope = [(yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant];
        Some(Self { centre, height, slope: if wide { slope } else { [0.0; 2] } })
    }

    /// Height at a point, m.
    pub fn at(&self, p: [f64; 2]) -> f64 {
        self.height + self.slope[0] * (p[0] - self.centre[0]) + self.slope[1] * (p[1] - self.centre[1])
    }
}
