//! The pose over time: drives through grown stands, with odometry that drifts and GNSS that is wrong.

use forest_scenes::{Drive, Driven, TrialKind};
use terraglue_forest::Survey;

fn drives(noise_m: f64, kidnapped: Option<(u64, f64)>, way: f64, count: u64) -> Vec<Driven> {
    let survey = Survey { noise_m, missing: 0.3, extra: 0.1 };
    let kind = TrialKind { survey, diameter_m: None, seen: 35, local_m: 0.05 };
    let drive = Drive { kind, way, gnss_m: 10.0, kidnapped };
    (0..count).map(|seed| drive.run(seed).expect("a map")).collect()
}

#[test]
fn thirty_metres_of_driving_make_a_bad_map_enough() {
    let all = drives(0.5, None, 30.0, 12);
    let right = all.iter().filter(|d| d.best <= 0.5).count();
    let located = all.iter().filter(|d| d.last.is_some_and(|(error, _)| error <= 0.5)).count();
    assert!(right == 12 && located >= 10, "{right} {located} {all:?}");
    let points: Vec<(f64, f64)> = all.iter().flat_map(|d| d.errors.clone()).collect();
    let beyond = points.iter().filter(|(error, bound)| error > bound).count();
    assert!(beyond * 100 <= points.len(), "{beyond} of {} errors exceed their bound", points.len());
    assert_eq!(all.iter().map(|d| d.wrong).sum::<usize>(), 0);
}

#[test]
fn who_is_carried_off_notices_and_is_found_again() {
    for driven in drives(0.1, Some((5, 12.0)), 75.0, 6) {
        let (error, bound) = driven.last.expect("an estimate");
        assert!(error < 0.5 && error < bound, "{driven:?}");
    }
}
