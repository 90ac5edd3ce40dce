//! Stems from scans of stands that are grown here, against the trees that stand there.

use forest_scenes::{ERRORS, Forest, HEAD, Machine, OWN, SCANNER_HEIGHT, SCANNERS, Score, points, score};
use terraglue_forest::{Growth, Stand};
use terraglue_laser_scanner::Pattern;
use terraglue_tree_localisation::{
    Detector, Filter, LocalTree, Nothing, Point, Pose2, SAME_TREE_M, Scan, Station, merged,
};

#[test]
fn one_turn_of_64_beams_shows_the_stems_within_20_m() {
    let mut sum = Score::default();
    for seed in 0..4 {
        let forest = Forest::grow(Growth::default(), seed).expect("a stand");
        let seen = forest.scan(&Pattern::os1_64(), &ERRORS, [0.0; 2], 2.0, 0.3, seed);
        let detection = Detector::default().detect(&Scan::from_origin(points(&seen)));
        let one = score(&forest, &[(&seen, [0.0; 2], 0.3)], &detection.stems, 20.0);
        sum.add(&one);
    }
    assert!(sum.precision() >= 0.95 && sum.recall() >= 0.95, "{sum:?}");
    assert!(sum.rms() <= 0.10 && sum.bias().abs() <= 0.03, "{sum:?}");
}

#[test]
fn one_turn_of_16_beams_shows_less() {
    let mut sum = Score::default();
    for seed in 0..4 {
        let forest = Forest::grow(Growth::default(), seed).expect("a stand");
        let seen = forest.scan(&Pattern::vlp_16(), &ERRORS, [0.0; 2], 2.0, 0.3, seed);
        let detection = Detector::default().detect(&Scan::from_origin(points(&seen)));
        sum.add(&score(&forest, &[(&seen, [0.0; 2], 0.3)], &detection.stems, 20.0));
    }
    assert!(sum.precision() >= 0.95 && sum.recall() >= 0.75, "{sum:?}");
}

#[test]
fn ten_turns_of_16_beams_over_5_m_show_nearly_all() {
    let forest = Forest::grow(Growth::default(), 5).expect("a stand");
    let places: Vec<[f64; 2]> = (0..10).map(|k| [0.5 * f64::from(k), 0.0]).collect();
    let turns: Vec<_> = (0..)
        .zip(&places)
        .map(|(k, at)| forest.scan(&Pattern::vlp_16(), &ERRORS, *at, 2.0, 0.0, k))
        .collect();
    let scans: Vec<Scan> = turns.iter().map(|t| Scan::from_origin(points(t))).collect();
    let eye = forest.eye([0.0; 2], 2.0);
    let station = |at: &[f64; 2]| Station { position: [at[0], at[1], forest.eye(*at, 2.0) - eye], yaw: 0.0 };
    let all: Vec<(&Scan, Station)> = scans.iter().zip(places.iter().map(station)).collect();
    let detection = Detector::default().detect_all(&all);
    let score = score(&forest, &[(&turns[0], [0.0; 2], 0.0)], &detection.stems, 20.0);
    assert!(score.precision() >= 0.95 && score.recall() >= 0.90, "{score:?}");
}

#[test]
fn two_scanners_see_more_and_no_tree_twice() {
    let forest = Forest::grow(Growth::default(), 6).expect("a stand");
    let places = [[0.0, 1.2], [0.0, -1.2]];
    let maps: Vec<Vec<LocalTree>> = (0..)
        .zip(places)
        .map(|(k, at)| {
            let seen = forest.scan(&Pattern::os1_64(), &ERRORS, at, 2.5, 0.0, k);
            let stems = Detector::default().detect(&Scan::from_origin(points(&seen))).stems;
            let here = Pose2 { x: at[0], y: at[1], yaw: 0.0 };
            stems.iter().map(|s| LocalTree::from(s).moved(&here)).collect()
        })
        .collect();
    let map = merged(&maps);
    assert!(map.len() >= maps[0].len().max(maps[1].len()));
    for (k, a) in map.iter().enumerate() {
        let near = |b: &LocalTree| (a.place[0] - b.place[0]).hypot(a.place[1] - b.place[1]) < SAME_TREE_M;
        assert!(!map[..k].iter().any(near));
    }
}

fn nothing(points: Vec<Point>) -> Option<Nothing> {
    let detection = Detector::default().detect(&Scan::from_origin(points));
    assert!(detection.stems.is_empty());
    detection.nothing
}

#[test]
fn scans_that_show_no_trees_say_why() {
    assert_eq!(nothing(Vec::new()), Some(Nothing::NoPoints));
    assert_eq!(nothing(vec![Point::at([f64::NAN; 3]); 10]), Some(Nothing::AllFiltered));
    let ten = (0..10).map(|k| Point::at([5.0 + 0.1 * f64::from(k), 0.0, -1.0]));
    assert!(nothing(ten.collect()).is_some());
    assert!(nothing(vec![Point::at([5.0, 1.0, 0.0]); 1000]).is_some());
    let empty = Growth { per_hectare: 0.0, bushes_per_hectare: 0.0, ..Growth::default() };
    let seen =
        Forest::grow(empty, 1).expect("ground").scan(&Pattern::os1_64(), &ERRORS, [0.0; 2], 2.0, 0.0, 1);
    assert!(seen.len() > 1000);
    assert!(matches!(nothing(points(&seen)), Some(Nothing::NothingStands | Nothing::NoStems)));
    let bushes = Growth { per_hectare: 0.0, bushes_per_hectare: 1500.0, ..Growth::default() };
    let seen =
        Forest::grow(bushes, 1).expect("bushes").scan(&Pattern::os1_64(), &ERRORS, [0.0; 2], 2.0, 0.0, 1);
    assert_eq!(nothing(points(&seen)), Some(Nothing::NoStems));
}

/// Stems of both scanners of a machine, in the frame of the machine, with its own points or without.
fn around_a_machine(forest: &Forest, drops_own: bool) -> Vec<Vec<LocalTree>> {
    let mut detector = Detector::default();
    detector.filter.own_bodies.extend(drops_own.then_some(OWN));
    let map = |(k, at): (u64, [f64; 2])| {
        let seen = forest.scan(&Pattern::os1_64(), &ERRORS, at, SCANNER_HEIGHT, 0.0, k);
        let stems = detector.detect(&Scan::from_origin(points(&seen))).stems;
        let here = Pose2 { x: at[0], y: at[1], yaw: 0.0 };
        stems.iter().map(|s| LocalTree::from(s).moved(&here)).collect()
    };
    (0..).zip(SCANNERS).map(map).collect()
}

#[test]
fn the_felling_head_is_taken_for_a_tree_unless_it_is_left_out() {
    let growth = Growth { clearing_m: 8.0, ..Growth::default() };
    let forest = Forest::around(growth, Stand::grow(&growth, 4), 4, &Machine::harvester()).expect("a stand");
    let near = |map: &[LocalTree]| {
        map.iter().filter(|t| (t.place[0] - HEAD[0]).hypot(t.place[1] - HEAD[1]) < 0.5).count()
    };
    let [with, without] = [false, true].map(|drops_own| merged(&around_a_machine(&forest, drops_own)));
    assert_eq!((near(&with), near(&without)), (1, 0));
    let seen = forest.scan(&Pattern::os1_64(), &ERRORS, SCANNERS[0], SCANNER_HEIGHT, 0.0, 0);
    let filter = Filter { own_bodies: vec![OWN], ..Filter::default() };
    let hidden = filter.hidden(&Scan::from_origin(points(&seen)));
    // the head from the left scanner, and the cab to its right
    let head = libm::atan2(HEAD[1] - SCANNERS[0][1], HEAD[0] - SCANNERS[0][0]);
    assert!(hidden.iter().any(|[from, to]| (from - 0.06..to + 0.06).contains(&head)), "{hidden:?}");
    assert!(hidden.iter().any(|[from, to]| (*from..*to).contains(&-2.2)), "{hidden:?}");
}
