//! Stage 7: the pose over time from odometry, GNSS and matches, with its uncertainty.
//!
//! Trees that were seen on the way are kept in the frame of the odometry, so the map that is matched grows while the machine drives.
//! Matches share the errors of the map and of trees that are seen again, so they are no independent measurements: the filter joins
//! them by covariance intersection (S. J. Julier and J. K. Uhlmann, "A non-divergent estimation algorithm in the presence of unknown
//! correlations", 1997), which is right for any correlation.

use crate::local_map::{LocalTree, add_sightings};
use crate::matching::{Answer, Located, Matcher, Prior, Reason};
use crate::pose::{Pose2, wrapped};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use terraglue_subsystem::bytes::Persist;
use terraglue_subsystem::{Result, persist};

/// Numbers of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackRules {
    /// Error of the odometry for each metre, m/m.
    pub drift: f64,
    /// Error of its direction for each metre, rad/m.
    pub turn_drift: f64,
    /// Trees are kept until the machine has driven so far without seeing them again, m.
    pub window_m: f64,
    /// Scans in a row without a match after which the machine is lost.
    pub patience: u32,
    /// Deviations of GNSS within which its answer is searched for.
    pub gnss_reach: f64,
}

impl Default for TrackRules {
    fn default() -> Self {
        Self { drift: 0.02, turn_drift: 0.003, window_m: 30.0, patience: 5, gnss_reach: 3.0 }
    }
}

/// Estimate of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The pose in the global map.
    pub pose: Pose2,
    /// Covariance of x, y, m², and yaw, rad².
    pub covariance: Matrix3<f64>,
    /// The place is within this distance of the true one with a probability of 99.7 %, if the match is right, m.
    pub bound: f64,
}

/// Effect of a scan on the estimate.
#[derive(Clone, Debug, PartialEq)]
pub enum Fix {
    /// It was matched and agrees with the estimate, or is the first one.
    Located(Box<Located>),
    /// It was matched somewhere else; the estimate stays until that has happened twice at about the same place.
    Elsewhere(Box<Located>),
    /// Several poses explain it; the best one is not believed.
    Ambiguous(Reason, Pose2),
    /// None does.
    Lost(Reason),
}

/// A tree on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Kept {
    tree: LocalTree,
    /// Way driven when it was seen last, m.
    seen_at: f64,
}
persist!(Kept { tree, seen_at });

/// Follows a machine.
#[derive(Clone, Debug)]
pub struct Tracker {
    matcher: Arc<Matcher>,
    rules: TrackRules,
    state: TrackState,
}

/// State of a tracker, apart from the map.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct TrackState {
    estimate: Option<Estimate>,
    /// Pose in the frame of the odometry, and way driven, m.
    odometry: Pose2,
    driven: f64,
    kept: Vec<Kept>,
    gnss: Option<([f64; 2], f64)>,
    without_match: u32,
    elsewhere: Option<(Pose2, Pose2)>,
}
persist!(TrackState { estimate, odometry, driven, kept, gnss, without_match, elsewhere });

impl TrackState {
    /// The pose, as far as it is known.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }
}

impl Persist for Estimate {
    fn write(&self, out: &mut Vec<u8>) {
        self.pose.write(out);
        self.covariance.iter().for_each(|v| v.write(out));
        self.bound.write(out);
    }

    fn read(from: &mut &[u8]) -> Result<Self> {
        let pose = Persist::read(from)?;
        let covariance: [f64; 9] = Persist::read(from)?;
        Ok(Self { pose, covariance: Matrix3::from_column_slice(&covariance), bound: Persist::read(from)? })
    }
}

/// Deviations by which a match may differ from the estimate.
const GATE: f64 = 4.0;
/// Smallest radius that is searched around the estimate, m.
const LEAST_RADIUS: f64 = 3.0;
/// Matches that agree about a pose elsewhere: m and rad.
const AGREE: (f64, f64) = (1.5, 0.1);

impl Tracker {
    /// Knows nothing yet.
    pub fn new(matcher: impl Into<Arc<Matcher>>, rules: TrackRules) -> Self {
        Self { matcher: matcher.into(), rules, state: TrackState::default() }
    }

    /// Its state.
    pub fn state(&self) -> &TrackState {
        &self.state
    }

    /// The same with an earlier state.
    pub fn with_state(self, state: TrackState) -> Self {
        Self { state, ..self }
    }

    /// The pose, as far as it is known.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.state.estimate.as_ref()
    }

    /// The matcher of the local map with the global one.
    pub fn matcher(&self) -> &Matcher {
        &self.matcher
    }

    /// Trees that are kept, in the frame of the machine.
    pub fn local_map(&self) -> Vec<LocalTree> {
        let back = self.state.odometry.inverse();
        let tree = |k: &Kept| {
            let drift = self.rules.drift * (self.state.driven - k.seen_at);
            let deviation = libm::sqrt(k.tree.deviation * k.tree.deviation + drift * drift);
            LocalTree { deviation, ..k.tree.moved(&back) }
        };
        self.state.kept.iter().map(tree).collect()
    }

    /// The machine has moved to this pose in its frame of before. Numbers that are none are left out.
    pub fn moved(&mut self, by: &Pose2) {
        if ![by.x, by.y, by.yaw].iter().all(|v| v.is_finite()) {
            return;
        }
        let way = libm::sqrt(by.x * by.x + by.y * by.y);
        self.state.odometry = self.state.odometry.then(by);
        self.state.driven += way;
        let window = self.state.driven - self.rules.window_m;
        self.state.kept.retain(|k| k.seen_at >= window);
        let rules = self.rules;
        if let Some(estimate) = &mut self.state.estimate {
            let (s, c) = (libm::sin(estimate.pose.yaw), libm::cos(estimate.pose.yaw));
            let mut turn = Matrix3::identity();
            turn[(0, 2)] = -s * by.x - c * by.y;
            turn[(1, 2)] = c * by.x - s * by.y;
            let (aside, turned) = (rules.drift * way, rules.turn_drift * way + 0.01 * by.yaw.abs());
            // errors of a way add up like one that stays the same, in between that and white noise
            let noise = Vector3::new(aside * aside, aside * aside, turned * turned) + Vector3::repeat(1e-8);
            let covariance = turn * estimate.covariance * turn.transpose() + Matrix3::from_diagonal(&noise);
            *estimate = Estimate::new(estimate.pose.then(by), covariance);
        }
    }

    /// GNSS shows a place, with its deviation under this canopy, m. It only determines where to search: its errors stay the
    /// same for minutes, so it corrects nothing.
    pub fn gnss(&mut self, place: [f64; 2], deviation: f64) {
        let is_some = place.iter().chain([&deviation]).all(|x| x.is_finite()) && deviation > 0.0;
        self.state.gnss = is_some.then_some((place, deviation));
    }

    /// GNSS shows nothing.
    pub fn no_gnss(&mut self) {
        self.state.gnss = None;
    }

    /// Trees that scanners show, in the frame of the machine.
    pub fn sighted(&mut self, trees: &[LocalTree]) -> Fix {
        self.keep(trees);
        let local = self.local_map();
        let prior = self.prior();
        match self.matcher.find(&local, prior.as_ref()) {
            Answer::Located(found) => self.located(found),
            Answer::Ambiguous(reason, all) => {
                self.unmatched();
                all.first().map_or(Fix::Lost(reason), |f| Fix::Ambiguous(reason, f.pose))
            }
            Answer::Lost(reason) => {
                self.unmatched();
                Fix::Lost(reason)
            }
        }
    }

    /// Adds trees to those that are kept.
    fn keep(&mut self, trees: &[LocalTree]) {
        let seen: Vec<LocalTree> = trees.iter().map(|t| t.moved(&self.state.odometry)).collect();
        let mut map: Vec<LocalTree> = self.state.kept.iter().map(|k| k.tree).collect();
        add_sightings(&mut map, &seen);
        let near = |t: &LocalTree, place: [f64; 2]| {
            let (x, y) = (t.place[0] - place[0], t.place[1] - place[1]);
            x * x + y * y < 0.25
        };
        let seen_at = |t: &LocalTree| {
            if seen.iter().any(|s| near(t, s.place)) {
                return self.state.driven;
            }
            let before = self.state.kept.iter().filter(|k| near(t, k.tree.place)).map(|k| k.seen_at);
            before.fold(f64::NEG_INFINITY, f64::max).max(self.state.driven - self.rules.window_m)
        };
        self.state.kept = map.iter().map(|t| Kept { tree: *t, seen_at: seen_at(t) }).collect();
    }

    /// Where to search: around the estimate, around GNSS, or everywhere.
    fn prior(&self) -> Option<Prior> {
        if let Some(estimate) = &self.state.estimate {
            let yaw = (GATE * estimate.covariance[(2, 2)].max(0.0).sqrt() + 0.1).min(std::f64::consts::PI);
            return Some(Prior {
                place: [estimate.pose.x, estimate.pose.y],
                radius: estimate.bound.max(LEAST_RADIUS),
                yaw: Some([estimate.pose.yaw, yaw]),
            });
        }
        let (place, deviation) = self.state.gnss?;
        Some(Prior { place, radius: self.rules.gnss_reach * deviation, yaw: None })
    }

    fn unmatched(&mut self) {
        self.state.without_match += 1;
        if self.state.without_match >= self.rules.patience && self.state.estimate.is_some() {
            // from here on it is searched for anew; trees of before may stand elsewhere in the frame of the odometry
            self.state.estimate = None;
            self.state.elsewhere = None;
            self.state.kept.clear();
        }
    }

    fn located(&mut self, found: Box<Located>) -> Fix {
        // the odometry stretches the local map, and with it where the machine is in it
        let stretch = 0.25 * self.rules.drift * self.state.driven.min(self.rules.window_m);
        let extra = Vector3::new(4e-4 + stretch * stretch, 4e-4 + stretch * stretch, 1e-6);
        let match_covariance = found.covariance + Matrix3::from_diagonal(&extra);
        let Some(estimate) = self.state.estimate else {
            self.state.estimate = Some(Estimate::new(found.pose, match_covariance));
            self.state.without_match = 0;
            return Fix::Located(found);
        };
        let gap = Vector3::new(
            found.pose.x - estimate.pose.x,
            found.pose.y - estimate.pose.y,
            wrapped(found.pose.yaw - estimate.pose.yaw),
        );
        let sum = estimate.covariance + match_covariance;
        let far = sum.cholesky().map_or(f64::INFINITY, |c| gap.dot(&c.solve(&gap)));
        if far > GATE * GATE {
            return self.at_another_place(found, match_covariance);
        }
        self.state.without_match = 0;
        self.state.elsewhere = None;
        self.state.estimate = Some(joined(&estimate, &gap, &match_covariance));
        Fix::Located(found)
    }

    /// A match that the estimate does not allow: twice at about the same place, it counts more.
    fn at_another_place(&mut self, found: Box<Located>, covariance: Matrix3<f64>) -> Fix {
        let agrees = self.state.elsewhere.is_some_and(|(pose, odometry)| {
            let now = pose.then(&odometry.inverse().then(&self.state.odometry));
            let (m, rad) = now.gap(&found.pose);
            m < AGREE.0 && rad < AGREE.1
        });
        if agrees {
            self.state.estimate = Some(Estimate::new(found.pose, covariance));
            self.state.elsewhere = None;
            self.state.without_match = 0;
            return Fix::Located(found);
        }
        self.state.elsewhere = Some((found.pose, self.state.odometry));
        self.unmatched();
        Fix::Elsewhere(found)
    }
}

impl Estimate {
    fn new(pose: Pose2, covariance: Matrix3<f64>) -> Self {
        let (a, b, c) = (covariance[(0, 0)], covariance[(1, 1)], covariance[(0, 1)]);
        // larger eigenvalue of the part of x and y
        let largest = 0.5 * (a + b) + (0.25 * (a - b) * (a - b) + c * c).sqrt();
        // 99.7 % of a normal distribution in the plane lies within 3.41 deviations
        Self { pose, covariance, bound: 3.41 * largest.max(0.0).sqrt() }
    }
}

/// Estimate and match by covariance intersection, with the share that leaves the smallest trace.
fn joined(estimate: &Estimate, gap: &Vector3<f64>, other: &Matrix3<f64>) -> Estimate {
    let mut best: Option<(f64, Estimate)> = None;
    for tenth in 1..10 {
        let share = 0.1 * f64::from(tenth);
        let (Some(a), Some(b)) = (estimate.covariance.try_inverse(), other.try_inverse()) else { continue };
        let Some(covariance) = (share * a + (1.0 - share) * b).try_inverse() else { continue };
        let step = covariance * ((1.0 - share) * b * gap);
        let trace = covariance[(0, 0)] + covariance[(1, 1)];
        if best.as_ref().is_none_or(|(t, _)| trace < *t) {
            let Pose2 { x, y, yaw } = estimate.pose;
            let pose = Pose2 { x: x + step.x, y: y + step.y, yaw: wrapped(yaw + step.z) };
            best = Some((trace, Estimate::new(pose, covariance)));
        }
    }
    best.map_or(*estimate, |(_, e)| e)
}
