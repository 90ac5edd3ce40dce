//! Trials of matching: a map of a stand with errors, and the trees visible from a place in it.

use terraglue_forest::{Growth, Stand, Survey};
use terraglue_numerics::random::Random;

/// How trials are made.
#[derive(Clone, Copy, Debug)]
pub struct TrialKind {
    /// Errors of the map.
    pub survey: Survey,
    /// Whether the map has diameters, with this deviation, m.
    pub diameter_m: Option<f64>,
    /// Trees that are seen: so many of the nearest ones, one of ten of them missed.
    pub seen: usize,
    /// Deviation of their places along each axis, m.
    pub local_m: f64,
}

/// A trial: the truth and the data to find it.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Places and diameters of the map.
    pub map: Vec<([f64; 2], Option<f64>)>,
    /// Places of the trees that are seen, in the frame of who sees them, and diameters.
    pub seen: Vec<([f64; 2], f64)>,
    /// Who sees them: x, y, m, and yaw, rad.
    pub truth: [f64; 3],
}

/// Share of false trees among those that are seen.
const FALSE: f64 = 0.02;

impl TrialKind {
    /// The map of a stand, the same for all trials with one seed.
    pub fn map(&self, stand: &Stand, seed: u64) -> Vec<([f64; 2], Option<f64>)> {
        let mut random = Random::new(seed ^ 0x6d61_7073);
        let survey = self.survey.of(stand, seed);
        let mut diameter = |tree: Option<usize>| {
            let spread = self.diameter_m?;
            let other = random.below(stand.trees.len());
            let true_one = stand.trees.get(tree.unwrap_or(other))?.diameter;
            Some((true_one + spread * random.normal()).max(0.05))
        };
        survey.iter().map(|s| (s.place, diameter(s.tree))).collect()
    }

    /// The trees that are seen from a pose.
    pub fn seen(&self, stand: &Stand, truth: [f64; 3], seed: u64) -> Vec<([f64; 2], f64)> {
        let mut random = Random::new(seed ^ 0x7365_656e);
        let [x, y, yaw] = truth;
        let (s, c) = (libm::sin(yaw), libm::cos(yaw));
        let mut all: Vec<(f64, [f64; 2], f64)> = Vec::new();
        for tree in &stand.trees {
            let [u, v] = tree.place();
            let (u, v) = (u - x, v - y);
            all.push((u * u + v * v, [c * u + s * v, c * v - s * u], tree.diameter));
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut seen = Vec::new();
        for (square, place, diameter) in all {
            if seen.len() >= self.seen {
                break;
            }
            match random.uniform() {
                u if u < 0.1 => continue,
                u if u < 0.1 + FALSE => {
                    let (r, a) = (square.sqrt(), random.between(0.0, std::f64::consts::TAU));
                    seen.push(([r * libm::cos(a), r * libm::sin(a)], diameter));
                }
                _ => {
                    let place = place.map(|x| x + self.local_m * random.normal());
                    seen.push((place, (diameter + 0.03 * random.normal()).max(0.05)));
                }
            }
        }
        seen
    }

    /// Trial number `number` in a stand: from anywhere not too near to its border.
    pub fn trial(&self, growth: &Growth, stand: &Stand, number: u64) -> Trial {
        let mut random = Random::new(number.wrapping_mul(0x9e37_79b9) ^ 0x7472_6961);
        let half = growth.half_m - 12.0_f64.min(0.4 * growth.half_m);
        let truth = [
            random.between(-half, half),
            random.between(-half, half),
            random.between(-std::f64::consts::PI, std::f64::consts::PI),
        ];
        Trial { map: self.map(stand, number), seen: self.seen(stand, truth, number), truth }
    }
}

/// A stand of about that many trees at 700 stems per hectare.
pub fn stand_of(trees: usize, seed: u64) -> (Growth, Stand) {
    let half_m = 0.5 * (trees as f64 / 700.0 * 1e4).sqrt();
    let growth = Growth { half_m, clearing_m: 0.0, bushes_per_hectare: 0.0, ..Growth::default() };
    let stand = Stand::grow(&growth, seed);
    (growth, stand)
}
