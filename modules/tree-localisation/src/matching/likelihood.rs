//! How much better a pose explains the trees around than chance does.
//!
//! A tree that is seen is on the map with the share s; then it stands at the place of a tree of the map up to errors of deviation σ.
//! Otherwise it stands anywhere. Against a stand of the density ρ that has nothing to do with the map, the ratio of likelihoods of
//! a tree at p is (1 − s) + s·Σ N(p − q; σ)/ρ over the trees q of the map, and that of a pose the product over the trees that are
//! seen: a mixture as E. Parzen (1962) makes it, with the outliers of A. P. Dempster, N. M. Laird and D. B. Rubin (1977).

use crate::local_map::LocalTree;
use crate::pose::Pose2;
use crate::tree_map::TreeMap;
use std::f64::consts::TAU;

/// Errors that are expected of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchModel {
    /// Deviation of a place of the map along each axis, m.
    pub noise_m: f64,
    /// Share of the trees that are seen and on the map.
    pub matched: f64,
    /// Deviation of a diameter of the map, m.
    pub diameter_m: f64,
}

impl Default for MatchModel {
    /// A map that was surveyed on the ground some time ago.
    fn default() -> Self {
        Self { noise_m: 0.1, matched: 0.7, diameter_m: 0.03 }
    }
}

/// Deviations beyond which a tree of the map explains nothing.
const REACH: f64 = 3.5;

/// A tree that is seen, with the accuracy of its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub place: [f64; 2],
    /// Deviation of its place and of those of the map, together, m.
    pub deviation: f64,
    /// Its diameter and the deviation of that.
    pub diameter: f64,
    pub diameter_deviation: f64,
}

/// The trees that are seen against a map.
pub(super) struct Likelihood<'a> {
    pub map: &'a TreeMap,
    trees: Vec<Seen>,
    matched: f64,
    density: f64,
    /// Mean and deviation of the diameters of the map; none: they were not measured.
    diameters: Option<[f64; 2]>,
}

impl<'a> Likelihood<'a> {
    pub fn new(map: &'a TreeMap, model: &MatchModel, local: &[LocalTree]) -> Self {
        let square = |x: f64| x * x;
        let seen = |t: &LocalTree| Seen {
            place: t.place,
            deviation: (square(model.noise_m.max(0.02)) + square(t.deviation)).sqrt(),
            diameter: t.diameter,
            diameter_deviation: (square(model.diameter_m) + square(t.diameter_deviation)).sqrt(),
        };
        let trees: Vec<Seen> = local.iter().map(seen).collect();
        let matched = model.matched.clamp(0.05, 0.98);
        Self { map, trees, matched, density: map.density(), diameters: diameters(map) }
    }

    pub fn trees(&self) -> &[Seen] {
        &self.trees
    }

    /// Share of the trees that are on the map.
    pub fn matched(&self) -> f64 {
        self.matched
    }

    /// Ratio for a tree at a place of the map whose errors have this deviation, and the tree of the map that explains most with the
    /// share that it explains.
    pub fn ratio(&self, tree: &Seen, at: [f64; 2], deviation: f64) -> (f64, Option<(u32, f64)>) {
        let (square, mut sum, mut best) = (deviation * deviation, 0.0, None);
        let reach = REACH * deviation;
        let peak = self.matched / (TAU * square * self.density);
        let mut most = 0.0;
        for k in self.map.around(at, reach) {
            let other = &self.map.trees()[k as usize];
            let (x, y) = (other.place[0] - at[0], other.place[1] - at[1]);
            let gap = x * x + y * y;
            if gap > reach * reach {
                continue;
            }
            let part = peak * libm::exp(-0.5 * gap / square) * self.thickness(tree, other.diameter);
            sum += part;
            if part > most {
                (most, best) = (part, Some(k));
            }
        }
        let ratio = 1.0 - self.matched + sum;
        (ratio, best.map(|k| (k, most / ratio)))
    }

    /// The ratio for a tree at a place, from the trees of the map within two and a half deviations: for a first look.
    pub fn ratio_near(&self, tree: &Seen, at: [f64; 2], deviation: f64) -> f64 {
        let square = deviation * deviation;
        let reach = 2.5 * deviation;
        let mut sum = 0.0;
        for k in self.map.around(at, reach) {
            let other = &self.map.trees()[k as usize];
            let (x, y) = (other.place[0] - at[0], other.place[1] - at[1]);
            let gap = x * x + y * y;
            if gap < reach * reach {
                sum += libm::exp(-0.5 * gap / square) * self.thickness(tree, other.diameter);
            }
        }
        1.0 - self.matched + sum * self.matched / (TAU * square * self.density)
    }

    /// How much better a tree of the map with its diameter explains that of a tree than any tree does; bounded, as diameters are
    /// measured badly.
    fn thickness(&self, tree: &Seen, other: Option<f64>) -> f64 {
        let (Some(other), Some([mean, spread])) = (other, self.diameters) else { return 1.0 };
        let normal = |x: f64, s: f64| libm::exp(-0.5 * x * x / (s * s)) / s;
        let wide = (spread * spread + tree.diameter_deviation * tree.diameter_deviation).sqrt();
        let by_chance = normal(tree.diameter - mean, wide).max(0.05 / wide);
        0.1 + 0.9 * normal(tree.diameter - other, tree.diameter_deviation) / by_chance
    }

    /// Logarithm of the ratio of a pose, nats.
    pub fn score(&self, pose: &Pose2) -> f64 {
        let (s, c) = (libm::sin(pose.yaw), libm::cos(pose.yaw));
        let at = |[x, y]: [f64; 2]| [pose.x + c * x - s * y, pose.y + s * x + c * y];
        self.trees.iter().map(|t| libm::log(self.ratio(t, at(t.place), t.deviation).0)).sum()
    }

    /// Root of the mean squared distance of the trees from the origin, m.
    pub fn spread(&self) -> f64 {
        let square: f64 = self.trees.iter().map(|t| t.place[0] * t.place[0] + t.place[1] * t.place[1]).sum();
        (square / self.trees.len().max(1) as f64).sqrt()
    }

    /// Median of the deviations, m.
    pub fn deviation(&self) -> f64 {
        let mut all: Vec<f64> = self.trees.iter().map(|t| t.deviation).collect();
        all.sort_unstable_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.1)
    }
}

/// Mean and deviation of the diameters of a map where most trees have one.
fn diameters(map: &TreeMap) -> Option<[f64; 2]> {
    let all: Vec<f64> = map.trees().iter().filter_map(|t| t.diameter).collect();
    if 2 * all.len() < map.trees().len() {
        return None;
    }
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    let square = all.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / n;
    (square > 1e-8).then(|| [mean, square.sqrt()])
}
