//! Poses from pairs of trees that are as far apart on both maps.
//!
//! Two trees have a distance that no pose changes, so it describes them (as the edges of triangles do in E. Groth, "A
//! pattern-matching algorithm for two-dimensional coordinate lists", 1986). Each pair of the map at that distance gives a pose;
//! the other trees vote on it one after the other and end the vote as soon as it is lost (A. Wald, "Sequential tests of statistical
//! hypotheses", 1945).

use super::likelihood::{Likelihood, Seen};
use super::prior::{Prior, SLACK};
use crate::pose::Pose2;
use crate::tree_map::TreeMap;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Pairs of trees of a map by their distance.
#[derive(Clone, Debug)]
pub struct PairIndex {
    /// First pair of each bin of distances.
    starts: Vec<u32>,
    /// Both trees of each pair.
    pairs: Vec<[u32; 2]>,
}

/// Width of a bin, m.
const BIN: f64 = 0.05;
/// Shortest and longest pair, m.
const SHORTEST: f64 = 4.0;
const LONGEST: f64 = 24.0;
/// Pairs that an index holds at most: longer ones are left out of larger maps.
const MOST: f64 = 3e6;

impl PairIndex {
    /// All pairs up to 24 m, less where there would be more than three million.
    pub fn of(map: &TreeMap) -> Self {
        let n = map.trees().len() as f64;
        let longest = (MOST / (n * map.density() * 0.5 * TAU / 2.0)).sqrt().clamp(SHORTEST + 4.0, LONGEST);
        let bins = (longest / BIN) as usize + 1;
        let mut all: Vec<(u32, [u32; 2])> = Vec::new();
        for (a, t) in (0_u32..).zip(map.trees()) {
            for b in map.around(t.place, longest).filter(|b| *b > a) {
                let other = map.trees()[b as usize].place;
                let (x, y) = (other[0] - t.place[0], other[1] - t.place[1]);
                let d = (x * x + y * y).sqrt();
                if (SHORTEST..longest).contains(&d) {
                    all.push(((d / BIN) as u32, [a, b]));
                }
            }
        }
        let mut starts = vec![0_u32; bins + 2];
        all.iter().for_each(|(bin, _)| starts[*bin as usize + 1] += 1);
        (1..starts.len()).for_each(|k| starts[k] += starts[k - 1]);
        let (mut next, mut pairs) = (starts.clone(), vec![[0; 2]; all.len()]);
        for (bin, pair) in all {
            let place = &mut next[bin as usize];
            pairs[*place as usize] = pair;
            *place += 1;
        }
        Self { starts, pairs }
    }

    /// Longest pair, m.
    fn longest(&self) -> f64 {
        (self.starts.len() - 2) as f64 * BIN
    }

    /// Pairs whose distance is about between two.
    fn between(&self, low: f64, high: f64) -> &[[u32; 2]] {
        let bin = |d: f64| ((d / BIN).max(0.0) as usize).min(self.starts.len() - 2);
        &self.pairs[self.starts[bin(low)] as usize..self.starts[bin(high) + 1] as usize]
    }
}

/// Poses that are evaluated, at most.
const MOST_POSES: usize = 100_000;
/// Local pairs that are tried, at least and at most.
const LOCAL_PAIRS: [usize; 2] = [16, 60];
/// A vote ends when a pose explains the trees by this factor worse than chance.
const LOST: f64 = 0.003;
/// A pose is kept from this score on, nats: at the pose of a pair, which is not exact, a right one may explain little.
const KEPT: f64 = -3.0;
/// Cells in which one pose is kept, m and rad.
const CELLS: (f64, f64) = (1.0, 0.1);

/// Poses that may explain the trees, the best first.
pub(super) fn poses(likelihood: &Likelihood, index: &PairIndex, prior: Option<&Prior>) -> Vec<Pose2> {
    let trees = likelihood.trees();
    let mut best: BTreeMap<[i32; 3], (f64, Pose2)> = BTreeMap::new();
    let mut looked = 0;
    for (tried, (i, j, length)) in (1..).zip(local_pairs(trees, index.longest())) {
        let (a, b) = (&trees[i], &trees[j]);
        let spread = (a.deviation * a.deviation + b.deviation * b.deviation).sqrt();
        let off = 2.0 * spread;
        let vote = Vote::new(likelihood, i, j, length, spread);
        for pair in index.between(length - off, length + off) {
            for [p, q] in [*pair, [pair[1], pair[0]]] {
                let laid = vote.laid(p, q);
                if !prior.is_none_or(|prior| prior.allows_place([laid.x, laid.y], SLACK)) {
                    continue;
                }
                looked += 1;
                let Some(score) = vote.score(&laid) else { continue };
                let pose = Pose2 { x: laid.x, y: laid.y, yaw: libm::atan2(laid.sine, laid.cosine) };
                if !prior.is_none_or(|prior| prior.allows(&pose, SLACK)) {
                    continue;
                }
                let cell = |x: f64, c: f64| (x / c).floor() as i32;
                let key = [cell(pose.x, CELLS.0), cell(pose.y, CELLS.0), cell(pose.yaw, CELLS.1)];
                let kept = best.entry(key).or_insert((score, pose));
                if score > kept.0 {
                    *kept = (score, pose);
                }
            }
        }
        if looked > MOST_POSES && tried >= LOCAL_PAIRS[0] {
            break;
        }
    }
    let mut all: Vec<(f64, Pose2)> = best.into_values().collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, pose)| pose).collect()
}

/// Pairs of local trees: long ones, which fix the direction, spread over all trees.
fn local_pairs(trees: &[Seen], longest: f64) -> Vec<(usize, usize, f64)> {
    let mut all = Vec::new();
    for (i, a) in trees.iter().enumerate() {
        for (j, b) in trees.iter().enumerate().skip(i + 1) {
            let (x, y) = (a.place[0] - b.place[0], a.place[1] - b.place[1]);
            let d = (x * x + y * y).sqrt();
            if (SHORTEST + 1.0..longest - 1.0).contains(&d) {
                all.push((i, j, d));
            }
        }
    }
    // longest in relation to the deviations first
    let worth = |(i, j, d): &(usize, usize, f64)| d / (trees[*i].deviation + trees[*j].deviation);
    all.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    let most = (2 * LOCAL_PAIRS[1]).div_ceil(trees.len().max(1)) + 1;
    let mut uses = vec![0; trees.len()];
    let fresh = |(i, j, _): &(usize, usize, f64)| {
        let is_fresh = uses[*i] < most && uses[*j] < most;
        if is_fresh {
            uses[*i] += 1;
            uses[*j] += 1;
        }
        is_fresh
    };
    all.into_iter().filter(fresh).take(LOCAL_PAIRS[1]).collect()
}

/// A pose with the sine and the cosine of its direction.
struct Laid {
    x: f64,
    y: f64,
    cosine: f64,
    sine: f64,
}

/// The vote of all trees on the poses of one local pair.
struct Vote<'a> {
    likelihood: &'a Likelihood<'a>,
    /// Unit vector along the pair and its middle.
    along: [f64; 2],
    middle: [f64; 2],
    /// The other trees with their deviation under a pose of this pair.
    others: Vec<(Seen, f64)>,
}

impl<'a> Vote<'a> {
    fn new(likelihood: &'a Likelihood<'a>, i: usize, j: usize, length: f64, spread: f64) -> Self {
        let trees = likelihood.trees();
        let (a, b) = (trees[i].place, trees[j].place);
        let middle = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
        // the middle of a pair is off by half its spread, its direction by the spread over its length
        let deviation = |t: &Seen| {
            let (x, y) = (t.place[0] - middle[0], t.place[1] - middle[1]);
            let turned = spread * spread * (x * x + y * y) / (length * length);
            (t.deviation * t.deviation + 0.25 * spread * spread + 0.5 * turned).sqrt()
        };
        let mut others: Vec<(Seen, f64)> = (0..trees.len())
            .filter(|k| *k != i && *k != j)
            .map(|k| (trees[k], deviation(&trees[k])))
            .collect();
        others.sort_by(|a, b| a.1.total_cmp(&b.1));
        Self { likelihood, along: [0, 1].map(|k| (b[k] - a[k]) / length), middle, others }
    }

    /// The pose that puts the pair on two trees of the map.
    fn laid(&self, p: u32, q: u32) -> Laid {
        let [p, q] = [p, q].map(|k| self.likelihood.map.trees()[k as usize].place);
        let (x, y) = (q[0] - p[0], q[1] - p[1]);
        let length = (x * x + y * y).sqrt().max(1e-9);
        let [u, v] = self.along;
        let (cosine, sine) = ((u * x + v * y) / length, (u * y - v * x) / length);
        let [a, b] = self.middle;
        let turned = [cosine * a - sine * b, sine * a + cosine * b];
        Laid { x: 0.5 * (p[0] + q[0]) - turned[0], y: 0.5 * (p[1] + q[1]) - turned[1], cosine, sine }
    }

    /// How much better it explains the other trees than chance; none: not at all.
    fn score(&self, laid: &Laid) -> Option<f64> {
        let Laid { x: left, y: up, cosine: c, sine: s } = *laid;
        // the product of the ratios, whose logarithm is taken before it is too large for a number
        let (mut sum, mut product) = (0.0, 1.0);
        for (tree, deviation) in &self.others {
            let [x, y] = tree.place;
            let at = [left + c * x - s * y, up + s * x + c * y];
            product *= self.likelihood.ratio_near(tree, at, *deviation);
            if product < LOST && sum == 0.0 {
                return None;
            }
            if product > 1e100 {
                (sum, product) = (sum + libm::log(product), 1.0);
            }
        }
        let score = sum + libm::log(product);
        (score > KEPT).then_some(score)
    }
}
