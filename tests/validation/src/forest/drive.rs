//! F12, F15: drives of 30 m with a bad map, and of 75 m in which the machine is carried off.

use super::{Context, Figure, Limit};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use forest_scenes::{Drive, Driven, TrialKind};
use terraglue_forest::Survey;

fn drives(noise_m: f64, kidnapped: Option<(u64, f64)>, way: f64, count: u64) -> Outcome<Vec<Driven>> {
    let survey = Survey { noise_m, missing: 0.3, extra: 0.1 };
    let kind = TrialKind { survey, diameter_m: None, seen: 35, local_m: 0.05 };
    let drive = Drive { kind, way, gnss_m: 14.0, kidnapped };
    let seeds: Vec<u64> = (0..count).collect();
    in_parallel(&seeds, |seed| drive.run(*seed).map_err(|e| e.to_string())).into_iter().collect()
}

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let count = if context.quick { 20 } else { 200 };
    let air = drives(0.5, None, 30.0, count)?;
    let carried = drives(0.1, Some((5, 12.0)), 75.0, count / 4)?;
    Ok(judged(&air, &carried))
}

fn judged(air: &[Driven], carried: &[Driven]) -> Vec<Figure> {
    let share = |all: &[Driven], holds: &dyn Fn(&Driven) -> bool| {
        all.iter().filter(|d| holds(d)).count() as f64 / all.len() as f64
    };
    let points: Vec<(f64, f64)> = air.iter().flat_map(|d| d.errors.clone()).collect();
    let beyond = points.iter().filter(|(error, bound)| error > bound).count() as f64;
    let p95 = quantile(air);
    let believed = |all: &[Driven]| all.iter().map(|d| d.believed).sum::<usize>();
    let wrong = air.iter().chain(carried).map(|d| d.wrong).sum::<usize>() as f64;
    let both = (believed(air) + believed(carried)) as f64;
    let of = format!(
        "{} drives of 30 m, noise 0.5 m, 30 % missing, 10 % extra, GNSS off by up to 20 m",
        air.len()
    );
    vec![
        Figure::new(
            "forest.drive.right",
            share(air, &|d| d.best <= 0.5),
            Limit::AtLeast(0.99),
            format!("F12 share with an error of at most 0.5 m at the end, {of}"),
        ),
        Figure::new(
            "forest.drive.located",
            share(air, &|d| d.last.is_some()),
            Limit::None,
            format!("share with a pose that is believed at the end, {of}"),
        ),
        Figure::new(
            "forest.drive.p95",
            p95,
            Limit::AtMost(0.5),
            format!("F15 error at the quantile 0.95, m, {of}"),
        ),
        Figure::new(
            "forest.drive.beyond",
            beyond / points.len().max(1) as f64,
            Limit::AtMost(0.01),
            format!("share of {} errors that exceed their bound, {of}", points.len()),
        ),
        Figure::new(
            "forest.drive.wrong",
            wrong / both.max(1.0),
            Limit::AtMost(0.005),
            format!("F13 share of wrong ones among {both} matches on the way that are believed"),
        ),
        Figure::new(
            "forest.kidnapped.found",
            share(carried, &|d| d.last.is_some_and(|(error, bound)| error <= 0.5 && error <= bound)),
            Limit::AtLeast(0.99),
            format!(
                "F15 share that is found again within 60 m, {} drives, carried off by 12 m",
                carried.len()
            ),
        ),
    ]
}

/// Error of the estimates at the end that 95 % of them do not exceed, m.
fn quantile(all: &[Driven]) -> f64 {
    let mut errors: Vec<f64> = all.iter().filter_map(|d| Some(d.last?.0)).collect();
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() * 95 / 100).copied().unwrap_or(f64::NAN)
}
