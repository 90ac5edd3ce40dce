//! Random worlds against a loop over all shapes whose intersections are found by other means: the same hit, at the same distance.

use proptest::prelude::*;
use random_scenes::{Candidate, Heights, Piece, STEP, lend, naive, rays, scenes};
use terraglue_subsystem::{Ray, RayHit, RayMask, ShapeRef, World};
use terraglue_world::{WorldBuilder, WorldModel};

/// A world of pieces; the ground belongs to the first.
fn world(pieces: &[Piece], heights: &Heights) -> WorldModel {
    let mut builder = WorldBuilder::new();
    for piece in pieces {
        builder.subsystem(&piece.name, &piece.scene, piece.states().0, &piece.is_fixed()).expect("a scene");
    }
    builder.ground(0, &heights.info()).expect("a ground");
    let mut world = builder.build(STEP[0]);
    let mut update = world.update(STEP);
    for (k, piece) in (0..).zip(pieces) {
        let (before, after) = piece.states();
        update.bodies(k, before, after).expect("states");
    }
    let tiles = heights.tiles();
    update.ground(0, lend(&tiles, heights, 1)).expect("heights");
    drop(update);
    world
}

fn cast(world: &WorldModel, rays: &[Ray]) -> Vec<RayHit> {
    let mut hits = vec![RayHit::MISS; rays.len()];
    world.cast_rays(rays, &RayMask::ALL, &mut hits);
    hits
}

/// Whether a hit is right: at the nearest distance, and of something that is there. None: the ray grazes something before.
fn is_right(hit: &RayHit, candidates: &[Candidate]) -> Option<bool> {
    let nearest = candidates.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
    let close = |a: f64, b: f64| a == b || (a - b).abs() <= 1e-5_f64.max(1e-5 * b);
    let of = ShapeRef { subsystem: hit.subsystem, body: hit.body, shape: hit.shape };
    let there = |c: &&Candidate| c.shape == of && close(c.distance, nearest);
    let right = close(hit.distance, nearest) && (!hit.is_hit() || candidates.iter().any(|c| there(&c)));
    if !right && candidates.iter().any(|c| c.depth < 1e-8) { None } else { Some(right) }
}

/// (wrong, grazing) of some rays through a world of so many bodies.
fn wrong(seed: u64, bodies: usize, count: usize) -> (Vec<String>, usize) {
    let (pieces, heights) = scenes(seed, bodies);
    let world = world(&pieces, &heights);
    let rays = rays(seed, bodies, count);
    let (mut wrong, mut grazing) = (Vec::new(), 0);
    for (ray, hit) in rays.iter().zip(cast(&world, &rays)) {
        let mut candidates = naive(&pieces, &[(0, &heights)], ray);
        match is_right(&hit, &candidates) {
            Some(true) => {}
            Some(false) => {
                candidates.sort_by(|a, b| a.distance.total_cmp(&b.distance));
                candidates.truncate(2);
                wrong.push(format!("{ray:?}\n{hit:?}\n{candidates:?}"));
            }
            None => grazing += 1,
        }
    }
    (wrong, grazing)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn a_hit_is_that_of_a_loop_over_all_shapes(seed in any::<u64>(), scale in 0.0..2.5_f64) {
        let bodies = 10_f64.powf(scale) as usize;
        let (wrong, grazing) = wrong(seed, bodies, 200);
        prop_assert!(wrong.is_empty(), "{} of 200 with {bodies} bodies: {}", wrong.len(), wrong[0]);
        prop_assert!(grazing <= 2, "{grazing} of 200 rays graze something");
    }
}

#[test]
fn ten_thousand_bodies_hide_nothing() {
    let (wrong, _) = wrong(11, 10_000, 300);
    assert!(wrong.is_empty(), "{} of 300: {}", wrong.len(), wrong[0]);
}
