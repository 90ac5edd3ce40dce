//! Worlds of drawn scenes and of a stand of trees.

use crate::process::Outcome;
use random_scenes::{Heights, Piece, STEP, Stand, lend};
use terraglue_subsystem::{Ray, RayHit, RayMask, Scene, World};
use terraglue_world::{Parallel, WorldBuilder, WorldModel};

/// What is wrong with a world, as text.
pub fn told<T>(result: terraglue_world::Result<T>) -> Outcome<T> {
    result.map_err(|e| e.to_string())
}

/// A drawn world whose subsystems are added in an order; the ground belongs to the first piece.
pub fn drawn(
    pieces: &[Piece],
    heights: &Heights,
    order: &[usize],
    parallel: Option<Parallel>,
) -> Outcome<WorldModel> {
    let mut builder = WorldBuilder::new();
    for piece in order.iter().map(|k| &pieces[*k]) {
        told(builder.subsystem(&piece.name, &piece.scene, piece.states().0, &piece.is_fixed()))?;
    }
    let owner = order.iter().position(|k| *k == 0).unwrap_or(0) as u32;
    told(builder.ground(owner, &heights.info()))?;
    if let Some(parallel) = parallel {
        builder.parallel(parallel);
    }
    let mut world = builder.build(STEP[0]);
    let mut update = world.update(STEP);
    for (number, k) in (0..).zip(order) {
        let (before, after) = pieces[*k].states();
        told(update.bodies(number, before, after))?;
    }
    let tiles = heights.tiles();
    told(update.ground(owner, lend(&tiles, heights, 1)))?;
    drop(update);
    Ok(world)
}

/// A stand that is fixed, on its ground, with other shapes where they are given.
pub fn stand(stand: &Stand, scene: &Scene, parallel: Option<Parallel>) -> Outcome<WorldModel> {
    let mut builder = WorldBuilder::new();
    told(builder.subsystem("stand", scene, &stand.states, &vec![true; stand.states.len()]))?;
    told(builder.ground(0, &stand.heights.info()))?;
    if let Some(parallel) = parallel {
        builder.parallel(parallel);
    }
    let mut world = builder.build(0.0);
    let tiles = stand.heights.tiles();
    told(world.update([0.0; 2]).ground(0, lend(&tiles, &stand.heights, 1)))?;
    Ok(world)
}

/// What all rays meet.
pub fn cast(world: &WorldModel, rays: &[Ray]) -> Vec<RayHit> {
    let mut hits = vec![RayHit::MISS; rays.len()];
    world.cast_rays(rays, &RayMask::ALL, &mut hits);
    hits
}
