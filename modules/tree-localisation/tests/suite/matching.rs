//! Matching with a global map, kidnapped and with a prior, against the truth of grown stands; and invariants of all poses.

use forest_scenes::{TrialKind, TrialRow, best, local, map, stand_of};
use proptest::prelude::*;
use terraglue_forest::Survey;
use terraglue_tree_localisation::{Answer, LocalTree, MapTree, Matcher, Pose2, Prior, Reason, TreeMap};

fn row(noise_m: f64, [missing, extra]: [f64; 2], seen: usize, trials: u64) -> TrialRow {
    let kind =
        TrialKind { survey: Survey { noise_m, missing, extra }, diameter_m: None, seen, local_m: 0.05 };
    TrialRow { kind, trees: 450, trials, radius: None, right: 1.0 }
}

#[test]
fn who_is_kidnapped_is_found_on_a_surveyed_map() {
    let tally = row(0.03, [0.0, 0.0], 8, 40).run(|_, _, _, _| ()).expect("maps");
    assert!(tally.share() >= 0.99 && tally.error(0.5) <= 0.04 && tally.error(0.95) <= 0.10, "{tally:?}");
    assert_eq!(tally.wrong_accepted, 0);
}

#[test]
fn missing_and_extra_trees_and_noise_do_little_harm() {
    let tally = row(0.03, [0.3, 0.5], 20, 12).run(|_, _, _, _| ()).expect("maps");
    assert!(tally.share() >= 0.98 && tally.wrong_accepted == 0, "{tally:?}");
    let tally = row(0.3, [0.0, 0.0], 20, 12).run(|_, _, _, _| ()).expect("maps");
    assert!(tally.share() >= 0.95 && tally.error(0.5) <= 0.12 && tally.wrong_accepted == 0, "{tally:?}");
}

#[test]
fn who_stands_in_another_stand_is_not_located() {
    let row = row(0.1, [0.1, 0.1], 20, 1);
    let (growth, stand) = stand_of(450, 7);
    let (_, other) = stand_of(450, 8);
    let trial = row.kind.trial(&growth, &stand, 1);
    let matcher = Matcher::with(map(&trial).expect("a map"), row.model());
    for number in 0..15 {
        let elsewhere = row.kind.trial(&growth, &other, number);
        let answer = matcher.find(&local(&elsewhere, 0.05), None);
        assert!(!matches!(answer, Answer::Located(_)), "{answer:?}");
    }
}

#[test]
fn a_prior_that_is_wrong_does_not_make_a_wrong_pose_sure() {
    let row = row(0.5, [0.3, 0.1], 20, 1);
    let (growth, stand) = stand_of(450, 7);
    for number in 0..12 {
        let trial = row.kind.trial(&growth, &stand, number);
        let matcher = Matcher::with(map(&trial).expect("a map"), row.model());
        let truth = trial.pose();
        let prior = Prior { place: [truth.x + 25.0, truth.y], radius: 8.0, yaw: None };
        let answer = matcher.find(&local(&trial, 0.05), Some(&prior));
        assert!(!matches!(answer, Answer::Located(_)), "{answer:?}");
    }
}

#[test]
fn too_few_trees_have_a_reason_and_numbers_that_are_none_are_left_out() {
    let trial = row(0.1, [0.0, 0.0], 8, 1).kind;
    let (growth, stand) = stand_of(450, 7);
    let trial = trial.trial(&growth, &stand, 1);
    let matcher = Matcher::new(map(&trial).expect("a map"));
    let none = LocalTree {
        place: [f64::NAN, 0.0],
        deviation: 0.1,
        diameter: 0.1,
        diameter_deviation: 0.1,
        sightings: 1,
    };
    assert_eq!(matcher.find(&[none; 20], None), Answer::Lost(Reason::TooFewTrees { seen: 0 }));
    assert_eq!(matcher.find(&[], None), Answer::Lost(Reason::TooFewTrees { seen: 0 }));
    // the same tree again and again identifies no place
    let one = LocalTree { place: [1.0, 2.0], ..none };
    assert!(!matches!(matcher.find(&[one; 20], None), Answer::Located(_)));
}

/// A local map, moved by a pose.
fn moved(local: &[LocalTree], by: &Pose2) -> Vec<LocalTree> {
    local.iter().map(|t| t.moved(by)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn a_rigid_motion_of_either_map_does_not_change_the_match(
        number in 0_u64..1000, x in -50.0..50.0_f64, y in -50.0..50.0_f64, yaw in -3.0..3.0_f64,
    ) {
        let row = row(0.05, [0.1, 0.1], 15, 1);
        let (growth, stand) = stand_of(300, 3);
        let trial = row.kind.trial(&growth, &stand, number);
        let (known, seen) = (map(&trial).expect("a map"), local(&trial, 0.05));
        let by = Pose2 { x, y, yaw };
        let trees = known.trees().iter().map(|t| MapTree { place: by.place(t.place), ..*t }).collect();
        let shifted = Matcher::with(TreeMap::new(trees).expect("a map"), row.model());
        let matcher = Matcher::with(known, row.model());
        let here = matcher.find(&seen, None);
        let (plain, _) = best(&here).expect("a pose");
        let by_local = matcher.find(&moved(&seen, &by.inverse()), None);
        let (other, _) = best(&by_local).expect("a pose");
        let (m, rad) = other.pose.gap(&plain.pose.then(&by));
        prop_assert!(m < 1e-3 && rad < 1e-4, "{m} {rad}");
        // the bounds of a map are along its axes, so its density changes with a turn, and the score with it
        let by_map = shifted.find(&seen, None);
        let (other, _) = best(&by_map).expect("a pose");
        let (m, rad) = other.pose.gap(&by.then(&plain.pose));
        prop_assert!(m < 0.02 && rad < 0.002, "{m} {rad}");
    }
}
