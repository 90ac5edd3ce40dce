//! The pose that explains most: trees are assigned to those of the map by likelihood, then both maps are laid on each other by
//! least squares, again and again (expectation and maximisation: A. P. Dempster, N. M. Laird and D. B. Rubin, 1977).

use super::likelihood::Likelihood;
use super::verdict::Found;
use crate::pose::{Pose2, wrapped};
use nalgebra::Matrix3;

/// Rounds at most, and motion of the pose in the last one, m.
const ROUNDS: usize = 25;
const STILL: f64 = 1e-4;

/// Rounds of a first look.
const FEW: usize = 4;

/// A better pose near a pose, after a few rounds, with its score.
pub(super) fn polished(likelihood: &Likelihood, start: Pose2) -> (f64, Pose2) {
    let mut pose = start;
    for round in 0..FEW {
        let wide = if round < 2 { 1.5 } else { 1.0 };
        let Some(next) = laid_on(&assigned(likelihood, &pose, wide)) else { break };
        pose = next;
    }
    (likelihood.score(&pose), pose)
}

/// The best pose near a pose.
pub(super) fn refined(likelihood: &Likelihood, start: Pose2) -> Found {
    let mut pose = start;
    // begins with wide errors, so that a tree finds its partner from afar
    for round in 0..ROUNDS {
        let wide = 1.0 + 2.0 * (1.0 - round as f64 / 6.0).max(0.0);
        let Some(next) = laid_on(&assigned(likelihood, &pose, wide)) else { break };
        let (m, rad) = next.gap(&pose);
        pose = next;
        if round > 6 && m + likelihood.spread() * rad < STILL {
            break;
        }
    }
    let pairs = assigned(likelihood, &pose, 1.0);
    let matched = pairs.iter().filter(|p| p.weight * p.deviation * p.deviation > 0.5).count();
    let matches = pairs
        .iter()
        .filter(|p| p.weight * p.deviation * p.deviation > 0.5)
        .map(|p| (p.local, p.map))
        .collect();
    Found {
        pose,
        score: likelihood.score(&pose),
        covariance: covariance(&pairs, &pose),
        matched,
        seen: likelihood.trees().len(),
        matches,
    }
}

/// A tree with the one of the map that explains it.
struct Assigned {
    local: u32,
    map: u32,
    from: [f64; 2],
    to: [f64; 2],
    deviation: f64,
    /// Share that the tree of the map explains, over the square of the deviation.
    weight: f64,
}

fn assigned(likelihood: &Likelihood, pose: &Pose2, wide: f64) -> Vec<Assigned> {
    let mut all = Vec::new();
    for (local, tree) in (0..).zip(likelihood.trees()) {
        let deviation = wide * tree.deviation;
        if let Some((map, share)) = likelihood.ratio(tree, pose.place(tree.place), deviation).1 {
            let to = likelihood.map.trees()[map as usize].place;
            let weight = share / (deviation * deviation);
            all.push(Assigned { local, map, from: tree.place, to, deviation, weight });
        }
    }
    all
}

/// The pose that lays weighted points on others (the closed form of the plane).
fn laid_on(pairs: &[Assigned]) -> Option<Pose2> {
    let weight: f64 = pairs.iter().map(|p| p.weight).sum();
    if pairs.len() < 2 || !(weight > 0.0) {
        return None;
    }
    let mean = |of: &dyn Fn(&Assigned) -> f64| pairs.iter().map(|p| p.weight * of(p)).sum::<f64>() / weight;
    let from = [mean(&|p| p.from[0]), mean(&|p| p.from[1])];
    let to = [mean(&|p| p.to[0]), mean(&|p| p.to[1])];
    let (mut along, mut across) = (0.0, 0.0);
    for p in pairs {
        let (a, b) = ([0, 1].map(|k| p.from[k] - from[k]), [0, 1].map(|k| p.to[k] - to[k]));
        along += p.weight * (a[0] * b[0] + a[1] * b[1]);
        across += p.weight * (a[0] * b[1] - a[1] * b[0]);
    }
    let yaw = libm::atan2(across, along);
    let turned = Pose2 { x: 0.0, y: 0.0, yaw }.place(from);
    Some(Pose2 { x: to[0] - turned[0], y: to[1] - turned[1], yaw: wrapped(yaw) })
}

/// Covariance of x, y and yaw: the inverse of the information of the matches.
fn covariance(pairs: &[Assigned], pose: &Pose2) -> Matrix3<f64> {
    let mut information = Matrix3::identity() * 1e-6;
    for p in pairs {
        let [x, y] = Pose2 { x: 0.0, y: 0.0, ..*pose }.place(p.from);
        // a turn moves the point across
        let rows = nalgebra::Matrix2x3::new(1.0, 0.0, -y, 0.0, 1.0, x);
        information += p.weight * rows.transpose() * rows;
    }
    information.try_inverse().unwrap_or_else(|| Matrix3::identity() * 1e6)
}
