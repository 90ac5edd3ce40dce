//! Drives through grown stands with odometry that drifts, GNSS that is wrong, and a scan each few metres.

use crate::tally::{local, map};
use crate::trials::{Trial, TrialKind, stand_of};
use terraglue_numerics::random::Random;
use terraglue_tree_localisation::{Fix, MapError, MatchModel, Matcher, Pose2, TrackRules, Tracker};

/// A drive.
#[derive(Clone, Copy, Debug)]
pub struct Drive {
    /// Errors of the map, and trees of each scan.
    pub kind: TrialKind,
    /// Way, m.
    pub way: f64,
    /// Largest constant error of GNSS along each axis, m; its stated deviation is 0.7 of it.
    pub gnss_m: f64,
    /// After how many scans the machine is carried off without noticing, and how far, m.
    pub kidnapped: Option<(u64, f64)>,
}

/// Result of a drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Driven {
    /// Error and bound after each scan for which there was an estimate, m.
    pub errors: Vec<(f64, f64)>,
    /// The same at the end; none: no estimate.
    pub last: Option<(f64, f64)>,
    /// Error at the end of the estimate or, where there is none, of the best pose, which is not believed, m; NaN: of nothing.
    pub best: f64,
    /// Matches that were believed, and those of them that were off by more than a metre.
    pub believed: usize,
    /// See there.
    pub wrong: usize,
}

/// Way between two scans, m.
const STEP: f64 = 3.0;

impl Drive {
    /// Drives with the errors of a seed.
    ///
    /// # Errors
    /// A map that is refused.
    pub fn run(&self, seed: u64) -> Result<Driven, MapError> {
        let (_, stand) = stand_of(1500, 7);
        let mut random = Random::new(seed);
        let of = |seen| Trial { map: Vec::new(), seen, truth: [0.0; 3] };
        let known = map(&Trial { map: self.kind.map(&stand, seed), ..of(Vec::new()) })?;
        let survey = self.kind.survey;
        let (noise_m, matched) = (survey.noise_m.max(0.05), 0.95 * (1.0 - survey.missing));
        let model = MatchModel { noise_m, matched, ..MatchModel::default() };
        let mut tracker = Tracker::new(Matcher::with(known, model), TrackRules::default());
        let mut truth = Pose2 {
            x: random.between(-25.0, 25.0),
            y: random.between(-25.0, 25.0),
            yaw: random.between(-3.0, 3.0),
        };
        let off = [0; 2].map(|_| self.gnss_m * random.between(-1.0, 1.0));
        let scale = 1.0 + 0.01 * random.normal();
        let mut driven = Driven::default();
        let scans = (self.way / STEP) as u64;
        for k in 0..=scans {
            tracker.gnss([truth.x + off[0], truth.y + off[1]], 0.7 * self.gnss_m);
            let seen = self.kind.seen(&stand, [truth.x, truth.y, truth.yaw], seed * 1000 + k);
            let fix = tracker.sighted(&local(&of(seen), self.kind.local_m));
            if let Fix::Located(found) | Fix::Elsewhere(found) = &fix {
                driven.believed += 1;
                driven.wrong += usize::from(found.pose.gap(&truth).0 > 1.0);
            }
            driven.last = tracker.estimate().map(|e| (e.pose.gap(&truth).0, e.bound));
            driven.errors.extend(driven.last);
            driven.best = match (driven.last, &fix) {
                (Some((error, _)), _) => error,
                (None, Fix::Ambiguous(_, pose)) => pose.gap(&truth).0,
                _ => f64::NAN,
            };
            let step = Pose2 { x: STEP, y: 0.0, yaw: 0.04 };
            if k < scans {
                truth = truth.then(&step);
                let off = [0.02, 0.004].map(|s| s * random.normal());
                tracker.moved(&Pose2 { x: STEP * scale, y: off[0], yaw: step.yaw + off[1] });
            }
            if let Some((_, way)) = self.kidnapped.filter(|(scan, _)| *scan == k) {
                truth = truth.then(&Pose2 { x: 0.0, y: way, yaw: 0.0 });
            }
        }
        Ok(driven)
    }
}
