//! Trials of matching as the library of the localisation takes them, and how often its answers are right.

use crate::trials::{Trial, TrialKind, stand_of};
use terraglue_tree_localisation::{
    Answer, Found, LocalTree, MapError, MapTree, MatchModel, Matcher, Pose2, Prior, TreeMap,
};

/// The map of a trial.
///
/// # Errors
/// A map that is refused; none that is drawn is.
pub fn map(trial: &Trial) -> Result<TreeMap, MapError> {
    TreeMap::new(
        trial.map.iter().map(|(place, diameter)| MapTree { place: *place, diameter: *diameter }).collect(),
    )
}

/// The trees that are seen in a trial.
pub fn local(trial: &Trial, deviation: f64) -> Vec<LocalTree> {
    let tree = |(place, diameter): &([f64; 2], f64)| LocalTree {
        place: *place,
        deviation,
        diameter: *diameter,
        diameter_deviation: 0.03,
        sightings: 1,
    };
    trial.seen.iter().map(tree).collect()
}

/// How answers came out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Trials.
    pub trials: usize,
    /// Best poses that are right.
    pub right: usize,
    /// Answers that are believed.
    pub accepted: usize,
    /// Those of them that are wrong.
    pub wrong_accepted: usize,
    /// Errors of the right ones, m.
    pub errors: Vec<f64>,
}

impl Tally {
    /// Share of the best poses that are right.
    pub fn share(&self) -> f64 {
        self.right as f64 / self.trials as f64
    }

    /// The error that this share of the right poses does not exceed, m.
    pub fn error(&self, share: f64) -> f64 {
        let mut all = self.errors.clone();
        all.sort_by(f64::total_cmp);
        all.get(((all.len() as f64 * share) as usize).min(all.len().max(1) - 1)).copied().unwrap_or(f64::NAN)
    }
}

/// The best pose of an answer, and whether it is believed.
pub fn best(answer: &Answer) -> Option<(&Found, bool)> {
    match answer {
        Answer::Located(found) => Some((found, true)),
        Answer::Ambiguous(_, all) => Some((all.first()?, false)),
        Answer::Lost(_) => None,
    }
}

/// A row of trials: a kind in stands of so many trees.
#[derive(Clone, Copy, Debug)]
pub struct TrialRow {
    /// Errors of the map, and the trees that are seen.
    pub kind: TrialKind,
    /// Trees of the stand.
    pub trees: usize,
    /// Trials.
    pub trials: u64,
    /// Radius of the prior, m; the truth is anywhere in it.
    pub radius: Option<f64>,
    /// Distance up to which a pose is right, m.
    pub right: f64,
}

impl TrialRow {
    /// The errors of the map as passed to the matcher.
    pub fn model(&self) -> MatchModel {
        let survey = self.kind.survey;
        let (noise_m, matched) = (survey.noise_m.max(0.05), (1.0 - survey.missing) * 0.95);
        let diameter_m = self.kind.diameter_m.unwrap_or(MatchModel::default().diameter_m);
        MatchModel { noise_m, matched, diameter_m }
    }

    /// The prior of a trial.
    pub fn prior(&self, truth: &Pose2, number: u64) -> Option<Prior> {
        let radius = self.radius?;
        let off = [0.37, 0.81].map(|k| (k * number as f64).fract() - 0.5);
        Some(Prior { place: [truth.x + off[0] * radius, truth.y + off[1] * radius], radius, yaw: None })
    }

    /// Makes the trials; `found` takes each one with its answer.
    ///
    /// # Errors
    /// A map that is refused.
    pub fn run(
        &self,
        mut found: impl FnMut(&Trial, &Matcher, Option<&Prior>, &Answer),
    ) -> Result<Tally, MapError> {
        let (growth, stand) = stand_of(self.trees, 7);
        let mut tally = Tally::default();
        for number in 0..self.trials {
            let trial = self.kind.trial(&growth, &stand, number);
            let matcher = Matcher::with(map(&trial)?, self.model());
            let truth = trial.pose();
            let prior = self.prior(&truth, number);
            let answer = matcher.find(&local(&trial, self.kind.local_m), prior.as_ref());
            found(&trial, &matcher, prior.as_ref(), &answer);
            tally.count(&answer, &truth, self.right);
        }
        Ok(tally)
    }
}

impl Trial {
    /// The true pose.
    pub fn pose(&self) -> Pose2 {
        let [x, y, yaw] = self.truth;
        Pose2 { x, y, yaw }
    }
}

impl Tally {
    /// Counts an answer.
    pub fn count(&mut self, answer: &Answer, truth: &Pose2, right: f64) {
        self.trials += 1;
        let Some((found, accepted)) = best(answer) else { return };
        let (m, rad) = found.pose.gap(truth);
        let is_right = m < right && rad < 0.2;
        self.right += usize::from(is_right);
        self.accepted += usize::from(accepted);
        self.wrong_accepted += usize::from(accepted && !is_right);
        if is_right {
            self.errors.push(m);
        }
    }
}
