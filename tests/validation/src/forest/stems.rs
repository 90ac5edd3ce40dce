//! F3, F4, F6, F7: stems from turns of scanners in stands that are grown from a seed, with branches, undergrowth and slopes.

use super::{Context, Figure, Limit};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use forest_scenes::{
    ERRORS, Forest, HEAD, Machine, OWN, SCANNER_HEIGHT, SCANNERS, Score, Seen, points, score,
};
use terraglue_forest::{Growth, Stand};
use terraglue_laser_scanner::Pattern;
use terraglue_tree_localisation::{
    Detection, Detector, LocalTree, Pose2, SAME_TREE_M, Scan, Station, merged,
};

/// Distance up to which stems count, m.
const WITHIN: f64 = 20.0;
/// Height of a scanner that stands alone, m.
const ABOVE: f64 = 2.0;

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let seeds: Vec<u64> = (0..if context.quick { 4 } else { 20 }).collect();
    let sum = |one: fn(&u64) -> Outcome<Score>| -> Outcome<Score> {
        let mut sum = Score::default();
        for score in in_parallel(&seeds, one) {
            sum.add(&score?);
        }
        Ok(sum)
    };
    let of = format!("within 20 m in {} stands", seeds.len());
    let mut out = judged("os1-64", "F3 one turn of 64 beams", &sum(one_os1)?, [0.95, 0.95], &of);
    let os1 = sum(one_os1)?;
    out.push(Figure::new(
        "forest.stems.os1-64.place",
        os1.rms(),
        Limit::AtMost(0.10),
        format!("F3 root of the mean squared error of the places, m, {of}"),
    ));
    out.push(Figure::new(
        "forest.stems.os1-64.diameter",
        os1.bias().abs(),
        Limit::AtMost(0.03),
        format!("F3 bias of the diameter of stems of which both sides are seen, m, {of}"),
    ));
    out.extend(judged("vlp-16", "F4 one turn of 16 beams", &sum(one_vlp)?, [0.95, 0.75], &of));
    out.extend(judged("vlp-16.ten", "F4 ten turns of 16 beams over 5 m", &sum(ten_vlp)?, [0.95, 0.90], &of));
    out.extend(machine(&seeds)?);
    Ok(out)
}

fn judged(id: &str, what: &str, score: &Score, limits: [f64; 2], of: &str) -> Vec<Figure> {
    let [precision, recall] = limits;
    vec![
        Figure::new(
            format!("forest.stems.{id}.precision"),
            score.precision(),
            Limit::AtLeast(precision),
            format!("{what}: share of the stems that are trees, {of}"),
        ),
        Figure::new(
            format!("forest.stems.{id}.recall"),
            score.recall(),
            Limit::AtLeast(recall),
            format!("{what}: share of the trees with ten returns that are found, {of}"),
        ),
    ]
}

fn grown(seed: u64) -> Outcome<Forest> {
    Forest::grow(Growth::default(), seed).map_err(|e| e.to_string())
}

fn one(seed: u64, pattern: &Pattern) -> Outcome<Score> {
    let forest = grown(seed)?;
    let seen = forest.scan(pattern, &ERRORS, [0.0; 2], ABOVE, 0.3, seed);
    let stems = detected(&seen).stems;
    Ok(score(&forest, &[(&seen, [0.0; 2], 0.3)], &stems, WITHIN))
}

fn one_os1(seed: &u64) -> Outcome<Score> {
    one(*seed, &Pattern::os1_64())
}

fn one_vlp(seed: &u64) -> Outcome<Score> {
    one(*seed, &Pattern::vlp_16())
}

fn detected(seen: &[Seen]) -> Detection {
    Detector::default().detect(&Scan::from_origin(points(seen)))
}

fn ten_vlp(seed: &u64) -> Outcome<Score> {
    let forest = grown(*seed)?;
    let places: Vec<[f64; 2]> = (0..10).map(|k| [0.5 * f64::from(k), 0.0]).collect();
    let turn = |(k, at): (u64, &[f64; 2])| forest.scan(&Pattern::vlp_16(), &ERRORS, *at, ABOVE, 0.0, k);
    let turns: Vec<Vec<Seen>> = (0..).zip(&places).map(turn).collect();
    let scans: Vec<Scan> = turns.iter().map(|t| Scan::from_origin(points(t))).collect();
    let eye = forest.eye([0.0; 2], ABOVE);
    let station =
        |at: &[f64; 2]| Station { position: [at[0], at[1], forest.eye(*at, ABOVE) - eye], yaw: 0.0 };
    let all: Vec<(&Scan, Station)> = scans.iter().zip(places.iter().map(station)).collect();
    let stems = Detector::default().detect_all(&all).stems;
    Ok(score(&forest, &[(&turns[0], [0.0; 2], 0.0)], &stems, WITHIN))
}

/// Stands around a machine with two scanners, its own points left out or not.
struct Around {
    /// Trees that each scanner sees, in the frame of the machine, and those of either.
    recalls: [f64; 3],
    pairs: usize,
    false_at_head: [usize; 2],
}

fn around(seed: &u64) -> Outcome<Around> {
    let growth = Growth { clearing_m: 8.0, ..Growth::default() };
    let stand = Stand::grow(&growth, *seed);
    let forest = Forest::around(growth, stand, *seed, &Machine::harvester()).map_err(|e| e.to_string())?;
    let turns: Vec<Vec<Seen>> = (0..)
        .zip(SCANNERS)
        .map(|(k, at)| forest.scan(&Pattern::os1_64(), &ERRORS, at, SCANNER_HEIGHT, 0.0, 2 * seed + k))
        .collect();
    let maps = |own: Option<u32>| -> Vec<Vec<LocalTree>> {
        let mut detector = Detector::default();
        detector.filter.own_bodies.extend(own);
        let map = |(turn, at): (&Vec<Seen>, [f64; 2])| {
            let here = Pose2 { x: at[0], y: at[1], yaw: 0.0 };
            let stems = detector.detect(&Scan::from_origin(points(turn))).stems;
            stems.iter().map(|s| LocalTree::from(s).moved(&here)).collect()
        };
        turns.iter().zip(SCANNERS).map(map).collect()
    };
    let at_head = |maps: &[Vec<LocalTree>]| {
        let near = |t: &&LocalTree| gap(t.place, HEAD) < 0.5;
        merged(maps).iter().filter(near).count()
    };
    let masked = maps(Some(OWN));
    let both = merged(&masked);
    let visible = visible_from_either(&forest, &turns);
    let recall = |map: &[LocalTree]| {
        let found = |p: &&[f64; 2]| map.iter().any(|t| gap(t.place, **p) < 0.5);
        visible.iter().filter(found).count() as f64 / visible.len().max(1) as f64
    };
    let near = |k: usize| both[..k].iter().filter(|b| gap(b.place, both[k].place) < SAME_TREE_M).count();
    Ok(Around {
        recalls: [recall(&masked[0]), recall(&masked[1]), recall(&both)],
        pairs: (0..both.len()).map(near).sum(),
        false_at_head: [at_head(&maps(None)), at_head(&masked)],
    })
}

/// Trees of which either scanner sees ten returns, in the frame of the machine.
fn visible_from_either(forest: &Forest, turns: &[Vec<Seen>]) -> Vec<[f64; 2]> {
    let mut numbers: Vec<usize> = turns
        .iter()
        .zip(SCANNERS)
        .flat_map(|(turn, at)| forest.visible(turn, at, 0.0, WITHIN, 10))
        .map(|(tree, _)| tree)
        .collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.into_iter().map(|k| forest.stand.trees[k].place()).collect()
}

fn gap(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

fn machine(seeds: &[u64]) -> Outcome<Vec<Figure>> {
    let all = in_parallel(seeds, around).into_iter().collect::<Outcome<Vec<Around>>>()?;
    let n = all.len() as f64;
    let mean = |k: usize| all.iter().map(|a| a.recalls[k]).sum::<f64>() / n;
    let wrong = |k: usize, wanted: usize| all.iter().filter(|a| a.false_at_head[k] != wanted).count() as f64;
    let of = format!("of {} stands", all.len());
    Ok(vec![
        Figure::new(
            "forest.head.seen",
            wrong(0, 1),
            Limit::Equal(0.0),
            format!("F6 cases without exactly one false tree at the felling head, mask off, {of}"),
        ),
        Figure::new(
            "forest.head.masked",
            wrong(1, 0),
            Limit::Equal(0.0),
            format!("F6 cases with a false tree at the felling head, mask on, {of}"),
        ),
        Figure::new(
            "forest.merge.pairs",
            all.iter().map(|a| a.pairs).sum::<usize>() as f64,
            Limit::Equal(0.0),
            format!("F7 pairs of trees within 0.3 m, two scanners, {of}"),
        ),
        Figure::new(
            "forest.merge.recall",
            mean(2),
            Limit::AtLeast(0.95),
            format!("F7 recall of two scanners of what either sees, mean {of}"),
        ),
        Figure::new(
            "forest.merge.gain",
            mean(2) - mean(0).max(mean(1)),
            Limit::AtLeast(0.10),
            format!("F7 recall of two scanners less that of the better one, mean {of}"),
        ),
    ])
}
