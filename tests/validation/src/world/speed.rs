//! Cost of rays: in a second, against Embree, on two threads; and of a step with bodies that move and many that do not.

use super::embree::{Embree, above, os1_64, python, triangles_of, vlp16};
use super::scenes::{stand, told};
use super::{Context, Figure, Limit};
use crate::process::Outcome;
use crate::timing::{cpu_s, median};
use random_scenes::{Piece, Stand, scenes};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;
use terraglue::host::Workers;
use terraglue_subsystem::{Ray, RayHit, RayMask, World};
use terraglue_world::{WorldBuilder, WorldModel};

/// Pairs of rounds of which the median is taken.
const ROUNDS: usize = 21;

pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing {
        return Ok(Vec::new());
    }
    std::fs::create_dir_all(&context.scratch).map_err(|e| e.to_string())?;
    let trees = Stand::new(1, 250);
    let workers = Workers::new(2);
    let (one, two) = (
        stand(&trees, &trees.scene, None)?,
        stand(&trees, &trees.scene, Some(Arc::new(move |n, job| workers.parallel_for(n, job))))?,
    );
    let mut out = Vec::new();
    for (name, rays) in [("vlp16", vlp16(above(&trees))), ("os1_64", os1_64(above(&trees)))] {
        out.extend(rates(context, name, &trees, (&one, &two), &rays)?);
    }
    out.extend(steps()?);
    Ok(out.into_iter().map(Figure::timed).collect())
}

/// CPU time of one round, s.
fn round(world: &WorldModel, rays: &[Ray], hits: &mut [RayHit]) -> f64 {
    let start = cpu_s();
    world.cast_rays(black_box(rays), &RayMask::ALL, hits);
    black_box(&hits);
    cpu_s() - start
}

fn rates(
    context: &Context,
    name: &str,
    trees: &Stand,
    (one, two): (&WorldModel, &WorldModel),
    rays: &[Ray],
) -> Outcome<Vec<Figure>> {
    let mut hits = vec![RayHit::MISS; rays.len()];
    let rate = 1e-6 * rays.len() as f64 / median((0..ROUNDS).map(|_| round(one, rays, &mut hits)).collect());
    let what =
        format!("million rays a second on one thread, {name} in a stand of 250 trees, heights every 0.1 m");
    let mut out = vec![Figure::new(format!("world.speed.{name}.rate"), rate, Limit::None, what)];
    let id = format!("world.speed.{name}.over_embree");
    out.push(match python() {
        Err(why) => Figure::skipped(id, why),
        Ok(_) => {
            let mut embree = Embree::start(&context.scratch, &triangles_of(trees), rays)?;
            let mut pair = || Ok(embree.round()? / round(one, rays, &mut hits));
            let ratios = (0..ROUNDS).map(|_| pair()).collect::<Outcome<Vec<f64>>>()?;
            let what = "rate over that of Embree with the same as triangles, one after the other";
            Figure::new(id, median(ratios), Limit::AtLeast(0.6), format!("{what}, {name}"))
        }
    });
    let mut wall = |world: &WorldModel| {
        let start = Instant::now();
        world.cast_rays(black_box(rays), &RayMask::ALL, &mut hits);
        start.elapsed().as_secs_f64()
    };
    let gains = (0..ROUNDS).map(|_| wall(one) / wall(two)).collect();
    let what = format!("rate on two threads over one, {name}");
    out.push(Figure::new(format!("world.speed.{name}.two_threads"), median(gains), Limit::None, what));
    Ok(out)
}

/// Cost of a step in which a hundred bodies move, without and with ten thousand that do not.
fn steps() -> Outcome<Vec<Figure>> {
    let (moving, _) = scenes(3, 300);
    let (fixed, _) = scenes(4, 10_300);
    let mut alone = world(&moving[0], None)?;
    let mut among = world(&moving[0], Some(&fixed[1]))?;
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..1001 {
        times[0].push(step(&mut alone, &moving[0])?);
        times[1].push(step(&mut among, &moving[0])?);
    }
    let [alone, among] = times.map(median);
    let (bodies, shapes) = (moving[0].scene.bodies.len(), moving[0].scene.shapes.len());
    let what = format!("ms to take a step in which {bodies} bodies with {shapes} shapes move");
    let more = format!("the same beside {} shapes that are fixed, over it", fixed[1].scene.shapes.len());
    Ok(vec![
        Figure::new("world.speed.step", 1e3 * alone, Limit::AtMost(0.1), what),
        Figure::new("world.speed.step.fixed", among / alone, Limit::AtMost(1.1), more),
    ])
}

fn world(moving: &Piece, fixed: Option<&Piece>) -> Outcome<WorldModel> {
    let mut builder = WorldBuilder::new();
    for piece in [Some(moving), fixed].into_iter().flatten() {
        told(builder.subsystem(&piece.name, &piece.scene, piece.states().0, &piece.is_fixed()))?;
    }
    Ok(builder.build(0.0))
}

fn step(world: &mut WorldModel, moving: &Piece) -> Outcome<f64> {
    let (before, after) = moving.states();
    let start = cpu_s();
    told(world.update([0.0, 0.01]).bodies(0, black_box(before), black_box(after)))?;
    Ok(cpu_s() - start)
}
