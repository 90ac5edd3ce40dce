//! F8, F9, F13: a kidnapped machine is found on a map of 450 stems, and accepted poses are right.

use super::{Context, Figure, Limit};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use forest_scenes::{Tally, TrialKind, TrialRow};
use terraglue_forest::Survey;

/// A row of 450 stems.
pub fn row(noise_m: f64, [missing, extra]: [f64; 2], seen: usize, trials: u64) -> TrialRow {
    let kind =
        TrialKind { survey: Survey { noise_m, missing, extra }, diameter_m: None, seen, local_m: 0.05 };
    TrialRow { kind, trees: 450, trials, radius: None, right: 1.0 }
}

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let trials = if context.quick { 150 } else { 500 };
    let rows = [
        ("F8", "8", row(0.03, [0.0; 2], 8, trials)),
        ("F8", "20", row(0.03, [0.0; 2], 20, trials)),
        ("F9", "missing-extra", row(0.03, [0.3, 0.5], 20, trials)),
        ("F9", "noise", row(0.3, [0.0; 2], 20, trials)),
    ];
    let tallies = in_parallel(&rows, |(_, _, row)| row.run(|_, _, _, _| ()).map_err(|e| e.to_string()));
    let (mut out, mut sum) = (Vec::new(), Tally::default());
    for ((line, name, row), tally) in rows.iter().zip(tallies) {
        let tally = tally?;
        let noise = row.kind.survey.noise_m > 0.1;
        let (share, median, p95) = match *line {
            "F8" => (0.99, Some(0.04), Some(0.10)),
            _ if noise => (0.95, Some(0.12), None),
            _ => (0.98, None, None),
        };
        out.extend(judged(line, name, row, &tally, share, [(0.5, median), (0.95, p95)]));
        sum.trials += tally.trials;
        sum.accepted += tally.accepted;
        sum.wrong_accepted += tally.wrong_accepted;
    }
    out.extend(integrity(&sum));
    out.extend(from_the_air(trials)?);
    Ok(out)
}

/// F10 on a made-up stand: tops of crowns lie 1.3 m from their stems (rms), diameters follow from heights within 5 cm; a plot is searched
/// within 10 m. With few stems an answer may be refused, but not be wrong.
fn from_the_air(trials: u64) -> Outcome<Vec<Figure>> {
    let tops = Survey { noise_m: 1.3 / std::f64::consts::SQRT_2, missing: 0.1, extra: 0.05 };
    let plot = |seen: usize| {
        let kind = TrialKind { survey: tops, diameter_m: Some(0.05), seen, local_m: 0.05 };
        TrialRow { kind, trees: 450, trials, radius: Some(10.0), right: 1.5 }
    };
    let rows = [plot(35), plot(12)];
    let tallies = in_parallel(&rows, |row| row.run(|_, _, _, _| ()).map_err(|e| e.to_string()));
    let tallies: Vec<Tally> = tallies.into_iter().collect::<Outcome<_>>()?;
    let of = format!("tops of crowns 1.3 m off their stems, prior of 10 m, {trials} plots");
    let believed = |t: &Tally| (t.accepted - t.wrong_accepted) as f64 / t.trials as f64;
    Ok(vec![
        Figure::new(
            "forest.air.35.right",
            tallies[0].share(),
            Limit::AtLeast(0.95),
            format!("F10 share of plots of 35 stems whose best pose is right within 1.5 m, {of}"),
        ),
        Figure::new(
            "forest.air.35.believed",
            believed(&tallies[0]),
            Limit::AtLeast(0.95),
            format!("F10 share of them that are right and unambiguous, {of}"),
        ),
        Figure::new(
            "forest.air.12.wrong",
            tallies[1].wrong_accepted as f64,
            Limit::Equal(0.0),
            format!("F10 plots of 12 stems that believe a wrong pose, {of}"),
        ),
    ])
}

fn judged(
    line: &str,
    name: &str,
    row: &TrialRow,
    tally: &Tally,
    share: f64,
    errors: [(f64, Option<f64>); 2],
) -> Vec<Figure> {
    let of = format!("{} trees of a map of 450, {} trials", row.kind.seen, tally.trials);
    let id = |what: &str| format!("forest.match.{name}.{what}");
    let mut out = vec![Figure::new(
        id("right"),
        tally.share(),
        Limit::AtLeast(share),
        format!("{line} share of right poses, kidnapped, {of}"),
    )];
    for (part, limit) in errors {
        let limit = limit.map_or(Limit::None, Limit::AtMost);
        let what = format!("{line} error of the place at the quantile {part}, m, {of}");
        out.push(Figure::new(id(&format!("p{:.0}", 100.0 * part)), tally.error(part), limit, what));
    }
    out
}

/// Accepted poses of all trials.
pub fn integrity(sum: &Tally) -> Vec<Figure> {
    let accepted = sum.accepted.max(1) as f64;
    vec![
        Figure::new(
            "forest.integrity.wrong",
            sum.wrong_accepted as f64 / accepted,
            Limit::AtMost(0.005),
            format!("F13 share of wrong ones among {} poses that are believed", sum.accepted),
        ),
        Figure::new(
            "forest.integrity.accepted",
            accepted / sum.trials as f64,
            Limit::AtLeast(0.6),
            format!("F13 share of poses that are believed, of {} trials", sum.trials),
        ),
    ]
}
