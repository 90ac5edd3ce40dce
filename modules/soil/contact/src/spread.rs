//! Spread of the depths of an underside about their mean in the cell of a node, and the mean of a pressure over them.
//!
//! Heights above the lowest point of the underside in the cell are taken as h(s) = H·(c·s + (1 − c)·s²), s from 0 to 1 alike over the
//! cell. c = 1 is an inclined plane, cut along an axis; c = 0 the lowest line of a cylinder at the border of the cell; c = 2 a corner.

/// The depths in a cell. The default: all alike.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Range of the heights H, along n, m. Less the range of the print that the foot found here: a foot that comes back into its own
    /// finds the soil everywhere at once.
    pub range: f64,
    /// Mean of the heights above the lowest one, along n, m.
    low: f64,
    /// c.
    straight: f64,
    /// Half the range that evenly spread heights of the same standard deviation have, whatever print lies below, vertical, m.
    pub whole: f64,
    /// Depth of the node below the mean of the cell, along n, m.
    pub below: f64,
    /// Half the range of depths of the print that lay there when the contact began, along n, m.
    pub print: f64,
}

impl Spread {
    /// Of a node of which nothing is known yet but the print that lies there, m.
    pub fn over(print: f64) -> Self {
        Self { print, ..Self::default() }
    }

    /// Of an underside whose heights spread evenly over ± `half` (m) have its standard deviation, whose lowest point lies at most
    /// `lowest` (m) below its mean, and of which a print has taken `print` (m) of `half` already.
    pub fn new(half: f64, lowest: f64, print: f64) -> Self {
        let left = half - print.max(0.0);
        if left <= 0.0 || lowest <= 0.0 {
            return Self { whole: half, print, ..Self::default() };
        }
        if half <= lowest {
            return Self { range: 2.0 * left, low: left, straight: 1.0, whole: half, below: 0.0, print };
        }
        // of h = H·s^(1/a): mean over the range and over the standard deviation are a/(a + 1) and √(a(a + 2))
        let ratio = 3.0 * (lowest / half) * (lowest / half);
        let root = (1.0 + ratio).sqrt();
        let mean = ((root - 1.0) / root).max(LEAST_MEAN);
        let low = lowest * (left / half);
        Self { range: low / mean, low, straight: 6.0 * mean - 2.0, whole: half, below: 0.0, print }
    }

    /// Height of the part `s` of the cell above its lowest point, m, and its change.
    fn height(&self, s: f64) -> (f64, f64) {
        let (linear, square) = (self.range * self.straight, self.range * (1.0 - self.straight));
        (s * (linear + square * s), linear + 2.0 * square * s)
    }

    /// Part of the cell that lies lower than `height` above its lowest point.
    fn part(&self, height: f64) -> f64 {
        if height >= self.range {
            return 1.0;
        }
        if height <= 0.0 {
            return 0.0;
        }
        let (c, square) = (self.straight, 1.0 - self.straight);
        2.0 * height / self.range / (c + (c * c + 4.0 * square * height / self.range).sqrt())
    }

    /// Depth of the lowest point of an underside at the mean depth `depth` below `top`, m.
    fn inside(&self, depth: f64, top: f64) -> f64 {
        depth - top + self.low
    }

    /// Part of a cell whose depths spread that lies below `top` (m) where its mean depth is `depth`.
    pub fn part_below(&self, depth: f64, top: f64) -> f64 {
        self.part(self.inside(depth, top))
    }

    /// By how much the mean depth of the soil's surface exceeds the mean depth of the underside, m, where the surface was at `top` and
    /// the underside, at the mean depth `depth`, has taken the soil along: of a cell that is in the soil in part the rest lies above.
    pub fn above(&self, depth: f64, top: f64) -> f64 {
        let inside = self.inside(depth, top);
        if self.range <= 0.0 || inside >= self.range {
            return 0.0;
        }
        let s = self.part(inside);
        let lifted = s * s * self.range * (0.5 * self.straight + (1.0 - self.straight) * s / 3.0);
        s * inside.max(0.0) - lifted - inside.max(0.0) + self.low
    }

    /// Whether some of an underside that spreads, at the mean depth `depth`, lies deeper than `top` (m).
    pub fn reaches(&self, depth: f64, top: f64) -> bool {
        self.range > 0.0 && self.inside(depth, top) > 0.0
    }

    /// Half the range of the depths that an underside at the mean depth `depth` leaves in soil whose surface was at `top` (m), vertical, m:
    /// of a cell that only a corner of it has touched, that corner's.
    pub fn printed(&self, depth: f64, top: f64) -> f64 {
        let share =
            if self.range > 0.0 { (self.inside(depth, top) / self.range).clamp(0.0, 1.0) } else { 1.0 };
        share * self.whole
    }

    /// Sample points for the mean of a pressure over the part deeper than `top` (m) of a cell at the mean depth
    /// `depth`; `None`: no part is.
    #[inline]
    pub fn look(&self, depth: f64, top: f64) -> Option<Look> {
        let (deepest, inside) = (depth + self.low, self.inside(depth, top));
        if inside >= self.range || self.range <= 0.0 {
            let at = GAUSS.map(|g| deepest - self.height(g).0);
            return Some(Look { depth: at, part: [1.0, 0.0], change: [1.0; 2] });
        }
        (inside > 0.0).then(|| {
            let s = self.part(inside);
            let change = 1.0 / self.height(s).1;
            let at = GAUSS.map(|g| (self.height(g * s), g));
            let change_of = at.map(|((_, slope), g)| 1.0 - slope * g * change);
            Look { depth: at.map(|((height, _), _)| deepest - height), part: [s, change], change: change_of }
        })
    }
}

/// Smallest mean of the heights over their range: c = 0.
const LEAST_MEAN: f64 = 1.0 / 3.0;

/// Places of Gauss and Legendre's two points in a range from 0 to 1; both weigh alike.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Depths at which a pressure is evaluated for its mean over a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Both depths, m.
    pub depth: [f64; 2],
    /// Part of the cell that is in the soil, and its change with the mean depth, 1/m.
    part: [f64; 2],
    /// Change of both depths with the mean depth.
    change: [f64; 2],
}

impl Look {
    /// Mean over the cell of a pressure and its slope from those at both depths; parts outside the soil carry nothing.
    #[inline]
    pub fn mean(&self, [(p, p_slope), (q, q_slope)]: [(f64, f64); 2]) -> (f64, f64) {
        let slope =
            self.part[0] * (self.change[0] * p_slope + self.change[1] * q_slope) + self.part[1] * (p + q);
        (0.5 * self.part[0] * (p + q), 0.5 * slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Mean pressure, its slope, displaced depth and part of the cell against sums over many points.
        #[test]
        fn means_are_those_of_many_points(
            half in 1e-4..0.01f64, lowest in 0.3..1.5f64, depth in -0.02..0.02f64, n in 0.6..1.4f64,
        ) {
            let spread = Spread::new(half, lowest * half, 0.0);
            let count = 20_000;
            let depths: Vec<f64> = (0..count)
                .map(|k| depth + spread.low - spread.height((f64::from(k) + 0.5) / f64::from(count)).0)
                .collect();
            let mean = |f: &dyn Fn(f64) -> f64| depths.iter().map(|z| f(*z)).sum::<f64>() / f64::from(count);
            prop_assert!((mean(&|z| z) - depth).abs() < 1e-6 * half);
            prop_assert!((mean(&|z| f64::from(u8::from(z > 0.0))) - spread.part_below(depth, 0.0)).abs() < 1e-3);
            let sunk = mean(&|z| z.max(0.0));
            prop_assert!((sunk - depth - spread.above(depth, 0.0)).abs() < 1e-6 * half || depth + spread.low < 0.0);
            let law = |z: f64| (z.max(0.0).powf(n), if z > 0.0 { n * z.powf(n - 1.0) } else { 0.0 });
            let found = |depth: f64| spread.look(depth, 0.0).map_or((0.0, 0.0), |l| l.mean(l.depth.map(law)));
            let (p, slope) = found(depth);
            prop_assert!((mean(&|z| law(z).0) - p).abs() <= 0.02 * p + 1e-9);
            let h = 1e-7 * half;
            let difference = (found(depth + h).0 - found(depth - h).0) / (2.0 * h);
            // not at the kinks, where the cell comes into the soil and where it is in it as a whole
            let inside = depth + spread.low;
            if (inside - spread.range).abs() > 2.0 * h && inside.abs() > 2.0 * h {
                prop_assert!((difference - slope).abs() <= 1e-4 * slope + 1e-6, "{} {}", difference, slope);
            }
        }
    }
}
