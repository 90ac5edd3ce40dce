//! Rays through worlds drawn at random against a loop over all shapes whose intersections are found by other means; the same
//! answers in any order of subsystems and on any number of threads.

use super::scenes::{cast, told};
use super::{Context, Figure, Limit};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use random_scenes::{Heights, Piece, drawn, is_right, naive, rays, scenes, tolerance};
use std::sync::Arc;
use terraglue_numerics::extremes::{larger, smaller};
use terraglue_subsystem::RayHit;
use terraglue_world::Parallel;

/// Counts over the rays through some worlds.
#[derive(Clone, Copy, Default)]
struct RayCounts {
    rays: usize,
    hits: usize,
    wrong: usize,
    grazing: usize,
    /// Largest error of a distance over the allowed one.
    error: f64,
}

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    // (bodies, worlds, rays through each)
    let cases: &[(usize, u64, usize)] = if context.quick {
        &[(1, 20, 500), (10, 20, 500), (100, 10, 500), (1000, 2, 500), (10_000, 1, 200)]
    } else {
        &[(1, 200, 2000), (10, 200, 2000), (100, 100, 2000), (1000, 40, 2000), (10_000, 10, 2000)]
    };
    let worlds: Vec<(u64, usize, usize)> = cases
        .iter()
        .flat_map(|(bodies, worlds, rays)| (0..*worlds).map(move |seed| (seed, *bodies, *rays)))
        .collect();
    let tallies = in_parallel(&worlds, |(seed, bodies, count)| compared(*seed, *bodies, *count));
    let mut sum = RayCounts::default();
    for tally in tallies {
        let tally = tally?;
        sum.rays += tally.rays;
        sum.hits += tally.hits;
        sum.wrong += tally.wrong;
        sum.grazing += tally.grazing;
        sum.error = larger(sum.error, tally.error);
    }
    let (count, worlds) = (sum.rays, worlds.len());
    let of = format!("of {count} rays through {worlds} worlds of 1 to 10,000 bodies");
    let mut out = vec![
        Figure::new(
            "world.rays.wrong",
            sum.wrong as f64,
            Limit::Equal(0.0),
            format!("answers that a loop over all shapes does not give, {of}"),
        ),
        Figure::new(
            "world.rays.error",
            sum.error,
            Limit::AtMost(1.0),
            "largest error of a distance over the larger of 10 µm and 1e-5 of it",
        ),
        // enough to judge: worlds of one body are mostly missed, and a fifth of the rays is short
        Figure::new(
            "world.rays.hits",
            sum.hits as f64 / count as f64,
            Limit::AtLeast(0.15),
            format!("part that meets something, {of}"),
        ),
        Figure::new(
            "world.rays.grazing",
            sum.grazing as f64 / count as f64,
            Limit::AtMost(1e-3),
            format!("part that grazes a shape by less than 10 nm, of which nobody can say, {of}"),
        ),
    ];
    let (pieces, heights) = scenes(1, 300);
    out.push(order(&pieces, &heights)?);
    out.push(threads(&pieces, &heights)?);
    Ok(out)
}

fn compared(seed: u64, bodies: usize, count: usize) -> Outcome<RayCounts> {
    let (pieces, heights) = scenes(seed, bodies);
    let world = told(drawn(&pieces, &heights, &[0, 1, 2], None))?;
    let rays = rays(seed, bodies, count);
    let mut tally = RayCounts { rays: count, ..RayCounts::default() };
    for (ray, hit) in rays.iter().zip(cast(&world, &rays)) {
        let candidates = naive(&pieces, &[(0, &heights)], ray);
        let nearest = candidates.iter().map(|c| c.distance).fold(f64::INFINITY, smaller);
        match is_right(&hit, &candidates) {
            Some(true) if hit.is_hit() => {
                tally.hits += 1;
                tally.error = larger(tally.error, (hit.distance - nearest).abs() / tolerance(nearest));
            }
            Some(true) => {}
            Some(false) => tally.wrong += 1,
            None => tally.grazing += 1,
        }
    }
    Ok(tally)
}

/// All numbers of an answer, bit by bit.
fn bits(hit: &RayHit) -> [u64; 7] {
    let [x, y, z] = hit.normal.map(f64::to_bits);
    let of = [hit.subsystem, hit.body, hit.shape].map(u64::from);
    [hit.distance.to_bits(), x, y, z, of[0], of[1], of[2]]
}

fn order(pieces: &[Piece], heights: &Heights) -> Outcome<Figure> {
    let rays = rays(1, 300, 5000);
    let mut answers = Vec::new();
    for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
        let world = told(drawn(pieces, heights, &order, None))?;
        let named = |hit: RayHit| match order.get(hit.subsystem as usize) {
            Some(piece) => bits(&RayHit { subsystem: *piece as u32, ..hit }),
            None => bits(&hit),
        };
        answers.push(cast(&world, &rays).into_iter().map(named).collect::<Vec<_>>());
    }
    let differ = |k: usize| answers[0].iter().zip(&answers[k]).filter(|(a, b)| a != b).count();
    let what = "answers of 5000 that differ in a bit in another order of the subsystems, some of whose shapes coincide";
    Ok(Figure::new("world.rays.order", (differ(1) + differ(2)) as f64, Limit::Equal(0.0), what))
}

/// That many threads.
fn on_threads(n: usize) -> Parallel {
    Arc::new(move |count, job| {
        std::thread::scope(|scope| {
            for first in 1..n {
                scope.spawn(move || (first..count).step_by(n).for_each(job));
            }
            (0..count).step_by(n).for_each(job);
        });
    })
}

fn threads(pieces: &[Piece], heights: &Heights) -> Outcome<Figure> {
    let rays = rays(2, 300, 5000);
    let mut answers = Vec::new();
    for parallel in [None, Some(1), Some(2), Some(5)] {
        let world = told(drawn(pieces, heights, &[0, 1, 2], parallel.map(on_threads)))?;
        answers.push(cast(&world, &rays).iter().map(bits).collect::<Vec<_>>());
    }
    let differ =
        answers.iter().map(|a| a.iter().zip(&answers[0]).filter(|(a, b)| a != b).count()).sum::<usize>();
    let what = "answers of 5000 that differ in a bit on 1, 2 or 5 threads";
    Ok(Figure::new("world.rays.threads", differ as f64, Limit::Equal(0.0), what))
}
