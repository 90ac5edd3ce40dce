//! Stage 6: the pose of the local map in the global one, without knowing anything or within a circle, and whether to believe it.
//!
//! * `likelihood.rs`: how much better a pose explains the trees around than chance does.
//! * `pairs.rs`: poses from pairs of trees that are as far apart in both maps: the descriptor.
//! * `prior.rs`: prior knowledge of the pose.
//! * `refine.rs`: the pose that explains most, its covariance.
//! * `verdict.rs`: located, ambiguous or lost: score, runner-up and expected number of false matches.

mod likelihood;
mod pairs;
mod prior;
mod refine;
mod verdict;

pub use likelihood::MatchModel;
pub use pairs::PairIndex;
pub use prior::Prior;
pub use verdict::{Answer, Found, Located, Reason};

use crate::local_map::LocalTree;
use crate::pose::Pose2;
use crate::tree_map::TreeMap;
use likelihood::Likelihood;
use prior::SLACK;

/// Matches local maps with a global one.
///
/// ```
/// use terraglue_tree_localisation::{Answer, LocalTree, MapTree, Matcher, Pose2, TreeMap};
/// use terraglue_numerics::random::uniform;
/// let place = |k: u64| [40.0 * uniform(1, 2 * k), 40.0 * uniform(1, 2 * k + 1)];
/// let trees = (0..120).map(|k| MapTree { place: place(k), diameter: None }).collect();
/// let map = TreeMap::new(trees)?;
/// let truth = Pose2 { x: 20.0, y: 20.0, yaw: 1.0 };
/// let local: Vec<LocalTree> = (0..120)
///     .map(|k| truth.inverse().place(place(k)))
///     .filter(|p| p[0].hypot(p[1]) < 12.0)
///     .map(|place| LocalTree { place, deviation: 0.02, diameter: 0.3, diameter_deviation: 1.0, sightings: 1 })
///     .collect();
/// let answer = Matcher::new(map).find(&local, None);
/// assert!(matches!(answer, Answer::Located(found) if found.pose.gap(&truth).0 < 0.02));
/// # Ok::<(), terraglue_tree_localisation::MapError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Matcher {
    map: TreeMap,
    index: PairIndex,
    model: MatchModel,
}

/// Poses that are evaluated again, and those of them that are refined.
const POLISHED: usize = 192;
const REFINED: usize = 32;
/// Poses nearer to each other than this are one, m and rad.
const SAME: (f64, f64) = (1.0, 0.07);

impl Matcher {
    /// With the usual errors of a map.
    pub fn new(map: TreeMap) -> Self {
        Self::with(map, MatchModel::default())
    }

    /// With the errors of this map.
    pub fn with(map: TreeMap, model: MatchModel) -> Self {
        let index = PairIndex::of(&map);
        Self { map, index, model }
    }

    /// The global map.
    pub fn map(&self) -> &TreeMap {
        &self.map
    }

    /// The errors that are expected of it.
    pub fn model(&self) -> &MatchModel {
        &self.model
    }

    /// Where the origin of the local map is, and whether that is sure. The answer is the same for any number of threads: it uses
    /// none.
    pub fn find(&self, local: &[LocalTree], prior: Option<&Prior>) -> Answer {
        let finite = |t: &&LocalTree| t.place.iter().chain([&t.deviation]).all(|x| x.is_finite());
        let local: Vec<LocalTree> = local.iter().filter(finite).copied().collect();
        let likelihood = Likelihood::new(&self.map, &self.model, &local);
        if likelihood.trees().len() < verdict::FEWEST {
            return Answer::Lost(Reason::TooFewTrees { seen: likelihood.trees().len() });
        }
        let poses = pairs::poses(&likelihood, &self.index, prior);
        let mut found: Vec<Found> = Vec::new();
        let first = poses.into_iter().take(POLISHED).map(|p| refine::polished(&likelihood, p));
        let mut poses: Vec<(f64, Pose2)> = first.collect();
        poses.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, pose) in poses.into_iter().take(REFINED) {
            let refined = refine::refined(&likelihood, pose);
            let same = |f: &&mut Found| {
                let (m, rad) = f.pose.gap(&refined.pose);
                m < SAME.0 && rad < SAME.1
            };
            match found.iter_mut().find(same) {
                Some(f) if f.score < refined.score => *f = refined,
                Some(_) => {}
                None => found.push(refined),
            }
        }
        found.retain(|f| prior.is_none_or(|p| p.allows(&f.pose, SLACK)));
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        verdict::answer(&likelihood, &found, prior)
    }

    /// How much better a pose explains a local map than chance does, nats, for any number of poses.
    pub fn scores(&self, local: &[LocalTree]) -> impl Fn(&Pose2) -> f64 {
        let likelihood = Likelihood::new(&self.map, &self.model, local);
        move |pose| likelihood.score(pose)
    }
}
