//! F3, F14: cost of a turn and of a match.

use super::matching::row;
use super::{Context, Figure, Limit};
use crate::process::Outcome;
use crate::timing::{cpu_s, median};
use forest_scenes::{ERRORS, Forest, TrialRow, local, map, points, stand_of};
use terraglue_forest::Growth;
use terraglue_laser_scanner::Pattern;
use terraglue_tree_localisation::{Detector, Matcher, Scan};

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing {
        return Ok(Vec::new());
    }
    let near = |radius: f64| TrialRow { radius: Some(radius), trees: 1500, ..row(0.5, [0.3, 0.1], 35, 1) };
    let large = TrialRow { trees: 5674, ..row(0.1, [0.1, 0.1], 20, 1) };
    Ok(vec![
        turn()?,
        matched("map-450", "F14 a match kidnapped on a map of 450", 50.0, &row(0.03, [0.0; 2], 20, 1))?,
        matched("map-5674", "F14 a match kidnapped on a map of 5,674", 1000.0, &large)?,
        matched("prior-20", "F14 a match within 20 m on a map from the air", 50.0, &near(20.0))?,
        matched("prior-10", "F14 a match within 10 m on a map from the air", 50.0, &near(10.0))?,
    ])
}

fn turn() -> Outcome<Figure> {
    let forest = Forest::grow(Growth::default(), 1).map_err(|e| e.to_string())?;
    let seen = forest.scan(&Pattern::os1_64(), &ERRORS, [0.0; 2], 2.0, 0.0, 1);
    let scan = Scan::from_origin(points(&seen));
    let detector = Detector::default();
    let once = |_| {
        let start = cpu_s();
        std::hint::black_box(detector.detect(&scan));
        1e3 * (cpu_s() - start)
    };
    let time = median((0..11).map(once).collect());
    let what = format!("F3 CPU time of the stems of a turn of 64 beams with {} points, ms", seen.len());
    Ok(Figure::new("forest.speed.turn", time, Limit::AtMost(15.0), what).timed())
}

fn matched(id: &str, what: &str, limit: f64, row: &TrialRow) -> Outcome<Figure> {
    let (growth, stand) = stand_of(row.trees, 7);
    let mut times = Vec::new();
    let first = row.kind.trial(&growth, &stand, 0);
    let matcher = Matcher::with(map(&first).map_err(|e| e.to_string())?, row.model());
    for number in 0..11 {
        let seen = row.kind.seen(&stand, row.kind.trial(&growth, &stand, number).truth, 0);
        let trial = forest_scenes::Trial { seen, ..row.kind.trial(&growth, &stand, number) };
        let prior = row.prior(&trial.pose(), number);
        let trees = local(&trial, row.kind.local_m);
        let start = cpu_s();
        std::hint::black_box(matcher.find(&trees, prior.as_ref()));
        times.push(1e3 * (cpu_s() - start));
    }
    let what = format!("{what}, CPU time, ms, {} trees", row.kind.seen);
    Ok(Figure::new(format!("forest.speed.{id}"), median(times), Limit::AtMost(limit), what).timed())
}
