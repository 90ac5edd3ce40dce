//! Whether to believe a pose: located, ambiguous or lost.
//!
//! Under chance the ratio of likelihoods of any one pose has the mean 1, so it exceeds e^L with a probability of at most e^−L (A. A.
//! Markov; as in A. Wald's test, 1945): of the n distinguishable poses in the area that was searched, n·e^−L are
//! expected to do so. That bounds chance. It does not cover a stand that repeats itself: the runner-up does.

use super::likelihood::Likelihood;
use super::prior::{Prior, SLACK};
use crate::pose::Pose2;
use nalgebra::Matrix3;
use std::f64::consts::{PI, TAU};
use std::fmt;

/// Fewest trees that can identify a place.
pub(super) const FEWEST: usize = 4;
/// False matches that are expected at most of a pose that is believed.
const FALSE_MATCHES: f64 = 1e-3;
/// By how much the best pose must be better than the next one: nats, and as a ratio of scores.
const AHEAD: f64 = 5.0;
const RATIO: f64 = 1.25;

/// A pose that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Pose of the local map in the global one.
    pub pose: Pose2,
    /// How much better it explains the trees than chance, nats.
    pub score: f64,
    /// Covariance of x, y, m², and yaw, rad².
    pub covariance: Matrix3<f64>,
    /// Trees with a partner on the map.
    pub matched: usize,
    /// Trees that were seen.
    pub seen: usize,
    /// Numbers of the trees of the local map and of their partners.
    pub matches: Vec<(u32, u32)>,
}

/// Where the machine is.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// It is there.
    Located(Box<Located>),
    /// Several poses explain the trees about as well.
    Ambiguous(Reason, Vec<Found>),
    /// No pose explains the trees.
    Lost(Reason),
}

/// A pose that is believed.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// The pose.
    pub found: Found,
    /// Score of the next best one, nats; 0: chance.
    pub runner_up: f64,
    /// False matches that chance alone is expected to show in the area that was searched.
    pub false_matches: f64,
}

impl std::ops::Deref for Located {
    type Target = Found;

    fn deref(&self) -> &Found {
        &self.found
    }
}

/// Why a pose is not believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// Fewer trees than can identify a place.
    TooFewTrees {
        /// Trees that were seen.
        seen: usize,
    },
    /// No pose puts the trees on the map better than chance.
    NothingFits,
    /// Chance explains the best pose.
    Chance {
        /// Score of the best one, nats.
        score: f64,
        /// False matches that are expected.
        false_matches: f64,
    },
    /// The next pose is nearly as good.
    RunnerUp {
        /// Score of the best one, nats.
        score: f64,
        /// That of the next one.
        runner_up: f64,
    },
    /// The best pose is outside of the prior.
    OutsidePrior {
        /// Its score, nats.
        score: f64,
    },
    /// Too few of the trees that were seen have a partner on the map.
    FewMatches {
        /// Trees with a partner.
        matched: usize,
        /// Trees that were seen.
        seen: usize,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewTrees { seen } => write!(f, "{seen} trees are seen, at least {FEWEST} are needed"),
            Self::NothingFits => f.write_str("no pose puts the trees on the map better than chance does"),
            Self::Chance { score, false_matches } => {
                write!(
                    f,
                    "the best pose scores {score:.1} nats; chance is expected to do so {false_matches:.2e} times"
                )
            }
            Self::RunnerUp { score, runner_up } => {
                write!(f, "the best pose scores {score:.1} nats, another one {runner_up:.1}")
            }
            Self::OutsidePrior { score } => {
                write!(f, "the best pose, with {score:.1} nats, is outside of the area that was asked for")
            }
            Self::FewMatches { matched, seen } => {
                write!(f, "only {matched} of {seen} trees that are seen have a partner on the map")
            }
        }
    }
}

/// Verdict on the poses, the best first.
pub(super) fn answer(likelihood: &Likelihood, found: &[Found], prior: Option<&Prior>) -> Answer {
    let Some(best) = found.first().filter(|f| f.score > 0.0) else {
        return Answer::Lost(Reason::NothingFits);
    };
    let runner_up = found.get(1).map_or(0.0, |f| f.score.max(0.0));
    let false_matches = poses(likelihood, prior) * libm::exp(-best.score);
    let ambiguous = |reason| Answer::Ambiguous(reason, found.iter().take(8).cloned().collect());
    let score = best.score;
    match () {
        () if false_matches > FALSE_MATCHES => ambiguous(Reason::Chance { score, false_matches }),
        () if prior.is_some_and(|p| !p.allows(&best.pose, 1.0)) => ambiguous(Reason::OutsidePrior { score }),
        () if score - runner_up < AHEAD || score < RATIO * runner_up => {
            ambiguous(Reason::RunnerUp { score, runner_up })
        }
        () if (best.matched as f64) < 0.4 * likelihood.matched() * best.seen as f64 => {
            ambiguous(Reason::FewMatches { matched: best.matched, seen: best.seen })
        }
        () => Answer::Located(Box::new(Located { found: best.clone(), runner_up, false_matches })),
    }
}

/// Number of distinguishable poses in the area that is searched.
fn poses(likelihood: &Likelihood, prior: Option<&Prior>) -> f64 {
    let [low, high] = likelihood.map.bounds();
    let whole = (high[0] - low[0]).max(1.0) * (high[1] - low[1]).max(1.0);
    let area = prior.map_or(whole, |p| (PI * (SLACK * p.radius).powi(2)).min(whole));
    let turn = prior.and_then(|p| p.yaw).map_or(TAU, |[_, off]| (2.0 * SLACK * off).min(TAU));
    let deviation = likelihood.deviation();
    let across = (deviation / likelihood.spread().max(1.0)).max(1e-4);
    (area / (TAU * deviation * deviation)).max(1.0) * (turn / across).max(1.0)
}
