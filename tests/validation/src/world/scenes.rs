//! Worlds of drawn scenes and of a stand of trees.

use crate::process::Outcome;
use random_scenes::{Stand, lend};
use terraglue_subsystem::{Ray, RayHit, RayMask, Scene, World};
use terraglue_world::{Parallel, WorldBuilder, WorldModel};

/// The error of a world as text.
pub fn told<T>(result: terraglue_world::Result<T>) -> Outcome<T> {
    result.map_err(|e| e.to_string())
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

/// The first hits of all rays.
pub fn cast(world: &WorldModel, rays: &[Ray]) -> Vec<RayHit> {
    let mut hits = vec![RayHit::MISS; rays.len()];
    world.cast_rays(rays, &RayMask::ALL, &mut hits);
    hits
}
