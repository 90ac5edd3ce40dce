//! F12: maps from the air over noise, prior, trees that are seen and errors of the map; and the same likelihood searched by brute force.

use super::{Context, Figure, Limit};
use crate::documents::replace;
use crate::parallel::in_parallel;
use crate::process::Outcome;
use forest_scenes::{Tally, Trial, TrialKind, TrialRow, local};
use std::f64::consts::TAU;
use terraglue_forest::Survey;
use terraglue_tree_localisation::{Matcher, Pose2, Prior};

const NOISES: [f64; 3] = [0.1, 0.5, 1.0];
const PRIORS: [Option<f64>; 3] = [None, Some(20.0), Some(10.0)];
const SEEN: [usize; 5] = [6, 8, 12, 20, 35];
const ERRORS: [[f64; 2]; 2] = [[0.0, 0.0], [0.3, 0.1]];

fn row(noise_m: f64, radius: Option<f64>, seen: usize, [missing, extra]: [f64; 2], trials: u64) -> TrialRow {
    let kind =
        TrialKind { survey: Survey { noise_m, missing, extra }, diameter_m: None, seen, local_m: 0.05 };
    TrialRow { kind, trees: 450, trials, radius, right: 1.5 }
}

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let trials = if context.quick { 12 } else { 200 };
    let seed = (0..if context.quick { 12 } else { 60 }).collect::<Vec<u64>>();
    let pairs = in_parallel(&seed, |number| against_brute_force(*number));
    let pairs = pairs.into_iter().collect::<Outcome<Vec<[bool; 2]>>>()?;
    let share = |k: usize| pairs.iter().filter(|p| p[k]).count() as f64 / pairs.len() as f64;
    let of = format!("noise 0.5 m, 30 % missing, 10 % extra, prior 20 m, 35 trees, {} trials", pairs.len());
    let mut out = vec![
        Figure::new(
            "forest.air.one-scan",
            share(0),
            Limit::AtLeast(0.75),
            format!("F12 share of right poses of one scan, {of}"),
        ),
        Figure::new(
            "forest.air.behind",
            share(1) - share(0),
            Limit::AtMost(0.03),
            format!("F12 by how much a search over all poses is right more often, {of}"),
        ),
    ];
    if !context.quick {
        let tallies = table(trials)?;
        let mut sum = Tally::default();
        for tally in &tallies {
            sum.trials += tally.trials;
            sum.accepted += tally.accepted;
            sum.wrong_accepted += tally.wrong_accepted;
        }
        out.push(Figure::new(
            "forest.air.wrong",
            sum.wrong_accepted as f64 / sum.accepted.max(1) as f64,
            Limit::AtMost(0.005),
            format!("F13 share of wrong ones among {} poses of the sweep that are believed", sum.accepted),
        ));
    }
    Ok(out)
}

/// All rows; writes the table of docs/forest.md.
fn table(trials: u64) -> Outcome<Vec<Tally>> {
    let mut rows = Vec::new();
    for errors in ERRORS {
        for noise in NOISES {
            rows.extend(PRIORS.iter().flat_map(|p| SEEN.map(|seen| (errors, noise, *p, seen))));
        }
    }
    let run = |(errors, noise, prior, seen): &([f64; 2], f64, Option<f64>, usize)| {
        row(*noise, *prior, *seen, *errors, trials).run(|_, _, _, _| ()).map_err(|e| e.to_string())
    };
    let tallies = in_parallel(&rows, run).into_iter().collect::<Outcome<Vec<Tally>>>()?;
    let mut text = String::from("| missing / extra | noise, m | prior, m |");
    SEEN.iter().for_each(|n| text += &format!(" {n} trees |"));
    text += "\n|---|---|---|";
    text += &"---|".repeat(SEEN.len());
    for (row, tallies) in rows.chunks(SEEN.len()).zip(tallies.chunks(SEEN.len())) {
        let ([missing, extra], noise, prior, _) = row[0];
        let prior = prior.map_or("none".to_owned(), |p| p.to_string());
        text += &format!("\n| {:.0} % / {:.0} % | {noise} | {prior} |", 100.0 * missing, 100.0 * extra);
        for t in tallies {
            let accepted = t.accepted as f64 / t.trials as f64;
            text += &format!(" {:.0} / {:.0} |", 100.0 * t.share(), 100.0 * accepted);
        }
    }
    replace("docs/forest.md", &[("sweep", text + "\n")])?;
    Ok(tallies)
}

/// Whether the matcher and a search over all poses of the prior are right.
fn against_brute_force(number: u64) -> Outcome<[bool; 2]> {
    let mut row = row(0.5, Some(20.0), 35, [0.3, 0.1], number + 1);
    row.trees = 1000;
    let (growth, stand) = forest_scenes::stand_of(row.trees, 7);
    let trial = row.kind.trial(&growth, &stand, number);
    let map = forest_scenes::map(&trial).map_err(|e| e.to_string())?;
    let matcher = Matcher::with(map, row.model());
    let truth = trial.pose();
    let prior = row.prior(&truth, number).ok_or("a prior")?;
    let right = |pose: &Pose2| pose.gap(&truth).0 < row.right && pose.gap(&truth).1 < 0.2;
    let answer = matcher.find(&local(&trial, row.kind.local_m), Some(&prior));
    let found = forest_scenes::best(&answer).is_some_and(|(f, _)| right(&f.pose));
    Ok([found, right(&brute_force(&matcher, &trial, &row, &prior))])
}

/// The best pose of a lattice over the prior, climbed from the best of its nodes.
fn brute_force(matcher: &Matcher, trial: &Trial, row: &TrialRow, prior: &Prior) -> Pose2 {
    let seen = local(trial, row.kind.local_m);
    let score = matcher.scores(&seen);
    let (step, turns) = (0.6, 120);
    let half = (prior.radius / step) as i32;
    let mut nodes: Vec<(f64, Pose2)> = Vec::new();
    for (i, j) in (-half..=half).flat_map(|i| (-half..=half).map(move |j| (i, j))) {
        if i * i + j * j > half * half {
            continue;
        }
        for k in 0..turns {
            let yaw = TAU * f64::from(k) / f64::from(turns);
            let [x, y] = [prior.place[0] + step * f64::from(i), prior.place[1] + step * f64::from(j)];
            let pose = Pose2 { x, y, yaw };
            nodes.push((score(&pose), pose));
        }
    }
    nodes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let climbed = nodes.iter().take(40).map(|(s, pose)| climbed(&score, *s, *pose));
    let best = climbed.max_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(Pose2::default(), |(_, pose)| pose)
}

/// Steps to whatever neighbour is better, which become smaller where none is.
fn climbed(score: &impl Fn(&Pose2) -> f64, start: f64, mut pose: Pose2) -> (f64, Pose2) {
    let (mut best, mut step) = (start, 0.3);
    while step > 0.01 {
        let around = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.08]];
        let moved = |[x, y, t]: [f64; 3], s: f64| Pose2 {
            x: pose.x + s * x,
            y: pose.y + s * y,
            yaw: pose.yaw + s * t,
        };
        let all = around.into_iter().flat_map(|a| [moved(a, step), moved(a, -step)]);
        let next = all.map(|p| (score(&p), p)).max_by(|a, b| a.0.total_cmp(&b.0));
        match next.filter(|(s, _)| *s > best) {
            Some((s, p)) => (best, pose) = (s, p),
            None => step *= 0.5,
        }
    }
    (best, pose)
}
