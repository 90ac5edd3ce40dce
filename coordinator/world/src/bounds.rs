//! Boxes along the axes in double precision, and the box of every geometry.

use terraglue_ground::Rotation;
use terraglue_subsystem::Geometry;

/// A box along the axes; empty where `low` is above `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub low: [f64; 3],
    pub high: [f64; 3],
}

impl Bounds {
    pub const EMPTY: Self = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    pub fn of_points(points: &[[f64; 3]]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| b.with(*p))
    }

    /// Of a geometry in its own frame.
    pub fn of_geometry(geometry: &Geometry) -> Self {
        let [low, high] = geometry.extent();
        Self { low, high }
    }

    pub fn with(&self, p: [f64; 3]) -> Self {
        self.joined(&Self { low: p, high: p })
    }

    pub fn joined(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    pub fn grown(&self, by: f64) -> Self {
        Self { low: self.low.map(|x| x - by), high: self.high.map(|x| x + by) }
    }

    pub fn is_empty(&self) -> bool {
        (0..3).any(|k| self.low[k] > self.high[k])
    }

    pub fn centre(&self) -> [f64; 3] {
        std::array::from_fn(|k| 0.5 * (self.low[k] + self.high[k]))
    }

    pub fn diagonal(&self) -> f64 {
        let side: [f64; 3] = std::array::from_fn(|k| self.high[k] - self.low[k]);
        side.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Distance of the corner that is farthest from the origin, m.
    pub fn reach(&self) -> f64 {
        let far: [f64; 3] = std::array::from_fn(|k| self.low[k].abs().max(self.high[k].abs()));
        far.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// The box around this one turned and moved.
    pub fn moved(&self, position: [f64; 3], rotation: &Rotation) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        let centre = rotation.to_world(self.centre());
        let half: [f64; 3] = std::array::from_fn(|k| 0.5 * (self.high[k] - self.low[k]));
        let columns = &rotation.0;
        let reach: [f64; 3] =
            std::array::from_fn(|k| (0..3).map(|j| columns[j][k].abs() * half[j]).sum::<f64>());
        Self {
            low: std::array::from_fn(|k| position[k] + centre[k] - reach[k]),
            high: std::array::from_fn(|k| position[k] + centre[k] + reach[k]),
        }
    }

    /// Part of a line inside, from its start and 1/direction; none: it passes by.
    #[inline(always)]
    pub fn clip(&self, origin: [f64; 3], inverse: [f64; 3]) -> Option<[f64; 2]> {
        let (mut first, mut last) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let a = (self.low[k] - origin[k]) * inverse[k];
            let b = (self.high[k] - origin[k]) * inverse[k];
            let (near, far) = if inverse[k] < 0.0 { (b, a) } else { (a, b) };
            first = if near > first { near } else { first };
            last = if far < last { far } else { last };
        }
        (first <= last && first < f64::INFINITY).then_some([first, last])
    }

    /// Square of the distance of a point, m².
    pub fn distance_squared(&self, p: [f64; 3]) -> f64 {
        let beside = |k: usize| (self.low[k] - p[k]).max(p[k] - self.high[k]).max(0.0);
        (0..3).map(|k| beside(k) * beside(k)).sum()
    }
}
