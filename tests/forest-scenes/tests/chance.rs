//! Stands that have nothing to do with a map match it no more often than the verdict expects of chance.
#![allow(clippy::unwrap_used, missing_docs)]

use forest_scenes::{Trial, TrialKind, TrialRow, local, map, stand_of};
use terraglue_forest::Survey;
use terraglue_tree_localisation::{Answer, Matcher, Reason};

/// False matches that are expected of the best pose of each trial; infinite where nothing fits.
fn expected(kind: TrialKind, trials: u64) -> Vec<f64> {
    let row = TrialRow { kind, trees: 450, trials, radius: Some(15.0), right: 1.5 };
    let ((growth, mapped), (_, seen)) = (stand_of(450, 7), stand_of(450, 8));
    let trial = |number: u64| {
        let trial = kind.trial(&growth, &mapped, number);
        let trial = Trial { seen: kind.seen(&seen, trial.truth, number), ..trial };
        let matcher = Matcher::with(map(&trial).unwrap(), row.model());
        match matcher.find(&local(&trial, kind.local_m), row.prior(&trial.pose(), number).as_ref()) {
            Answer::Located(found) => found.false_matches,
            Answer::Ambiguous(Reason::Chance { false_matches, .. }, _) => false_matches,
            // not chance, but another reason refused a pose
            Answer::Ambiguous(..) => 0.0,
            Answer::Lost(_) => f64::INFINITY,
        }
    };
    (0..trials).map(trial).collect()
}

#[test]
fn a_stand_that_is_not_on_the_map_matches_as_rarely_as_chance_is_expected_to() {
    let survey = |noise_m: f64| Survey { noise_m, missing: 0.1, extra: 0.05 };
    let kind = |noise_m: f64, diameter_m: Option<f64>, seen: usize| TrialKind {
        survey: survey(noise_m),
        diameter_m,
        seen,
        local_m: 0.05,
    };
    for kind in [kind(0.1, None, 8), kind(0.1, Some(0.03), 12), kind(0.3, Some(0.05), 12)] {
        let all = expected(kind, 150);
        for share in [0.3, 0.1, 0.03] {
            let count = all.iter().filter(|f| **f < share).count() as f64;
            let mean = share * all.len() as f64;
            assert!(count <= mean + 3.0 * mean.sqrt(), "{kind:?}: {count} below {share}, {mean} expected");
        }
        assert!(all.iter().all(|f| *f > 1e-3), "{kind:?}: a stand that is not on the map was believed");
    }
}
